"""One checked thing: how it stands, what was seen, and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """How a checked thing stands; the worst counts."""

    OK = 0
    WARNING = 1
    FAULT = 2

    @property
    def label(self) -> str:
        """As it is printed: a fault must catch the eye."""
        return {Level.OK: "ok", Level.WARNING: "warn", Level.FAULT: "FAULT"}[self]


@dataclass(frozen=True)
class CheckResult:
    """One checked thing. next_step: what to do, where the text does not say it; "" = nothing."""

    part: str
    level: Level
    text: str
    next_step: str = ""

    @property
    def well(self) -> bool:
        """True where there is nothing to do."""
        return self.level is Level.OK


def ok(part: str, text: str) -> CheckResult:
    """It works."""
    return CheckResult(part, Level.OK, text)


def warning(part: str, text: str, next_step: str = "") -> CheckResult:
    """It works, and should be seen to."""
    return CheckResult(part, Level.WARNING, text, next_step)


def fault(part: str, text: str, next_step: str = "") -> CheckResult:
    """It does not work."""
    return CheckResult(part, Level.FAULT, text, next_step)
