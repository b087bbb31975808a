"""A gauge study: how much a length scatters by itself and by who lays the gauge (analysis of variance, two ways
crossed, random effects, as measurement systems analysis has it).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s

_SPREAD = 6.0
"""A width of six standard deviations holds 99.7 % of a normal scatter; it is compared with the width of the limits."""


@dataclass(frozen=True)
class Study:
    """Standard deviations, mm: of one operator's placements, between operators, and of operators with certain lengths.

    `of_limits`: six of all together, as a share of the width from the lower to the upper limit.
    """

    lengths: int
    operators: int
    placements: int
    repeatability_mm: float
    operators_mm: float
    interaction_mm: float
    of_limits: float

    @property
    def reproducibility_mm(self) -> float:
        """What operators do, with and without the interaction."""
        return float(np.hypot(self.operators_mm, self.interaction_mm))

    @property
    def total_mm(self) -> float:
        """Repeatability and reproducibility together."""
        return float(np.hypot(self.repeatability_mm, self.reproducibility_mm))


def gauge_study(errors_mm: Float64s, limit_mm: float) -> Study:
    """The study of errors, shape (lengths, operators, placements), two of each or more; raise ParameterError.

    Variances that come out below nothing are nothing.
    """
    if errors_mm.ndim != 3 or min(errors_mm.shape) < 2 or not np.isfinite(errors_mm).all():
        raise ParameterError(
            f"a study of {' x '.join(str(count) for count in errors_mm.shape)} lengths, operators and placements: "
            "expected two or more of each, all measured"
        )
    parts, people, repeats = errors_mm.shape
    cells = errors_mm.mean(axis=2)
    by_part, by_person, mean = cells.mean(axis=1), cells.mean(axis=0), float(errors_mm.mean())
    rest = cells - by_part[:, None] - by_person[None, :] + mean
    within = _mean_square((errors_mm - cells[:, :, None]) ** 2, parts * people * (repeats - 1))
    together = repeats * _mean_square(rest**2, (parts - 1) * (people - 1))
    person = parts * repeats * _mean_square((by_person - mean) ** 2, people - 1)
    interaction = max(together - within, 0.0) / repeats
    operators = max(person - together, 0.0) / (parts * repeats)
    total = float(np.sqrt(within + interaction + operators))
    return Study(
        parts,
        people,
        repeats,
        float(np.sqrt(within)),
        float(np.sqrt(operators)),
        float(np.sqrt(interaction)),
        _SPREAD * total / (2 * limit_mm),
    )


def _mean_square(squares: Float64s, freedom: int) -> float:
    return float(squares.sum()) / freedom
