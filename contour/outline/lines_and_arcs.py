"""Lines and circular arcs as one family, fitted many at a time.

The plane is complex here: a point is x + iy. A model is an origin on it, the unit tangent there (direction of travel,
with the material on the left) and the curvature (positive where the outline is convex, 0 for a line). One formula
then serves lines, arcs and whole circles, without the loss of digits that a far centre brings.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s

_LEAST_ROOT = 1e-6


@dataclass(frozen=True, eq=False)
class Models:
    """Lines and arcs, any shape of batch: origin and unit tangent (complex, pixels), curvature (1/pixel, convex
    positive)."""

    origin: Complexes
    tangent: Complexes
    curvature: Float64s

    def __len__(self) -> int:
        return len(self.origin)

    def take(self, index: Any) -> Models:
        """The models at `index` of the batch (any numpy index)."""
        return Models(self.origin[index], self.tangent[index], self.curvature[index])


def join(parts: list[Models]) -> Models:
    """All models of `parts` in one batch."""
    return Models(
        np.concatenate([part.origin for part in parts]),
        np.concatenate([part.tangent for part in parts]),
        np.concatenate([part.curvature for part in parts]),
    )


def distance(models: Models, points: Complexes) -> Float64s:
    """Signed distances of `points` from `models` (shapes broadcast), positive outside the material.

    With u along the tangent and v outwards, F = v + k (u^2 + v^2) / 2 is the power of the point; the distance from the
    circle is 2 F / (1 + sqrt(1 + 2 k F)), exact for lines too.
    """
    local = points - models.origin
    local *= models.tangent.conj()
    power = local.real**2
    power += local.imag**2
    power *= 0.5 * models.curvature
    power -= local.imag
    root = 2.0 * models.curvature * power
    root += 1.0
    np.sqrt(np.maximum(root, 0.0, out=root), out=root)
    root += 1.0
    power *= 2.0
    power /= root
    return power


def distance_from_lines(lines: Models, points: Complexes) -> Float64s:
    """As `distance`, of models that are all lines: the same to the last bit, in a third of the time."""
    local = points - lines.origin
    local *= lines.tangent.conj()
    return -local.imag


def feet(models: Models, points: Complexes) -> tuple[Complexes, Complexes]:
    """Nearest points of `models` to `points`, and the unit tangents there (shapes broadcast)."""
    local = (points - models.origin) * models.tangent.conj()
    power = 0.5 * models.curvature * (local.real**2 + local.imag**2) - local.imag
    root = np.sqrt(np.maximum(1.0 + 2.0 * models.curvature * power, _LEAST_ROOT))
    turned = (1.0 + 1j * models.curvature * local) / root
    tangent = models.tangent * turned
    return points + 1j * tangent * (2.0 * power / (1.0 + root)), tangent


def through_pairs(first: Complexes, last: Complexes) -> Models:
    """Lines from `first` to `last`; the origin is their middle."""
    chord = last - first
    length = np.abs(chord)
    tangent = chord / np.where(length > 0.0, length, 1.0)
    return Models(0.5 * (first + last), np.where(length > 0.0, tangent, 1.0 + 0j), np.zeros(length.shape))


def through_triples(first: Complexes, middle: Complexes, last: Complexes) -> Models:
    """Circles through three points each, travelled in their order; the origin is `middle`.

    The tangent at the middle point leans on the nearer neighbour (weights 1 / length), the curvature is Menger's.
    """
    back, ahead, across = middle - first, last - middle, last - first
    back_sq, ahead_sq = np.abs(back) ** 2 + 1e-12, np.abs(ahead) ** 2 + 1e-12
    tangent = back / back_sq + ahead / ahead_sq
    tangent = tangent / np.maximum(np.abs(tangent), 1e-12)
    product = np.sqrt(back_sq * ahead_sq) * np.maximum(np.abs(across), 1e-6)
    return Models(middle.copy(), tangent, 2.0 * (back.conj() * ahead).imag / product)


def refine(models: Models, points: Complexes, weights: Float64s, bend: Bools) -> Models:
    """One Gauss-Newton step of weighted least squares on the exact distance, each model on its own row of points.

    points, weights: shape (K, m). bend: shape (K,), True where the curvature is free; a line stays a line. Rows whose
    points do not determine a model come back unchanged. The origin moves to the points' weighted middle, so that
    steps stay small.
    """
    total = weights.sum(axis=1)
    sound = total > 0.0
    middle = (weights * points).sum(axis=1) / np.where(sound, total, 1.0)
    origin, tangent = feet(models, np.where(sound, middle, models.origin))
    local = (points - origin[:, None]) * tangent.conj()[:, None]
    curvature = models.curvature[:, None]
    power = 0.5 * curvature * (local.real**2 + local.imag**2) - local.imag
    root = np.sqrt(np.maximum(1.0 + 2.0 * curvature * power, _LEAST_ROOT))
    residual = 2.0 * power / (1.0 + root)
    spread = np.sqrt((weights * local.real**2).sum(axis=1) / np.where(sound, total, 1.0))
    spread = np.maximum(spread, 1e-6)
    cosine = (1.0 - curvature * local.imag) / root
    along = local.real / root / spread[:, None]
    bulge = along**2 / np.maximum(1.0 + cosine, 0.05)
    step = _normal_step(weights, residual, cosine=cosine, along=along, bulge=bulge, bend=bend)
    offset, turn, bow = step[:, 0], step[:, 1] / spread, step[:, 2] / spread**2
    limit = np.minimum(1.0, 0.5 / np.maximum(np.abs(turn), 1e-12))
    offset, turn, bow = offset * limit, turn * limit, bow * limit
    fitted = Models(origin - 1j * tangent * offset, tangent * np.exp(1j * turn), models.curvature + bow)
    keep = sound & np.isfinite(offset) & np.isfinite(turn) & np.isfinite(bow)
    return Models(
        np.where(keep, fitted.origin, models.origin),
        np.where(keep, fitted.tangent, models.tangent),
        np.where(keep, fitted.curvature, models.curvature),
    )


def _normal_step(
    weights: Float64s,
    residual: Float64s,
    *,
    cosine: Float64s,
    along: Float64s,
    bulge: Float64s,
    bend: Bools,
) -> Float64s:
    """Steps of offset (outwards), turn (times the spread) and curvature (times the spread squared), shape (K, 3).

    The distance changes by -cosine with the offset, by +along with the turn (to the left) and by +bulge with the
    curvature.
    """
    design = np.empty((len(along), 3, along.shape[1]))
    np.negative(cosine, out=design[:, 0])
    design[:, 1] = along
    np.multiply(bulge, bend[:, None], out=design[:, 2])
    weighted = design * weights[:, None, :]
    normal = weighted @ design.transpose(0, 2, 1)
    right = -(weighted @ residual[:, :, None])
    trace = normal[:, 0, 0] + normal[:, 1, 1] + 1e-30
    normal.reshape(-1, 9)[:, ::4] += (1e-9 * trace)[:, None]
    normal[:, 2, 2] += np.where(bend, 0.0, trace)
    return np.linalg.solve(normal, right)[:, :, 0].astype(np.float64)
