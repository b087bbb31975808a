"""Errors against a stated limit, with the uncertainty of the test itself: passed, failed, or not to be decided.

The rule is that of a proof: who states a limit shows that it holds, so the test's uncertainty narrows what passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from contour.calibration.calibration import Calibration
from contour.length_test.coverage import field_px
from contour.length_test.seen_gauge import SeenGauge, SeenLength

COVERAGE_FACTOR = 2.0
"""Expanded uncertainties hold about 95 %."""


class Decision(StrEnum):
    """What errors say of a limit."""

    PASSES = "passes"
    FAILS = "fails"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Limit:
    """What an error may be: a constant, and a part that grows with the length."""

    constant_mm: float
    per_m_mm: float = 0.0

    def at(self, length_mm: float) -> float:
        """The limit for a length, mm."""
        return self.constant_mm + self.per_m_mm * length_mm / 1000.0


@dataclass(frozen=True)
class KnownLength:
    """A length of the gauge and its expanded uncertainty (k = 2), mm, at the reference temperature."""

    name: str
    length_mm: float
    uncertainty_mm: float


@dataclass(frozen=True)
class Conditions:
    """How the gauge lay. The height's uncertainty is expanded (k = 2); the temperature is told against the reference
    one, and its own uncertainty is standard. `expansion_per_k`: share of its length by which the gauge grows.
    """

    height_uncertainty_mm: float
    expansion_per_k: float
    warmer_k: float
    warmer_uncertainty_k: float


@dataclass(frozen=True)
class Budget:
    """Standard uncertainties of one length's error, mm: what the gauge, its warmth and its height do to it."""

    gauge_mm: float
    temperature_mm: float
    height_mm: float

    @property
    def expanded_mm(self) -> float:
        """All of them together, k = 2."""
        return COVERAGE_FACTOR * float(np.hypot(np.hypot(self.gauge_mm, self.temperature_mm), self.height_mm))


def decided(error_mm: float, uncertainty_mm: float, limit_mm: float) -> Decision:
    """Passes where even the error with its uncertainty stays within; fails where it does not even without."""
    if abs(error_mm) + uncertainty_mm <= limit_mm:
        return Decision.PASSES
    return Decision.FAILS if abs(error_mm) - uncertainty_mm > limit_mm else Decision.UNDECIDED


@dataclass(frozen=True)
class LengthError:
    """One length in one picture: measured less true, with its budget and limit."""

    picture: str
    seen: SeenLength
    true_mm: float
    budget: Budget
    limit_mm: float

    @property
    def error_mm(self) -> float:
        """Measured less true."""
        return self.seen.measured_mm - self.true_mm

    @property
    def decision(self) -> Decision:
        """What it says of the limit."""
        return decided(self.error_mm, self.budget.expanded_mm, self.limit_mm)


@dataclass(frozen=True)
class FormError:
    """A straight line of the gauge in one picture: how far it comes out from straight; what the gauge itself may be."""

    picture: str
    line: str
    form_mm: float
    uncertainty_mm: float
    limit_mm: float

    @property
    def decision(self) -> Decision:
        """What it says of the limit."""
        return decided(self.form_mm, self.uncertainty_mm, self.limit_mm)


@dataclass(frozen=True)
class PlaneError:
    """The gauge's plane in one picture: how far a corner of it is from the mean height of all pictures, mm."""

    picture: str
    off_mm: float
    uncertainty_mm: float
    limit_mm: float

    @property
    def decision(self) -> Decision:
        """What it says of the limit."""
        return decided(self.off_mm, self.uncertainty_mm, self.limit_mm)


def plane_errors(seen: Sequence[tuple[str, SeenGauge]], flat_mm: float, limit_mm: float) -> tuple[PlaneError, ...]:
    """The error of the gauge's plane in each picture; none where planes are not seen. The gauge is flat to `flat_mm`.

    Against the mean, for the plate's own size, known to its uncertainty alone, moves all heights alike.
    """
    planes = [(name, gauge.heights_mm) for name, gauge in seen if gauge.heights_mm is not None]
    if not planes:
        return ()
    mean = float(np.mean([heights for _, heights in planes]))
    off = ((name, float(max(heights - mean, key=abs))) for name, heights in planes)
    return tuple(PlaneError(name, one, flat_mm, limit_mm) for name, one in off)


def height_limit_mm(calibration: Calibration, height_mm: float, limit: Limit) -> float:
    """How far a plane may be from its height, mm: as far as shifts no place of the field by more than the limit."""
    low, high = field_px(calibration)
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    shift = calibration.to_work(corners, height_mm + 1.0) - calibration.to_work(corners, height_mm)
    return limit.constant_mm / max(float(np.linalg.norm(shift, axis=1).max()), 1e-6)


def length_errors(
    picture: str, seen: SeenGauge, known: Sequence[KnownLength], conditions: Conditions, limit: Limit
) -> tuple[LengthError, ...]:
    """The error of each length that the picture shows, in the gauge's order."""
    by_name = {length.name: length for length in known}
    found = []
    for length in seen.lengths:
        told = by_name[length.name]
        true = told.length_mm * (1 + conditions.expansion_per_k * conditions.warmer_k)
        budget = Budget(
            told.uncertainty_mm / COVERAGE_FACTOR,
            told.length_mm * conditions.expansion_per_k * conditions.warmer_uncertainty_k,
            abs(length.per_height) * conditions.height_uncertainty_mm / COVERAGE_FACTOR,
        )
        found.append(LengthError(picture, length, true, budget, limit.at(told.length_mm)))
    return tuple(found)


def together(decisions: Sequence[Decision]) -> Decision:
    """One for all: a single failure fails, and what is left undecided does not pass."""
    if not decisions or Decision.FAILS in decisions:
        return Decision.FAILS if decisions else Decision.UNDECIDED
    return Decision.UNDECIDED if Decision.UNDECIDED in decisions else Decision.PASSES
