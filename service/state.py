"""The service's state, by OPC 40100-1 names: one transition table, one change function."""

from __future__ import annotations

import logging
from collections.abc import Callable
from enum import IntEnum

from service.logs import event

log = logging.getLogger("combtrace.state")


class State(IntEnum):
    """`service_state` as the protocol's register carries it."""

    PREOPERATIONAL = 1
    HALTED = 2
    ERROR = 3
    INITIALIZED = 4
    READY = 5
    SINGLE_EXECUTION = 6
    CONTINUOUS_EXECUTION = 7

    @property
    def label(self) -> str:
        """The standard's spelling: `SingleExecution`."""
        return self.name.title().replace("_", "")


# From a state to those it may change to. Halted is reached from everywhere a person may stop the service in.
# Preoperational is reached again by a reset.
TRANSITIONS: dict[State, frozenset[State]] = {
    State.PREOPERATIONAL: frozenset({State.INITIALIZED, State.ERROR, State.HALTED}),
    State.HALTED: frozenset({State.INITIALIZED, State.PREOPERATIONAL}),
    State.ERROR: frozenset({State.INITIALIZED, State.READY, State.HALTED, State.PREOPERATIONAL}),
    State.INITIALIZED: frozenset({State.READY, State.ERROR, State.HALTED, State.PREOPERATIONAL}),
    State.READY: frozenset(
        {State.SINGLE_EXECUTION, State.CONTINUOUS_EXECUTION, State.ERROR, State.HALTED, State.PREOPERATIONAL}
    ),
    State.SINGLE_EXECUTION: frozenset({State.READY, State.ERROR, State.HALTED}),
    State.CONTINUOUS_EXECUTION: frozenset({State.READY, State.ERROR, State.HALTED}),
}


class IllegalTransition(Exception):
    """A change that the transition table does not hold: a defect of the service."""


class StateMachine:
    """The current state and why; `on_change` is told of every change."""

    def __init__(self, on_change: Callable[[State, str | None], None] = lambda _state, _reason: None) -> None:
        self.state = State.PREOPERATIONAL
        self.reason: str | None = None
        self._listeners = [on_change]

    def listen(self, listener: Callable[[State, str | None], None]) -> None:
        """Tell `listener` of every change from now on."""
        self._listeners.append(listener)

    def change(self, new: State, *, reason: str | None = None, job: int | None = None) -> None:
        """Change to `new`, with a reason where it is a fault; raise IllegalTransition. The same again does nothing."""
        if new is self.state and reason == self.reason:
            return
        if new is not self.state and new not in TRANSITIONS[self.state]:
            raise IllegalTransition(f"state {self.state.label} -> {new.label} is not in the transition table")
        sentence = f"state {self.state.label} -> {new.label}"
        if reason is not None:
            sentence += f' reason="{reason}"'
        if job is not None:
            sentence += f" job={job}"
        fields = event("state", before=self.state.label, state=new.label, reason=reason, job=job)
        log.log(logging.WARNING if new is State.ERROR else logging.INFO, sentence, extra=fields)
        self.state, self.reason = new, reason
        for listener in self._listeners:
            listener(new, reason)
