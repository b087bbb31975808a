"""The verdict on a calibration, in millimetres: two independent halves, propagated noise, coverage, and a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from contour.calibration.position_uncertainty import PositionUncertainty
from contour.camera_calibration.calibration_spread import covariance, on_plane, position_variances
from contour.camera_calibration.coverage_zones import Zones, covered_zones
from contour.camera_calibration.length_check import LengthCheck, rounded_up
from contour.camera_calibration.lens_models import LensModel, Observed, Progress, residuals, solve
from contour.camera_calibration.residual_structure import structure_px
from contour.camera_calibration.student_t import two_sided_95
from contour.geometry.arrays import Float64s
from contour.image import opencv_boards as cv

SPLITS = 5
ROWS, COLUMNS = 13, 17
"""Places of the maps; corners of the picture are places."""

_TAKEN_BY_THE_CAMERA = 6
"""Views, not corners, are the independent observations, and about six of them go into the camera's numbers. The bound
is Student's for the rest, times the root of both axes' variances: 95 % where all error runs along one axis (a scale, a
tilt), more where it runs all ways."""

CORNER_BIAS_PX = 0.01
"""What all corners of an area may be off by alike, as rendered views show it; more views do not take it away."""

MOSTLY_COVERED = 0.5
"""Below this share of the picture only the covered part may be used. Of places beyond 57 % the 95 % bound held 99 in
100, 94 in the worst of 8 cameras; beyond 35 % it held 93 and, in the worst, 28."""

STRUCTURE_PX = 0.05


_ADVICE_STEP_MM = 0.01
"""Solved again, the last digits differ: what is advised leaves room for that."""


class Judgement(Enum):
    """What a person does with a calibration; the value is the plain sentence's beginning."""

    GOOD = "good"
    CONTRADICTED = "this contradicts what was measured by hand"
    MORE_TILT = "repeat with more tilt"
    MORE_COVERAGE = "repeat with views that reach the whole area"
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

    @property
    def accept_apart(self) -> float: ...

    @property
    def area_px(self) -> tuple[float, float, float, float] | None: ...

    @property
    def accept_uncovered(self) -> bool: ...


@dataclass(frozen=True)
class _Fault:
    """What speaks against a calibration, and the option by which a person takes it all the same."""

    judgement: Judgement
    text: str
    option: str
    value: float = 0.0


@dataclass(frozen=True, eq=False)
class Verdict:
    """How sure a calibration is. Maps have shape (heights, ROWS, COLUMNS), mm, over the whole picture.

    `overrides` are the options that, given together, take a calibration that is not good; empty where it is.
    `halves_mm` is how far apart two calibrations from independent halves of the views lie, root mean square over the
    splits; `inflation` how much more than propagated noise that is, never under 1: the figures carry it.
    """

    judgement: Judgement
    sentence: str
    overrides: tuple[str, ...]
    uncertainty: PositionUncertainty
    halves_mm: Float64s
    inflation: float
    zones: Zones
    structure_px: float
    mm_per_px: float

    @property
    def good(self) -> bool:
        """True where the calibration may be used."""
        return self.judgement is Judgement.GOOD


@dataclass(frozen=True, eq=False)
class Solution:
    """A camera solved from views of `size` (width, height), whose work plane is that of view number `plane`."""

    size: tuple[int, int]
    model: LensModel
    solved: cv.Solved
    plane: int


def judge_calibration(
    views: Sequence[Observed],
    solution: Solution,
    demands: Demands,
    lengths: Sequence[LengthCheck],
    on_progress: Progress,
) -> Verdict:
    """The verdict on a solution, and on lengths that it gives."""
    size, model, solved, plane = solution.size, solution.model, solution.solved, solution.plane
    heights = np.array(sorted({0.0, demands.block_mm / 2, demands.block_mm, 2 * demands.block_mm}))
    grid = places(size)
    lifted = heights - demands.board_thickness_mm
    spread = covariance(views, solved, model, plane)
    variances = [position_variances(solved, model, plane, spread, grid, height) for height in lifted]
    propagated = np.stack([np.sqrt(np.trace(one, axis1=1, axis2=2)) for one in variances])
    halves = _halves(views, solution, lifted, grid, on_progress)
    zones = covered_zones([view.pixels for view in views], size)
    inside = zones.inside(grid)
    inflation = _inflation(halves[:, inside], propagated[:, inside])
    shape = (len(heights), ROWS, COLUMNS)
    sigmas = two_sided_95(max(len(views) - _TAKEN_BY_THE_CAMERA, 2))
    mm_per_px = _scale(solved, plane, size)
    bounds = finite(np.hypot(sigmas * inflation * propagated, CORNER_BIAS_PX * mm_per_px)).reshape(shape)
    figures = np.array([float(np.percentile(one.reshape(-1)[inside], 95)) for one in bounds])
    covered = None if demands.accept_uncovered or zones.covered_share >= MOSTLY_COVERED else zones.hull_px
    sure = PositionUncertainty(size[0], size[1], heights, figures, bounds, covered)
    structure = structure_px([view.pixels for view in views], residuals(views, solved), size)
    faults = [
        *_contradictions(lengths, demands),
        *_wrong_model(structure, mm_per_px, demands),
        *_uncovered(zones, demands),
        *_too_unsure(sure, demands),
    ]
    return Verdict(
        faults[0].judgement if faults else Judgement.GOOD,
        f"{faults[0].judgement.value}: {faults[0].text}." if faults else _good(sure, zones, demands),
        _overrides(faults),
        sure,
        finite(halves).reshape(shape),
        inflation,
        zones,
        structure,
        mm_per_px,
    )


