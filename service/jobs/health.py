"""What keeps the service from being ready: one fault a part, and the state that follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from service.reasons import Reason
from service.records.journal_file import JournalError, JournalFull
from service.state import State, StateMachine

# In this order the first is told: what a person repairs first.
PARTS = ("journal", "storage", "calibration", "controller", "camera", "serial", "in-flight")


@dataclass(frozen=True)
class Fault:
    """Why a part does not work: the reason's code, and a sentence of what was seen.

    starting: it has not been tried yet; at the start that is no error.
    """

    reason: Reason
    text: str
    starting: bool = False


def journal_fault(error: JournalError) -> Fault:
    """What a failed access to the journal means for the service."""
    return Fault(Reason.STORAGE_FULL if isinstance(error, JournalFull) else Reason.INTERNAL_ERROR, str(error))


class Health:
    """Faults by part; every change is followed by the state at once."""

    def __init__(self, machine: StateMachine) -> None:
        self._machine = machine
        self._faults: dict[str, Fault] = {}
        self._warnings: dict[str, str] = {}
        self._job: int | None = None
        self._started = False

    @property
    def state(self) -> State:
        """The service's state."""
        return self._machine.state

    @property
    def reason(self) -> str | None:
        """Why the state is as it is, where it is a fault or a halt."""
        return self._machine.reason

    def listen(self, listener: Callable[[State, str | None], None]) -> None:
        """Tell `listener` of every change of the state."""
        self._machine.listen(listener)

    @property
    def job(self) -> int | None:
        """The job being executed."""
        return self._job

    def first(self) -> Fault | None:
        """The fault to repair first; None where all parts work. Those that are only starting come last."""
        order = [part for part in PARTS if part in self._faults] + [part for part in self._faults if part not in PARTS]
        faults = [self._faults[part] for part in order]
        return min(faults, key=lambda fault: fault.starting, default=None)

    def fault(self, part: str) -> Fault | None:
        """The fault of one part."""
        return self._faults.get(part)

    def faults(self) -> dict[str, Fault]:
        """All faults by part, as they are now; may be called from any thread."""
        return self._faults.copy()

    def halt(self, reason: str) -> None:
        """Halted by a person or at shutdown: no fault ends it."""
        self._machine.change(State.HALTED, reason=reason)

    def resume(self) -> None:
        """End a halt: the state follows the faults again."""
        self._machine.change(State.INITIALIZED)
        self._follow()

    def reset(self) -> None:
        """Begin anew, as at the start, but for a halt."""
        if self._machine.state is not State.HALTED:
            self._machine.change(State.PREOPERATIONAL)
            self._machine.change(State.INITIALIZED)

    def report(self, part: str, fault: Fault | None) -> None:
        """Set or clear the fault of a part."""
        if fault is None:
            self._faults.pop(part, None)
        else:
            self._faults[part] = fault
        self._follow()

    @property
    def warnings(self) -> dict[str, str]:
        """What a person should see to though jobs go on, by part."""
        return dict(self._warnings)

    def warn(self, part: str, text: str | None) -> None:
        """Set or clear the warning of a part; the state does not follow it."""
        if text is None:
            self._warnings.pop(part, None)
        else:
            self._warnings[part] = text

    def start(self) -> None:
        """From here on the state follows the faults; before it is Preoperational."""
        self._started = True
        self._machine.change(State.INITIALIZED)
        self._follow()

    def executing(self, job: int | None) -> None:
        """A job has begun, or, with None, has ended."""
        self._job = job
        self._follow()

    def _follow(self) -> None:
        if not self._started or self._machine.state is State.HALTED:
            return
        fault = self.first()
        if fault is not None and fault.starting and self._machine.state is State.INITIALIZED:
            return
        if fault is not None:
            self._machine.change(State.ERROR, reason=fault.text, job=self._job)
        elif self._job is not None:
            if self._machine.state is not State.SINGLE_EXECUTION:
                self._machine.change(State.READY)
            self._machine.change(State.SINGLE_EXECUTION, job=self._job)
        else:
            self._machine.change(State.READY)
