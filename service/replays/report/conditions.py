"""Conditions on which a run counts as failed: `flips>0`, `p99_shift_mm>0.1`."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass

from service.replays.errors import ReplayError
from service.replays.report.summary import Summary

NAMES = tuple(Summary().figures())
_FORM = re.compile(r"\s*(?P<name>[^<>=\s]*)\s*(?P<sign>[<>=!]*)\s*(?P<limit>.*?)\s*")


@dataclass(frozen=True)
class Condition:
    """A figure beyond which a run counts as failed. sign: > or >=."""

    name: str
    sign: str
    limit: float

    def __str__(self) -> str:
        return f"{self.name}{self.sign}{self.limit:g}"

    def met(self, figures: dict[str, float | None]) -> bool:
        """True where it holds, or cannot be told: what nobody could look at has not passed."""
        value = figures[self.name]
        return value is None or (value > self.limit if self.sign == ">" else value >= self.limit)


def condition(text: str) -> Condition:
    """The condition that a text says; raise ReplayError."""
    found = _FORM.fullmatch(text)
    assert found is not None  # each part may be empty
    name, sign, limit = found["name"], found["sign"], found["limit"]
    if name not in NAMES:
        near = difflib.get_close_matches(name, NAMES, n=1)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(NAMES)}"
        raise ReplayError(f"--fail-on {text}: {name!r} is no figure of a run; {hint}")
    if sign not in (">", ">="):
        raise ReplayError(f"--fail-on {text}: expected {name}>NUMBER or {name}>=NUMBER, quoted for the shell")
    try:
        value = float(limit)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value < 0:
        raise ReplayError(f"--fail-on {text}: {limit!r} is no number from 0 on, expected e.g. {name}{sign}0.1")
    return Condition(name, sign, value)
