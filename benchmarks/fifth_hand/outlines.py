"""Outlines of blocks with their holes, and the slight perspective over them: rings (N, 2) float64 of x and y, the first
point not repeated.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.fields import Rng
from contour.geometry.arrays import Float64s

_FORMS = ("rect", "ell", "tee", "you", "notched", "slotted", "many", "curved")


@dataclass(frozen=True)
class Wish:
    """What a kind asks of an outline; what is None is left to chance."""

    holes: tuple[int, int] = (0, 3)
    hole_forms: tuple[str, ...] = ("round", "slot", "rect")
    hole_size: tuple[float, float] = (0.09, 0.3)  # of the block's size
    form: str | None = None


def block_rings(rng: Rng, size: tuple[int, int], wish: Wish) -> list[Float64s]:
    """The block's exterior and then its holes before the tilt, pixels, within a picture of this width and height."""
    frame = np.array(size, float)
    for _ in range(40):
        form = wish.form or str(rng.choice(_FORMS))
        width = frame[0] / frame[1] * rng.uniform(0.75, 1.15)
        unit = _curved(rng, width) if form == "curved" else _angular(rng, form, width)
        angle = rng.choice([rng.normal(0, 0.05), rng.uniform(-0.4, 0.4), np.pi + rng.normal(0, 0.2)])
        unit = turned(unit * [rng.choice([-1, 1]), 1], angle)
        span = unit.max(0) - unit.min(0)
        scale = min(np.sqrt(rng.uniform(0.2, 0.58) * frame.prod() / _area(unit)), float((frame * 0.92 / span).min()))
        exterior = unit * scale
        room = frame * 0.96 - span * scale
        exterior += frame * 0.02 + room * rng.uniform(0.15, 0.85, 2) - exterior.min(0)
        radius = 0.0 if form in ("curved", "toothed") else scale * rng.choice([0, 0.015, 0.05, 0.12])
        exterior = rounded(exterior, radius)
        rings = [exterior, *_bore(rng, exterior, wish, scale)]
        area = _area(exterior) - sum(map(_area, rings[1:]))
        if len(rings) > wish.holes[0] and area > 0.17 * frame.prod():
            return rings
    raise RuntimeError("no outline fits")


def rounded(polygon: Float64s, radius: float) -> Float64s:
    """The ring with curves for corners, which begin a radius before them."""
    if radius < 0.5:
        return polygon
    pieces = []
    steps = np.linspace(0, 1, 12)[:, None]
    for before, corner, after in zip(np.roll(polygon, 1, 0), polygon, np.roll(polygon, -1, 0), strict=True):
        back, ahead = before - corner, after - corner
        reach = min(radius, 0.45 * np.hypot(*back), 0.45 * np.hypot(*ahead))
        start, end = corner + back / np.hypot(*back) * reach, corner + ahead / np.hypot(*ahead) * reach
        pieces.append((1 - steps) ** 2 * start + 2 * steps * (1 - steps) * corner + steps**2 * end)
    return np.concatenate(pieces)


def rectangle(width: float, height: float) -> Float64s:
    """A rectangle about the origin."""
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width / 2, height / 2]


def ellipse(width: float, height: float, count: int = 96) -> Float64s:
    """An ellipse of so many points about the origin."""
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return np.stack([np.cos(turn) * width / 2, np.sin(turn) * height / 2], 1)


def stadium(length: float, width: float) -> Float64s:
    """A slot with half-round ends about the origin."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 20)
    right = np.stack([np.cos(turn), np.sin(turn)], 1) * width / 2 + [max(0.0, length - width) / 2, 0]
    return np.concatenate([right, -right])


def turned(points: Float64s, angle: float) -> Float64s:
    """Points, (..., 2), turned about the origin by radians from x to y."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))


def _bitten(rng: Rng, width: float, bites: int, depth: tuple[float, float], breadth: tuple[float, float]) -> Float64s:
    """A rectangle of height 1 with rectangular or tapered bites in its upper side."""
    half = width / 2
    points = [[-half, 0.5], [-half, -0.5]]
    cell = width * 0.9 / bites
    for index in range(bites):
        wide = min(cell * 0.75, rng.uniform(*breadth))
        middle = -half * 0.9 + cell * (index + rng.uniform(0.42, 0.58))
        taper, deep = wide * rng.choice([0.0, 0.2, 0.48]), rng.uniform(*depth)
        points += [
            [middle - wide / 2, -0.5],
            [middle - wide / 2 + taper, -0.5 + deep],
            [middle + wide / 2 - taper, -0.5 + deep],
            [middle + wide / 2, -0.5],
        ]
    return np.array([*points, [half, -0.5], [half, 0.5]])