def places(size: tuple[int, int]) -> Float64s:
    """The pixels of the maps' places, row by row, shape (ROWS * COLUMNS, 2)."""
    across, down = np.meshgrid(np.linspace(0, size[0] - 1, COLUMNS), np.linspace(0, size[1] - 1, ROWS))
    return np.column_stack([across.ravel(), down.ravel()])


def finite(values: Float64s) -> Float64s:
    """The values, those that are no numbers (a lens model folds over there) as the largest of the others."""
    bad = ~np.isfinite(values)
    return np.where(bad, values[~bad].max(initial=0.0), values) if bad.any() else values


def _halves(
    views: Sequence[Observed], solution: Solution, heights: Float64s, grid: Float64s, on_progress: Progress
) -> Float64s:
    """Distance between the maps of two halves, root mean square over the splits, shape (heights, places), mm."""
    solved, plane = solution.solved, solution.plane
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
            found = solve(half, solution.size, solution.model, (solved.camera_matrix, solved.distortion))
            if found is None:
                break
            maps.append([on_plane(found, found.rotations[0], found.translations[0], grid, one) for one in heights])
        if len(maps) == 2:
            squares += ((np.array(maps[0]) - np.array(maps[1])) ** 2).sum(axis=2)
            used += 1
    if not used:
        return np.full(squares.shape, np.inf)
    return np.asarray(np.sqrt(squares / used))


def _inflation(halves: Float64s, propagated: Float64s) -> float:
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


def _contradictions(lengths: Sequence[LengthCheck], demands: Demands) -> list[_Fault]:
    faults = [(check, check.fault(demands.accept_apart)) for check in lengths]
    return [
        _Fault(Judgement.CONTRADICTED, text, "--accept-apart-percent", check.needed_percent)
        for check, text in faults
        if text is not None
    ]


def _wrong_model(structure: float, mm_per_px: float, demands: Demands) -> list[_Fault]:
    if structure <= STRUCTURE_PX or structure * mm_per_px <= demands.accept_mm / 2:
        return []
    text = (
        f"corners miss it by {structure:.2f} px in the same direction over whole zones of the picture. Check that "
        "the board is flat and the focus locked; otherwise the lens is wider than these models hold"
    )
    return [_Fault(Judgement.WRONG_MODEL, text, "--accept-mm", rounded_up(2 * structure * mm_per_px, _ADVICE_STEP_MM))]


def _uncovered(zones: Zones, demands: Demands) -> list[_Fault]:
    """The corners of the area where blocks lie must have been enclosed; a hull is convex, so the rest then is."""
    if demands.area_px is None or demands.accept_uncovered:
        return []
    left, top, right, bottom = demands.area_px
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    missing = corners[~zones.inside(corners)]
    if not len(missing):
        return []
    places = ", ".join(f"({x:g}, {y:g})" for x, y in missing)
    text = (
        f"corners enclose {zones.text}; of --area-px {places} px {'lies' if len(missing) == 1 else 'lie'} outside. "
        "Bring the board's corners beyond there, or give the smaller area that blocks lie in"
    )
    return [_Fault(Judgement.MORE_COVERAGE, text, "--accept-uncovered")]


def _too_unsure(sure: PositionUncertainty, demands: Demands) -> list[_Fault]:
    table, block = sure.figure_mm(0.0), sure.figure_mm(demands.block_mm)
    if max(table, block) <= demands.accept_mm:
        return []
    needed = rounded_up(max(table, block), _ADVICE_STEP_MM)
    if table <= demands.accept_mm:
        text = (
            f"{_figures(sure, demands)}. Tilt tells distance from focal length: 20 degrees to all four sides, in more "
            "views where it was that already"
        )
        return [_Fault(Judgement.MORE_TILT, text, "--accept-mm", needed)]
    text = f"{_figures(sure, demands)}. Take 12 to 20 views, the board large in them, the picture sharp and still"
    return [_Fault(Judgement.TOO_COARSE, text, "--accept-mm", needed)]


def _good(sure: PositionUncertainty, zones: Zones, demands: Demands) -> str:
    whole = demands.area_px is not None or zones.covered_share >= MOSTLY_COVERED
    where = "" if whole else f" in {100 * zones.covered_share:.0f} % of the picture"
    return f"{Judgement.GOOD.value}{where}: {_figures(sure, demands)}."


def _figures(sure: PositionUncertainty, demands: Demands) -> str:
    table, block = sure.figure_mm(0.0), sure.figure_mm(demands.block_mm)
    return (
        f"95 % of positions are within {table:.3f} mm on the table and {block:.3f} mm at {demands.block_mm:g} mm; "
        f"{demands.accept_mm:g} mm are allowed"
    )


def _overrides(faults: Sequence[_Fault]) -> tuple[str, ...]:
    """Each option once, with the largest value that a fault asks of it."""
    needed: dict[str, float] = {}
    for fault in faults:
        needed[fault.option] = max(needed.get(fault.option, 0.0), fault.value)
    return tuple(f"{option} {value:.9g}" if value else option for option, value in needed.items())
