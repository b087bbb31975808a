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
class Finding:
    """One checked thing. next_step: what to do, where the text does not say it; "" = nothing."""

    part: str
    level: Level
    text: str
    next_step: str = ""


def ok(part: str, text: str) -> Finding:
    """It works."""
    return Finding(part, Level.OK, text)


def warning(part: str, text: str, next_step: str = "") -> Finding:
    """It works, and should be seen to."""
    return Finding(part, Level.WARNING, text, next_step)


def fault(part: str, text: str, next_step: str = "") -> Finding:
    """It does not work."""
    return Finding(part, Level.FAULT, text, next_step)
