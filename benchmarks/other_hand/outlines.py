"""Directions, curves, and outlines drawn at random; points are (N, 2) float64, rings without the first point again."""

from __future__ import annotations

import math

import numpy as np
import shapely

from benchmarks.other_hand.fields import Field, Rng
from contour.geometry.arrays import Float64s

_TURN = 2.0 * math.pi
_FAR = 1e5


def direction(angle: float) -> Float64s:
    """The unit vector at an angle in radians, (2,)."""
    return np.array([math.cos(angle), math.sin(angle)])


def across(vectors: Float64s) -> Float64s:
    """The vectors, (..., 2), turned by a right angle."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def rotated(points: Float64s, angle: float) -> Float64s:
    """The points turned about the origin by radians."""
    along = direction(angle)
    return points @ np.stack([along, across(along)])


def around(angles: Field, radii: Float64s | float, high: float = 1.0) -> Float64s:
    """Points about the origin at angles and radii, flattened to a part of their height."""
    return np.column_stack([radii * np.cos(angles), high * radii * np.sin(angles)])


def curve(points: Float64s, count: int, *, closed: bool = False) -> Float64s:
    """So many points of a Catmull-Rom curve through all the points."""
    ends = (points[-1:], points[:2]) if closed else (2.0 * points[:1] - points[1], 2.0 * points[-1:] - points[-2])
    knots = np.vstack([ends[0], points, ends[1]])
    places = np.linspace(0.0, len(knots) - 3, count, endpoint=not closed)
    first = np.minimum(places.astype(int), len(knots) - 4)
    part = (places - first)[:, None]
    before, start, end, after = (knots[first + step] for step in range(4))
    square = (2.0 * before - 5.0 * start + 4.0 * end - after) * part**2
    cube = (3.0 * start - before - 3.0 * end + after) * part**3
    return np.asarray(0.5 * (2.0 * start + (end - before) * part + square + cube))


def rounded(ring: Float64s, outer: float, inner: float = 0.0) -> Float64s:
    """The ring with corners that stand out, and ones that lie in, rounded by these radii."""
    shape = shapely.Polygon(ring).buffer(-outer, 32).buffer(outer + inner, 32).buffer(-inner, 32)
    return shapely.get_coordinates(shape)[:-1]


def inscribed(ring: Float64s) -> tuple[float, Float64s]:
    """Radius and middle of about the largest circle within the ring."""
    radius = shapely.maximum_inscribed_circle(shapely.Polygon(ring), 0.005 * float(np.ptp(ring, axis=0).max()))
    return float(radius.length), np.array(radius.coords[0])


def half_plane(normal: Float64s, offset: float) -> shapely.Polygon:
    """All points, as far as any picture goes, whose distance along the unit normal is no more than the offset."""
    side, near, far = _FAR * across(normal), normal * offset, normal * (offset - _FAR)
    return shapely.Polygon([near - side, near + side, far + side, far - side])


def outline(rng: Rng, *, convex: bool) -> Float64s:
    """A ring of one of a dozen kinds, about two units wide, at any angle or nearly even with the axes."""
    kinds = _CONVEX if convex else _CONVEX + _CONCAVE
    ring = kinds[int(rng.integers(len(kinds)))](rng)
    if rng.random() < 0.35:
        # No arm of those with arms is narrower than twice that.
        most = 0.15 if len(kinds) > len(_CONVEX) else 0.6 * inscribed(ring)[0]
        ring = rounded(ring, *(rng.uniform(0.03, most, 2) * rng.choice([(1, 1), (1, 1), (1, 0), (0, 1)])).tolist())
    even = 0.25 * _TURN * int(rng.integers(4)) + rng.uniform(-0.04, 0.04)
    return rotated(ring, rng.uniform(0.0, _TURN) if rng.random() < 0.6 else even)


def _box(half: float) -> Float64s:
    return np.array([[-1.0, -half], [1.0, -half], [1.0, half], [-1.0, half]])


def _rectangle(rng: Rng) -> Float64s:
    box = _box(rng.uniform(0.55, 1.0))
    return box if rng.random() < 0.7 else rounded(box, rng.uniform(0.05, 0.45))


def _trapeze(rng: Rng) -> Float64s:
    corners = _box(rng.uniform(0.55, 1.0))
    corners[:2, 0] += rng.uniform(0.0, 0.5, 2) * (1.0, -1.0)
    return corners


def _chamfered(rng: Rng) -> Float64s:
    box = _box(rng.uniform(0.55, 1.0))
    cut = rng.random((4, 1)) < 0.6
    ways = [(np.roll(box, by, axis=0) - box) * rng.uniform(0.05, 0.35, (4, 1)) for by in (1, -1)]
    return _hull(np.vstack([box + cut * way for way in ways]))


def _hull(points: Float64s) -> Float64s:
    return shapely.get_coordinates(shapely.MultiPoint(points).convex_hull)[:-1]


def _star(rng: Rng, least: float = 0.6) -> Float64s:
    count = int(rng.integers(4, 10))
    angles = (np.arange(count) + rng.uniform(-0.28, 0.28, count)) * _TURN / count
    return around(angles, rng.uniform(least, 1.0, count), rng.uniform(0.7, 1.0))


def _polygon(rng: Rng) -> Float64s:
    return _hull(_star(rng, 0.9))


def _oval(rng: Rng) -> Float64s:
    """A circle, an ellipse, or one that swells towards a box."""
    points = around(np.linspace(0.0, _TURN, 360, endpoint=False), 1.0)
    if rng.random() < 0.5:
        return points
    power = 1.0 if rng.random() < 0.6 else rng.uniform(0.6, 0.9)
    return np.sign(points) * np.abs(points) ** power * (1.0, rng.uniform(0.55, 0.9))


def _part_of_disc(rng: Rng) -> Float64s:
    half = rng.uniform(1.1, 2.3)
    return around(np.linspace(-half, half, 240), 1.0)


def _angle(rng: Rng) -> Float64s:
    half = rng.uniform(0.55, 1.0)
    x, y = rng.uniform(-0.1, 0.4, 2) * (1.0, half)
    corners = np.array([[-1.0, -half], [1.0, -half], [1.0, y], [x, y], [x, half], [-1.0, half]])
    return corners + rng.uniform(-0.08, 0.08, corners.shape) * (rng.random() < 0.4)


def _tee(rng: Rng) -> Float64s:
    half, left, right = rng.uniform((0.55, -0.75, 0.35), (1.0, -0.35, 0.75)).tolist()
    y = half * rng.uniform(-0.2, 0.2)
    return np.vstack([_box(half)[:2], [[1.0, y], [right, y], [right, half], [left, half], [left, y], [-1.0, y]]])


def _horseshoe(rng: Rng) -> Float64s:
    half, left, right = rng.uniform((0.55, -0.4, 0.15), (1.0, -0.15, 0.4)).tolist()
    y, box = half * rng.uniform(-0.4, 0.2), _box(half)
    return np.vstack([box[:3], [[right, half], [right, y], [left, y], [left, half]], box[3:]])


def _smooth(rng: Rng) -> Float64s:
    angles, radii = np.linspace(0.0, _TURN, 480, endpoint=False), np.ones(480)
    for wave in range(2, 7):
        radii += rng.uniform(0.0, 0.28) / wave**0.9 * np.cos(wave * angles + rng.uniform(0.0, _TURN))
    return around(angles, np.maximum(radii, 0.45), rng.uniform(0.7, 1.0))


# One that comes twice is drawn twice as often.
_CONVEX = (_rectangle, _rectangle, _rectangle, _polygon, _polygon, _trapeze, _oval, _oval, _part_of_disc, _chamfered)
_CONCAVE = (_angle, _angle, _star, _star, _smooth, _smooth, _tee, _horseshoe)
