"""A milled block, traced: the distances between its opposite sides, and how straight the traced sides are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration
from contour.errors import GaugeNotSeen
from contour.geometry.arrays import Float64s
from contour.geometry.rings import densified
from contour.length_test.seen_gauge import SeenGauge, SeenLength, SeenLine, straightness_mm

HEIGHT_STEP_MM = 1.0
SIDES = ("right", "top", "left", "bottom")
"""Of a block whose longer way runs along x."""

_SPACING_MM = 1.0
_CORNER_SHARE = 0.1
"""What a caliper does not touch: corners are rounded, burred and broken."""

_SIZE_SHARE = 0.1
"""A traced side farther off than this share is of another block than the one that was told."""

_SQUARE_SHARE = 0.05

_FORM_SHARE = 0.95
"""As much of the outline as a contour's own bound is stated for; a torn wall or two in a side may be farther off."""

_FEWEST_POINTS = 8


@dataclass(frozen=True, eq=False)
class _Side:
    """Points of one side, (N, 2), and its line: where it passes the block's middle, and the unit normal outwards."""

    points: Float64s
    middle: Float64s
    normal: Float64s


def seen_block(
    ring_px: Float64s, names: tuple[str, str], sizes_mm: tuple[float, float], calibration: Calibration, height_mm: float
) -> SeenGauge:
    """The rectangular block whose outline was traced, pixels (N, 2), its top at z = `height_mm`.

    `names` and `sizes_mm` are of its two lengths, the longer first. Raise GaugeNotSeen where the outline is no such
    block, and CalibrationError.
    """
    ring = calibration.to_machine(calibration.to_work(ring_px, height_mm))
    higher = calibration.to_machine(calibration.to_work(ring_px, height_mm + HEIGHT_STEP_MM))
    turn = _turn(ring)
    sides, grown = _sides(ring, turn), _sides(higher, turn)
    lengths = []
    for name, told_mm, first in zip(names, sizes_mm, (0, 1), strict=True):
        one, other = sides[first], sides[first + 2]
        measured = _apart(one, other)
        if abs(measured / told_mm - 1) > _SIZE_SHARE:
            raise GaugeNotSeen(
                f"the traced block is {measured:.1f} mm where length {name} is {told_mm:g} mm: another block, or the "
                "gauge's file is in another unit"
            )
        more = _apart(grown[first], grown[first + 2]) - measured
        ends = np.array([other.middle, one.middle])
        lengths.append(SeenLength(name, measured, ends, more / HEIGHT_STEP_MM))
    lines = tuple(
        SeenLine(name, straightness_mm(side.points, _FORM_SHARE)) for name, side in zip(SIDES, sides, strict=True)
    )
    return SeenGauge(tuple(lengths), lines, ring, float(np.degrees(turn)))


def _turn(ring: Float64s) -> float:
    """The direction of the ring's longer way, radians, by its edges; those of a rectangle agree modulo a quarter."""
    edges = np.roll(ring, -1, axis=0) - ring
    weights = np.linalg.norm(edges, axis=1)
    four = 4 * np.arctan2(edges[:, 1], edges[:, 0])
    turn = float(np.arctan2((weights**2 * np.sin(four)).sum(), (weights**2 * np.cos(four)).sum())) / 4
    wide, high = np.ptp(ring @ _axes(turn).T, axis=0)
    return turn if wide >= high else turn + np.pi / 2


def _axes(turn: float) -> Float64s:
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, s], [-s, c]])


def _sides(ring: Float64s, turn: float) -> list[_Side]:
    """Right, top, left and bottom in the block's own axes."""
    axes = _axes(turn)
    points = densified(ring, _SPACING_MM) @ axes.T
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    away = (points - middle) / half
    sides = []
    for axis, sign in ((0, 1.0), (1, 1.0), (0, -1.0), (1, -1.0)):
        on = (sign * away[:, axis] > 1 - _SQUARE_SHARE) & (np.abs(away[:, 1 - axis]) < 1 - 2 * _CORNER_SHARE)
        if np.count_nonzero(on) < _FEWEST_POINTS or float(np.ptp(away[on, 1 - axis])) < 1.0:
            raise GaugeNotSeen("the outline has no four straight sides: it is no rectangular block, or not all of it")
        own = points[on] @ axes
        base = own.mean(axis=0)
        _, _, lines = np.linalg.svd(own - base, full_matrices=False)
        normal = lines[1] * np.sign(lines[1] @ axes[axis] * sign)
        sides.append(_Side(own, base + lines[0] * float((middle @ axes - base) @ lines[0]), normal))
    return sides


def _apart(one: _Side, other: _Side) -> float:
    """The mean of each side's distance from the other's line, mm: what does not depend on which is the base."""
    across = one.middle - other.middle
    return float((across @ one.normal - across @ other.normal) / 2)
