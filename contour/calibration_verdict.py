"""The verdict on a calibration, in millimetres: two independent halves, propagated noise, coverage, and a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from contour import _cv_boards as cv
from contour.calibration_spread import covariance, on_plane, position_variances
from contour.coverage_zones import Zones, covered_zones
from contour.lens_models import LensModel, Observed, Progress, residuals, solve
from contour.position_uncertainty import PositionUncertainty
from contour.residual_structure import structure_px
from contour.student import two_sided_95

Floats = NDArray[np.float64]

SPLITS = 5
ROWS, COLUMNS = 13, 17
"""Places of the maps; corners of the picture are places."""

_TAKEN_BY_THE_CAMERA = 6
"""Views, not corners, are the independent observations, and about six of them go into the camera's numbers. The bound
is Student's for the rest, times the root of both axes' variances: 95 % where all error runs along one axis (a scale, a
tilt), more where it runs all ways."""

CORNER_BIAS_PX = 0.01
"""What all corners of an area may be off by alike, as rendered views show it; more views do not take it away."""

LEAST_COVERED = 0.5
STRUCTURE_PX = 0.05


class Judgement(Enum):
    """What a person does with a calibration; the value is the plain sentence's beginning."""

    GOOD = "good"
    MORE_TILT = "repeat with more tilt"
    MORE_COVERAGE = "repeat with views that reach the whole picture"
    WRONG_MODEL = "this lens is not held by this model"
    TOO_COARSE = "repeat with more and sharper views"


class Demands(Protocol):
    """What the verdict needs to be told."""

    @property
    def block_mm(self) -> float: ...

    @property
    def accept_mm(self) -> float: ...

    @property
    def board_thickness_mm(self) -> float: ...


@dataclass(frozen=True, eq=False)
class Verdict:
    """How sure a calibration is. Maps have shape (heights, ROWS, COLUMNS), mm, over the whole picture.

    `halves_mm` is how far apart two calibrations from independent halves of the views lie, root mean square over the
    splits; `inflation` how much more than propagated noise that is, never under 1: the figures carry it.
    """

    judgement: Judgement
    sentence: str
    uncertainty: PositionUncertainty
    halves_mm: Floats
    inflation: float
    zones: Zones
    structure_px: float
    mm_per_px: float

    @property
    def good(self) -> bool:
        """True where the calibration may be used."""
        return self.judgement is Judgement.GOOD


def judge_calibration(
    views: Sequence[Observed],
    size: tuple[int, int],
    model: LensModel,
    solved: cv.Solved,
    plane: int,
    demands: Demands,
    on_progress: Progress,
) -> Verdict:
    """The verdict on a solution whose work plane is that of view number `plane`."""
    heights = np.array(sorted({0.0, demands.block_mm / 2, demands.block_mm, 2 * demands.block_mm}))
    grid = places(size)
    lifted = heights - demands.board_thickness_mm
    spread = covariance(views, solved, model, plane)
    variances = [position_variances(solved, model, plane, spread, grid, height) for height in lifted]
    propagated = np.stack([np.sqrt(np.trace(one, axis1=1, axis2=2)) for one in variances])
    halves = _halves(views, size, model, solved, plane, lifted, grid, on_progress)
    zones = covered_zones([view.pixels for view in views], size)
    inside = zones.inside(grid)
    inflation = _inflation(halves[:, inside], propagated[:, inside])
    shape = (len(heights), ROWS, COLUMNS)
    sigmas = two_sided_95(max(len(views) - _TAKEN_BY_THE_CAMERA, 2))
    mm_per_px = _scale(solved, plane, size)
    bounds = finite(np.hypot(sigmas * inflation * propagated, CORNER_BIAS_PX * mm_per_px)).reshape(shape)
    figures = np.array([float(np.percentile(one.reshape(-1)[inside], 95)) for one in bounds])
    sure = PositionUncertainty(size[0], size[1], heights, figures, bounds)
    structure = structure_px([view.pixels for view in views], residuals(views, solved), size)
    judgement, sentence = _judged(sure, zones, structure, mm_per_px, demands)
    return Verdict(judgement, sentence, sure, finite(halves).reshape(shape), inflation, zones, structure, mm_per_px)


