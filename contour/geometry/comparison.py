"""How far an outline lies from another, in place or after the best turn and shift; and how much many scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring, densified

SPACING_MM = 1.0
MOST_SAMPLES = 4000
_STARTS = 24
_COARSE = 240


@dataclass(frozen=True)
class Deviation:
    """Distances between two outlines, both ways, mm; bias is positive where the seen one lies outside."""

    mean_mm: float
    p95_mm: float
    worst_mm: float
    bias_mm: float
    turn_deg: float = 0.0
    shift_mm: tuple[float, float] = (0.0, 0.0)


def compare(seen: Contour, master: Contour, *, fit: bool) -> Deviation:
    """The deviation of the seen outline from the master, rings without loss; with `fit` after the best rigid motion.

    Raises ParameterError where they have different numbers of holes.
    """
    if len(seen.holes) != len(master.holes):
        raise ParameterError(
            f"the seen outline has {len(seen.holes)} holes, the master {len(master.holes)}: another part, or face"
        )
    turn, shift = rigid_fit(seen, master) if fit else (0.0, np.zeros(2))
    moved = Contour(*_moved_rings(seen, turn, shift))
    there, back = _samples(moved), _samples(master)
    signed = _signed(there, master)
    both = np.concatenate([np.abs(signed), np.abs(_signed(back, moved))])
    middle = np.concatenate(seen.rings).mean(axis=0)
    x, y = (_rotated(middle[None], turn)[0] + shift - middle).tolist()
    return Deviation(
        float(both.mean()),
        float(np.percentile(both, 95)),
        float(both.max()),
        float(signed.mean()),
        float(np.degrees(turn)),
        (x, y),
    )


def scatter_mm(outlines: Sequence[Contour]) -> Float64s:
    """Standard deviation, at places 1 mm apart along the first outline, of where all outlines cross there, (N,), mm."""
    places = _samples(outlines[0])
    if any(len(outline.holes) != len(outlines[0].holes) for outline in outlines):
        raise ParameterError("the outlines have different numbers of holes: the scene is not still, or light changes")
    offsets = np.stack([_signed(places, outline) for outline in outlines])
    return np.asarray(offsets.std(axis=0, ddof=1))


def rigid_fit(seen: Contour, master: Contour) -> tuple[float, Float64s]:
    """Turn in radians and shift (2,) that lay the seen outline onto the master; any turn is tried.

    Point to line (Chen and Medioni, 1992): each point's distance to its nearest edge, least squares, again and again.
    """
    points, coarse = _samples(seen), _samples(seen)
    coarse = coarse[:: max(len(coarse) // _COARSE, 1)]
    starts = [_settled(coarse, master, angle, 12) for angle in np.arange(_STARTS) * 2 * np.pi / _STARTS]
    angle, shift, _ = min(starts, key=lambda one: one[2])
    angle, shift, _ = _settled(points, master, angle, 12, shift)
    return angle, shift


def _settled(
    points: Float64s, master: Contour, angle: float, steps: int, shift: Float64s | None = None
) -> tuple[float, Float64s, float]:
    """The fit from a start, and its mean square distance."""
    if shift is None:
        shift = _samples(master).mean(axis=0) - _rotated(points, angle).mean(axis=0)
    rest = np.zeros(0)
    for _ in range(steps):
        now = _rotated(points, angle) + shift
        nearest, normal = _nearest(now, master)
        rest = ((now - nearest) * normal).sum(axis=1)
        arm = now - shift
        turning = normal[:, 1] * arm[:, 0] - normal[:, 0] * arm[:, 1]
        step = np.linalg.lstsq(np.column_stack([turning, normal]), -rest, rcond=None)[0]
        angle, shift = angle + float(np.clip(step[0], -0.3, 0.3)), shift + step[1:]
        if np.abs(step).max() < 1e-9:
            break
    return angle, np.asarray(shift), float((rest**2).mean())


def _nearest(points: Float64s, outline: Contour) -> tuple[Float64s, Float64s]:
    """The nearest point of any ring to each point, and the outward normal of its edge, (N, 2) both."""
    start = np.concatenate(outline.rings)
    end = np.concatenate([np.roll(ring, -1, axis=0) for ring in outline.rings])
    along = end - start
    length2 = np.maximum((along**2).sum(axis=1), 1e-12)
    nearest, edge = np.empty_like(points), np.empty(len(points), np.intp)
    for first in range(0, len(points), 256):
        part = points[first : first + 256]
        offset = part[:, None] - start
        share = np.clip((offset * along).sum(axis=2) / length2, 0, 1)
        feet = start + share[:, :, None] * along
        best = ((part[:, None] - feet) ** 2).sum(axis=2).argmin(axis=1)
        nearest[first : first + 256] = feet[np.arange(len(part)), best]
        edge[first : first + 256] = best
    # Exterior counter-clockwise, holes clockwise: outside lies to the right of every edge.
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.sqrt(length2)[:, None]
    return nearest, normal[edge]


def _signed(points: Float64s, outline: Contour) -> Float64s:
    """Distance of each point to the outline, positive where it lies outside, (N,)."""
    nearest, normal = _nearest(points, outline)
    rest = points - nearest
    return np.asarray(np.hypot(*rest.T) * np.where((rest * normal).sum(axis=1) < 0, -1.0, 1.0))


def _samples(outline: Contour) -> Float64s:
    length = sum(float(np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).sum()) for ring in outline.rings)
    spacing = max(SPACING_MM, length / MOST_SAMPLES)
    return np.concatenate([densified(ring, spacing) for ring in outline.rings])


def _rotated(points: Float64s, angle: float) -> Float64s:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))


def _moved_rings(outline: Contour, angle: float, shift: Float64s) -> tuple[Ring, tuple[Ring, ...]]:
    rings = [_rotated(ring, angle) + shift for ring in outline.rings]
    return rings[0], tuple(rings[1:])
