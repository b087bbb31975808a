"""How sure the fit is: the standard deviation of each vertex, and the share of the outline that nothing witnesses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, rolled
from contour.outline.lines_and_arcs import Models, feet
from contour.outline.runs import Segments, stretch
from contour.outline.witnesses import Witnesses

_SHARPEST_SINE = 0.2
# Pitches.
_MOST = 1.0
_MOST_FREE = 0.25
# Between two witnesses a curve may bend as much again as it is drawn: standard deviation over the sagitta.
_BEND_UNSEEN = 1.0


@dataclass(frozen=True, eq=False)
class Vertices:
    """Vertices of a ring, complex, shape (M,), and the two segments that meet in each, twice the same inside one, shape
    (M, 2).
    """

    ring: Complexes
    owners: Indices


def vertex_sigma(
    witnesses: Witnesses, segments: Segments, inlier: Bools, vertices: Vertices, *, given: Float64s, spread: float
) -> Float64s:
    """Standard deviation of each vertex, shape (M,), pixels: of its place across its segment, or of a corner's place.

    A segment's own deviation at a place is the residual spread times the root of the fit's leverage there; a corner's
    is both of its edges', over the sine of the angle between them. A segment of one witness says nothing of its own
    direction, so no vertex counts with more than `_MOST`: an outline farther off leaves walls out, and that is told
    apart. given: leverage of segments that do not lie where their own witnesses alone say, parts of free curves and
    roundings, nan for the others, shape (K,). Between two witnesses such a curve may bend more or less than it is
    drawn, which tells the more the fewer they are.
    """
    ring, owners = vertices.ring, vertices.owners
    index, multiplicity = stretch(len(witnesses), segments.first, segments.length)
    weight = multiplicity * inlier[index]
    count = np.maximum(weight.sum(axis=1), 1.0)
    along = _along(segments.models.take((slice(None), None)), witnesses.points[index])
    middle = (weight * along).sum(axis=1) / count
    scale = np.sqrt((weight * (along - middle[:, None]) ** 2).sum(axis=1) / count) + 0.3 * witnesses.pitch_px
    design = _powers((along - middle[:, None]) / scale[:, None], segments.bend[:, None])
    normal = np.einsum("kmi,km,kmj->kij", design, weight, design) + 1e-6 * count[:, None, None] * np.eye(3)
    inverse = np.linalg.inv(normal)

    def leverage(which: Indices) -> Float64s:
        place = (_along(segments.models.take(which), ring) - middle[which]) / scale[which]
        row = _powers(place, segments.bend[which])
        spread_there: Float64s = np.einsum("mi,mij,mj->m", row, inverse[which], row)
        return np.where(np.isnan(given[which]), spread_there, given[which])

    first, second = owners[:, 0], owners[:, 1]
    one, other = leverage(first), leverage(second)
    _, tangent = feet(segments.models.take(first), ring)
    _, next_tangent = feet(segments.models.take(second), ring)
    sine = np.abs((tangent.conj() * next_tangent).imag)
    corner = (first != second) & (sine > _SHARPEST_SINE)
    ratio = np.where(corner, (one + other) / np.maximum(sine, _SHARPEST_SINE) ** 2, np.maximum(one, other))
    loose = ~np.isnan(given)
    most = np.where(loose[first] | loose[second], _MOST_FREE, _MOST) * witnesses.pitch_px
    unseen = np.where(loose[first] & loose[second], _bend_unseen(witnesses, inlier, ring), 0.0)
    return np.minimum(np.hypot(spread * np.sqrt(ratio), unseen), most)


def _bend_unseen(witnesses: Witnesses, inlier: Bools, ring: Complexes) -> Float64s:
    """How far a curve may leave its vertices unseen, shape (M,), pixels: a share of the sagitta over the gap about
    each, whose middle is half of it away from any witness.
    """
    ahead, back = rolled(ring, -1) - ring, ring - rolled(ring, 1)
    turn = np.abs(np.angle(ahead * back.conj()))
    curvature = 2.0 * turn / np.maximum(np.abs(ahead) + np.abs(back), 1e-9)
    seen = witnesses.points[inlier] if inlier.any() else witnesses.points
    nearest = np.abs(ring[:, None] - seen[None, :]).min(axis=1)
    return np.asarray(_BEND_UNSEEN * curvature * (2.0 * nearest) ** 2 / 8.0, np.float64)


def unseen_share(witnesses: Witnesses, inlier: Bools) -> float:
    """Share of the outline farther than a pitch from every inlying witness along the coarse ring, 0 to 1."""
    total = float(witnesses.gap.sum())
    if not inlier.any() or total <= 0.0:
        return 1.0
    place = np.cumsum(witnesses.gap)[inlier]
    gaps = np.diff(place, append=place[0] + total)
    return float(np.maximum(gaps - 2.0 * witnesses.pitch_px, 0.0).sum() / total)


def _along(models: Models, points: Complexes) -> Float64s:
    """Arc length of the points' feet from the models' origins."""
    local = (points - models.origin) * models.tangent.conj()
    bent = np.abs(models.curvature) > 1e-9
    curvature = np.where(bent, models.curvature, 1.0)
    return np.where(bent, np.angle(1.0 + 1j * curvature * local) / curvature, local.real)


def _powers(place: Float64s, bend: Bools) -> Float64s:
    """1, place and (where `bend`) place squared, on a new last axis."""
    return np.stack([np.ones(place.shape), place, np.where(bend, place**2, 0.0)], axis=-1)
