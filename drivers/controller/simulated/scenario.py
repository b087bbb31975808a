"""What the machine behind the simulated controller does of its own accord: events, played on a controller."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from itertools import cycle
from typing import Any, Literal, get_args

from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.faults import FaultPlan, LineFault
from drivers.controller.simulated.program import Judge, Pace, Reply, TriggerNotPossible
from drivers.controller.simulated.window import ServerLimits

EventKind = Literal[
    "trigger",
    "busy",
    "not-ready",
    "machine-fault",
    "refuse",
    "slow-scan",
    "halt",
    "restart",
    "switch-off",
    "unplug",
    "foreign-service",
]
EVENT_KINDS: dict[EventKind, str] = {
    "trigger": "asks for `burst` measurements with `recipe` and `thickness_mm`, one after the other",
    "busy": "controller_state 2 for `for_s`",
    "not-ready": "controller_state 0 for `for_s`",
    "machine-fault": "controller_state 3 for `for_s`",
    "refuse": "the next `count` contours get `answer`: 4 geometry refused, 7 operator refused",
    "slow-scan": "a scan every `scan_ms` for `for_s`",
    "halt": "the program stands still for `for_s`, as a PLC in STOP; then it starts anew",
    "restart": "the program starts anew, `keep_registers` or not, `keep_memory` or not",
    "switch-off": "nothing listens for `for_s`; then it starts anew with empty registers",
    "unplug": "the line is cut for `for_s`: connections end, nobody can connect; the program goes on",
    "foreign-service": "for `for_s` another service writes the service block too: its `owner`, its heartbeat moving",
}
assert set(EVENT_KINDS) == set(get_args(EventKind))
KINDS_OF: dict[str, tuple[EventKind, ...]] = {
    "for_s": ("busy", "not-ready", "machine-fault", "slow-scan", "halt", "switch-off", "unplug", "foreign-service"),
    **dict.fromkeys(("burst", "recipe", "thickness_mm", "force"), ("trigger",)),
    **dict.fromkeys(("answer", "count"), ("refuse",)),
    "scan_ms": ("slow-scan",),
    **dict.fromkeys(("keep_registers", "keep_memory"), ("restart",)),
}
"""Which events a key says anything of; those that are not named here say something of all."""
STATES = {"busy": 2, "not-ready": 0, "machine-fault": 3}
JITTER = 0.2  # of every_s, so that what is periodic does not keep step with the client
LOOK_S = 0.002
FOREIGN_OWNER, FOREIGN_BEAT_S = 4711, 0.3


@dataclass(frozen=True)
class Event:
    """Something that happens at `at_s` seconds after the start, and every `every_s` seconds (0: only then).

    force: a trigger against the protocol's rules, while the service is not Ready or another one is open.
    """

    do: EventKind
    at_s: tuple[float, ...] = ()
    every_s: float = 0.0
    for_s: float = 1.0
    burst: int = 1
    recipe: int = 0
    thickness_mm: float = 0.0
    force: bool = False
    answer: Literal[4, 7] = 7
    count: int = 1
    scan_ms: float = 100.0
    keep_registers: bool = False
    keep_memory: bool = True


@dataclass(frozen=True)
class MachineSettings:
    """How the program runs. first_trigger: the session's first trigger_counter. sessions: of the starts, in turn.

    torn: see Pace. max_registers, write_single, answer_as: see ServerLimits.
    """

    scan_ms: float = 10.0
    clock: bool = True
    clock_start_ms: int = 0
    first_trigger: int = 1
    sessions: tuple[int, ...] = ()
    copy_scans: int = 1
    check_scans: int = 0
    stepwise: bool = False
    torn: bool = False
    max_registers: int = 125
    write_single: bool = True
    answer_as: int | None = None


@dataclass(frozen=True)
class Scenario:
    """A machine, what it does, and what befalls the line; random ones depend on the seed."""

    seed: int = 0
    machine: MachineSettings = field(default_factory=MachineSettings)
    events: tuple[Event, ...] = ()
    faults: tuple[LineFault, ...] = ()


def machine_options(scenario: Scenario) -> dict[str, Any]:
    """The arguments of a SimulatedController that the scenario fixes."""
    machine = scenario.machine
    options: dict[str, Any] = {
        "scan_s": machine.scan_ms / 1000,
        "has_clock": machine.clock,
        "clock_start_ms": machine.clock_start_ms,
        "first_trigger": machine.first_trigger,
        "pace": Pace(machine.copy_scans, machine.check_scans, machine.stepwise, machine.torn),
        "limits": ServerLimits(machine.max_registers, machine.write_single, machine.answer_as),
        "faults": FaultPlan(scenario.faults, scenario.seed),
    }
    if machine.sessions:
        options["session_source"] = cycle(machine.sessions).__next__
    return options


class Play:
    """Plays the events of a scenario on a running controller."""

    def __init__(self, controller: SimulatedController, scenario: Scenario) -> None:
        self._controller = controller
        self._scenario = scenario
        self._chance = random.Random(scenario.seed)
        self._judge: Judge = controller.judge
        self._usual_scan_s = controller.scan_s
        self._refusals: list[int] = []
        self._off = asyncio.Lock()
        self._states: list[int] = []
        self._scans_s: list[float] = []
        controller.judge = self._judged

    async def play_for_ever(self) -> None:
        """Play until cancelled; when nothing more will happen, wait."""
        await self.run()
        await asyncio.Event().wait()

    async def run(self) -> None:
        """Play; return when nothing more will happen."""
        async with asyncio.TaskGroup() as group:
            for event in self._scenario.events:
                for at_s in event.at_s:
                    group.create_task(self._once(event, at_s))
                if event.every_s:
                    group.create_task(self._again_and_again(event))

    async def _once(self, event: Event, at_s: float) -> None:
        await asyncio.sleep(at_s)
        await self._do(event)

    async def _again_and_again(self, event: Event) -> None:
        while True:
            await asyncio.sleep(event.every_s * self._chance.uniform(1 - JITTER, 1 + JITTER))
            await self._do(event)

    async def _do(self, event: Event) -> None:
        self._controller.verdict.tell("event", do=event.do)
        if event.do in STATES:
            await self._in_state(STATES[event.do], event.for_s)
        elif event.do == "refuse":
            self._refusals += [event.answer] * event.count
        else:
            acts: dict[str, Callable[[Event], Awaitable[None]]] = {
                "trigger": self._trigger,
                "slow-scan": self._slow_scan,
                "halt": self._halt,
                "restart": self._restart,
                "switch-off": self._switch_off,
                "unplug": self._unplug,
                "foreign-service": self._foreign_service,
            }
            await acts[event.do](event)

    def _judged(self, contour: AcceptedContour) -> int:
        verdict = self._judge(contour)
        return self._refusals.pop(0) if verdict == Reply.ACCEPTED and self._refusals else verdict

    async def _in_state(self, state: int, seconds: float) -> None:
        self._states.append(state)
        self._controller.set_state(state)
        await asyncio.sleep(seconds)
        self._states.remove(state)  # spells may overlap, and end in another order than they began
        self._controller.set_state(self._states[-1] if self._states else 1)

    async def _trigger(self, event: Event) -> None:
        for _ in range(event.burst):
            while not event.force and not self._controller.can_request:
                await asyncio.sleep(LOOK_S)
            try:
                self._controller.request_measurement(event.recipe, round(event.thickness_mm * 1000), force=event.force)
            except TriggerNotPossible:  # the program is starting
                return
            await asyncio.sleep(self._controller.scan_s)

    async def _slow_scan(self, event: Event) -> None:
        scan_s = event.scan_ms / 1000
        self._scans_s.append(scan_s)
        self._controller.scan_s = scan_s
        await asyncio.sleep(event.for_s)
        self._scans_s.remove(scan_s)
        self._controller.scan_s = self._scans_s[-1] if self._scans_s else self._usual_scan_s

    async def _halt(self, event: Event) -> None:
        self._controller.halt()
        await asyncio.sleep(event.for_s)
        self._controller.restart(keep_registers=True)

    async def _restart(self, event: Event) -> None:
        self._controller.restart(keep_registers=event.keep_registers, forget=not event.keep_memory)

    async def _foreign_service(self, event: Event) -> None:
        loop = asyncio.get_running_loop()
        until, beat = loop.time() + event.for_s, 0
        while loop.time() < until:
            beat += 1
            self._controller.write_as_another(FOREIGN_OWNER, beat)
            await asyncio.sleep(FOREIGN_BEAT_S)

    async def _switch_off(self, event: Event) -> None:
        async with self._off:
            await self._controller.switch_off()
            await asyncio.sleep(event.for_s)
            await self._controller.switch_on()

    async def _unplug(self, event: Event) -> None:
        async with self._off:
            await self._controller.unplug()
            await asyncio.sleep(event.for_s)
            await self._controller.plug_in()