def places(size: tuple[int, int]) -> Floats:
    """The pixels of the maps' places, row by row, shape (ROWS * COLUMNS, 2)."""
    across, down = np.meshgrid(np.linspace(0, size[0] - 1, COLUMNS), np.linspace(0, size[1] - 1, ROWS))
    return np.column_stack([across.ravel(), down.ravel()])


def finite(values: Floats) -> Floats:
    """The values, those that are no numbers (a lens model folds over there) as the largest of the others."""
    bad = ~np.isfinite(values)
    return np.where(bad, values[~bad].max(initial=0.0), values) if bad.any() else values


def _halves(
    views: Sequence[Observed],
    size: tuple[int, int],
    model: LensModel,
    solved: cv.Solved,
    plane: int,
    heights: Floats,
    grid: Floats,
    on_progress: Progress,
) -> Floats:
    """Distance between the maps of two halves, root mean square over the splits, shape (heights, places), mm."""
    rng = np.random.default_rng(len(views))
    others = [index for index in range(len(views)) if index != plane]
    squares, used = np.zeros((len(heights), len(grid))), 0
    for split in range(SPLITS):
        on_progress(f"solving two independent halves, split {split + 1} of {SPLITS}")
        order = rng.permutation(others)
        maps = []
        for which in (0, 1):
            # Both halves need the plane view: each takes every other corner of it.
            half = [views[plane].half(which), *(views[index] for index in order[which::2])]
            found = solve(half, size, model, (solved.camera_matrix, solved.distortion))
            if found is None:
                break
            maps.append([on_plane(found, found.rotations[0], found.translations[0], grid, one) for one in heights])
        if len(maps) == 2:
            squares += ((np.array(maps[0]) - np.array(maps[1])) ** 2).sum(axis=2)
            used += 1
    if not used:
        return np.full(squares.shape, np.inf)
    return np.asarray(np.sqrt(squares / used))


def _inflation(halves: Floats, propagated: Floats) -> float:
    """How much farther apart two halves lie than propagated noise says, at least 1.

    Half the views have twice the variance, and the difference of two halves twice that again: half their distance is to
    compare with the whole's deviation.
    """
    seen, expected = float((halves**2).mean()) / 4, float((propagated**2).mean())
    return max(1.0, float(np.sqrt(seen / expected))) if expected > 0 and np.isfinite(seen) else float("inf")


def _scale(solved: cv.Solved, plane: int, size: tuple[int, int]) -> float:
    middle = np.array([[(size[0] - 1) / 2, (size[1] - 1) / 2]])
    ends = on_plane(
        solved,
        solved.rotations[plane],
        solved.translations[plane],
        middle + np.array([[-0.5, 0.0], [0.5, 0.0]]),
        0.0,
    )
    return float(np.linalg.norm(ends[1] - ends[0]))


def _judged(
    sure: PositionUncertainty, zones: Zones, structure: float, mm_per_px: float, demands: Demands
) -> tuple[Judgement, str]:
    table, block = sure.figure_mm(0.0), sure.figure_mm(demands.block_mm)
    figures = (
        f"95 % of positions are within {table:.3f} mm on the table and {block:.3f} mm at {demands.block_mm:g} mm; "
        f"{demands.accept_mm:g} mm are allowed"
    )
    if structure > STRUCTURE_PX and structure * mm_per_px > demands.accept_mm / 2:
        kind = Judgement.WRONG_MODEL
        text = (
            f"corners miss it by {structure:.2f} px in the same direction over whole zones of the picture. Check that "
            "the board is flat and the focus locked; otherwise the lens is wider than these models hold"
        )
    elif zones.covered_share < LEAST_COVERED:
        kind = Judgement.MORE_COVERAGE
        text = f"corners cover {100 * zones.covered_share:.0f} % of it, {100 * LEAST_COVERED:.0f} % or more are needed"
    elif table <= demands.accept_mm and block <= demands.accept_mm:
        return Judgement.GOOD, f"good: {figures}."
    elif table <= demands.accept_mm:
        kind = Judgement.MORE_TILT
        text = f"{figures}. Tilt tells distance from focal length: 20 degrees to all four sides"
    else:
        kind = Judgement.TOO_COARSE
        text = f"{figures}. Take 12 to 20 views, the board large in them, the picture sharp and still"
    return kind, f"{kind.value}: {text}."
