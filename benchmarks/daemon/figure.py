"""One measured figure beside its goal."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One line of the table."""

    what: str
    value: float
    unit: str
    goal: float

    @property
    def met(self) -> bool:
        """True where the value is not above its goal."""
        return self.value <= self.goal

    def __str__(self) -> str:
        return f"| {self.what} | {self.value:.2f} {self.unit} | ≤ {self.goal:g} {self.unit} | {_yes(self.met)} |"


def _yes(met: bool) -> str:
    return "yes" if met else "**no**"