def _angular(rng: Rng, form: str, width: float) -> Float64s:
    """A ring of one of the forms that have corners, of height 1."""
    half, a, b = width / 2, rng.uniform(0.3, 0.5), rng.uniform(-0.2, 0.2)
    bites = {
        "you": ((1, 2), (0.4, 0.7), (0.25 * width, 0.45 * width)),
        "notched": ((1, 4), (0.08, 0.4), (0.06, 0.3)),
        "slotted": ((1, 5), (0.3, 0.72), (0.02, 0.06)),
        "toothed": ((6, 16), (0.04, 0.13), (0.03, 0.12)),
    }
    if form in bites:
        counts, depth, breadth = bites[form]
        return _bitten(rng, width, int(rng.integers(*counts)), depth, breadth)
    if form == "ell":
        return np.array(
            [[-half, -0.5], [-half + a * width, -0.5], [-half + a * width, b], [half, b], [half, 0.5], [-half, 0.5]]
        )
    if form == "tee":
        left, right = -half + width * rng.uniform(0.15, 0.33), half - width * rng.uniform(0.15, 0.33)
        return np.array(
            [[-half, -0.5], [half, -0.5], [half, b], [right, b], [right, 0.5], [left, 0.5], [left, b], [-half, b]]
        )
    if form == "many":
        turn = np.sort(np.linspace(0, 2 * np.pi, 7)[:-1] + rng.uniform(-0.35, 0.35, 6))
        return np.stack([np.cos(turn) * half, np.sin(turn) * 0.5], 1) * rng.uniform(0.85, 1.1, (6, 1))
    return rectangle(width, 1) + rng.uniform(-0.06, 0.06, (4, 2)) * rng.integers(0, 2)


def _curved(rng: Rng, width: float) -> Float64s:
    """A smooth ring, its height about 1."""
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    waves = (rng.uniform(0, 0.13) * np.cos(k * turn + rng.uniform(0, 6.3)) / k for k in (2, 3, 4, 5))
    radius = 1 + sum(waves, np.zeros_like(turn))
    power = rng.choice([1.0, 0.6])
    shape = np.stack(
        [
            np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** power * width / 2,
            np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** power / 2,
        ],
        1,
    )
    return shape * radius[:, None]


def _hole(rng: Rng, form: str, size: float) -> Float64s:
    """A hole about the origin, of about a size in pixels."""
    if form == "round":
        return ellipse(size, size * rng.choice([1.0, rng.uniform(0.75, 1)]))
    if form == "slot":
        return turned(stadium(size * rng.uniform(1.4, 2.2), size * rng.uniform(0.25, 0.6)), rng.uniform(0, np.pi))
    if form == "gap":
        return turned(stadium(size * rng.uniform(1.8, 3), size * rng.uniform(0.07, 0.14)), rng.uniform(0, np.pi))
    corners = rectangle(size * rng.uniform(0.6, 1.3), size * rng.uniform(0.5, 1))
    return turned(rounded(corners, size * rng.choice([0, 0.05, 0.2])), rng.choice([0.0, rng.uniform(0, np.pi)]))


def _clearance(ring: Float64s, point: Float64s) -> float:
    """How far within the ring a point lies, pixels, negative beyond it."""
    return cv2.pointPolygonTest(ring.astype(np.float32)[:, None], (float(point[0]), float(point[1])), True)


def _bore(rng: Rng, exterior: Float64s, wish: Wish, scale: float) -> list[Float64s]:
    """Holes within the exterior and apart from each other; scale: pixels that the block is high."""
    rings: list[Float64s] = []
    spots: list[tuple[Float64s, float]] = []
    count = int(rng.integers(wish.holes[0], wish.holes[1] + 1))
    low, high = exterior.min(0), exterior.max(0)
    for attempt in range(60):
        if len(rings) >= count:
            break
        size = scale * rng.uniform(*wish.hole_size) * (1 if attempt < 30 else 0.6)
        form = str(rng.choice(wish.hole_forms))
        ring, centre = _hole(rng, form, max(size, 26.0)), rng.uniform(low, high)
        reach = float(np.hypot(*ring.T).max())
        margin = max(12.0, 0.03 * scale)
        if _clearance(exterior, centre) < reach + margin:
            continue
        if any(np.hypot(*(centre - other)) < reach + far + margin for other, far in spots):
            continue
        rings.append(ring + centre)
        spots.append((centre, reach))
    return rings


def _area(ring: Float64s) -> float:
    """The ring's area, whichever way it turns."""
    x, y = ring.T
    return abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2


def tilt(rng: Rng, size: tuple[int, int]) -> Float64s:
    """A homography, (3, 3), that draws a picture of this width and height slightly inwards."""
    frame = np.array(size, float)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * frame
    bent = corners + rng.uniform(0, 0.016, (4, 2)) * frame.max() * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), bent.astype(np.float32))
    return np.asarray(matrix, np.float64)


def projected(points: Float64s, matrix: Float64s) -> Float64s:
    """Points, (..., 2), through a homography, (3, 3)."""
    full = np.concatenate([points, np.ones((*points.shape[:-1], 1))], -1) @ matrix.T
    return full[..., :2] / full[..., 2:]


def dense(ring: Float64s) -> Float64s:
    """The ring with points about two pixels apart."""
    pieces = []
    for start, end in zip(ring, np.roll(ring, -1, 0), strict=True):
        share = np.linspace(0, 1, int(np.hypot(*(end - start)) / 2.0) + 1, endpoint=False)[:, None]
        pieces.append(start + (end - start) * share)
    return np.concatenate(pieces)
