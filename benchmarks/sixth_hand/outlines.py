"""Outlines of blocks with their bites and holes: rings (N, 2) float64 of x and y, the first point not repeated."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.fields import Rng, Shape
from benchmarks.sixth_hand.drawings import lobes, turn
from benchmarks.sixth_hand.fields import any_of
from contour.geometry.arrays import Float64s

_FAMILIES = ("rect", "quad", "ngon", "ell", "tee", "you", "disc", "stadium", "blob", "bow", "rect", "ell")


def block_rings(shape: Shape, pitch: float, feature: str | None, rng: Rng) -> list[Float64s]:
    """The block's exterior and then its holes, pixels, mostly over 15 to 60 % of the picture. feature: slots, notches,
    teeth or holes; None leaves it to chance.
    """
    for attempt in range(40):
        straight = feature in ("slots", "notches", "teeth") or attempt > 30
        family = any_of(rng, ("rect", "quad", "ell", "ngon") if straight else _FAMILIES)
        ring = _bites(_fit(_exterior(family, rng), shape, rng), feature, pitch, rng)
        ring = _fillet(ring, float(rng.choice([0, 0, 0.5, 1.5, 4])) * pitch)
        count = int(rng.integers(1, 8)) if feature == "holes" else int(rng.choice([0, 0, 1, 2, 4]))
        holes = _holes(ring, count, pitch, shape, rng)
        area = abs(_signed_area(ring)) - sum(abs(_signed_area(hole)) for hole in holes)
        if 0.15 < area / (shape[0] * shape[1]) < 0.6 and (holes or feature != "holes"):
            break
    return [ring, *holes]


def _arc(centre: tuple[float, float], radius: float, start: float, end: float, count: int = 40) -> Float64s:
    """So many points on an arc between two angles, radians."""
    theta = np.linspace(start, end, count)
    return np.stack([centre[0] + radius * np.cos(theta), centre[1] + radius * np.sin(theta)], axis=1)


def _stepped(family: str, rng: Rng) -> Float64s:
    """A ring like an L, a T or a U."""
    a, b = rng.uniform(0.6, 1), rng.uniform(0.6, 1)
    p, q = rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)
    if family == "ell":
        return np.array([(-a, -b), (a, -b), (a, q * b), (p * a, q * b), (p * a, b), (-a, b)])
    low, high = -a * rng.uniform(0.25, 0.6), a * rng.uniform(0.25, 0.6)
    if family == "tee":
        return np.array([(-a, -b), (a, -b), (a, q * b), (high, q * b), (high, b), (low, b), (low, q * b), (-a, q * b)])
    return np.array([(-a, -b), (a, -b), (a, b), (high, b), (high, q * b), (low, q * b), (low, b), (-a, b)])


def _exterior(family: str, rng: Rng) -> Float64s:
    """A ring about from -1 to 1."""
    a, b = rng.uniform(0.75, 1), rng.uniform(0.5, 0.9)
    box = np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    if family == "rect":
        return box
    if family == "quad":
        return box * rng.uniform(0.7, 1.1, (4, 2))
    if family == "ngon":
        count = int(rng.integers(5, 9))
        theta = (np.arange(count) + rng.uniform(-0.25, 0.25, count)) * 2 * np.pi / count
        return np.stack([a * np.cos(theta), b * np.sin(theta)], axis=1)
    if family in ("ell", "tee", "you"):
        return _stepped(family, rng)
    return _curved(family, a, b, rng)


def _curved(family: str, a: float, b: float, rng: Rng) -> Float64s:
    """A ring with curves, of about half such a width and height."""
    if family == "disc":
        return _arc((0, 0), 1, 0, 2 * np.pi * 119 / 120, 120) * (a, max(b, 0.65))
    if family == "stadium":
        radius = b * 0.8
        right = _arc((0.6, 0), radius, -np.pi / 2, np.pi / 2)
        return np.vstack([right, _arc((-0.6, 0), radius, np.pi / 2, 1.5 * np.pi)])
    if family == "blob":
        return lobes(rng, 0.35, 160)
    swell, along = rng.uniform(-0.35, 0.45), np.linspace(-a, a, 60)
    bow = np.stack([along, -b - swell * (1 - (along / a) ** 2) * b], axis=1)
    return np.vstack([bow, [(a, b), (-a, b)]])


def _bite_profile(kind: str, width: float, depth: float) -> Float64s:
    """A bite's points, (N, 2), along the edge and inward, from one side of its mouth to the other."""
    half = width / 2
    if kind == "vee":
        return np.array([(-half, 0), (0, depth), (half, 0)])
    if kind == "bay":
        return np.stack([-half * np.cos(np.linspace(0, np.pi, 30)), half * np.sin(np.linspace(0, np.pi, 30))], axis=1)
    if kind == "slot":
        round_end = _arc((0, depth - half), half, np.pi, 0, 24)
        return np.vstack([[(-half, 0)], round_end, [(half, 0)]])
    return np.array([(-half, 0), (-half, depth), (half, depth), (half, 0)])


def _signed_area(ring: Float64s) -> float:
    """The ring's area, positive where it turns from x to y."""
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _bite(ring: Float64s, kind: str, width: float, depth: float, rng: Rng, gap: float) -> Float64s:
    """The ring with a bite cut into one of its edges, if there is room, so far from all the rest; pixels."""
    following = np.roll(ring, -1, axis=0)
    length = np.hypot(*(following - ring).T)
    roomy = np.flatnonzero(length > width + 2 * gap)
    if not len(roomy):
        return ring
    edge = int(rng.choice(roomy))
    along = (following[edge] - ring[edge]) / length[edge]
    inward = np.array([-along[1], along[0]])
    mouth = ring[edge] + along * rng.uniform(gap + width / 2, length[edge] - gap - width / 2)
    profile = _bite_profile(kind, width, depth)
    points = mouth + profile[:, :1] * along + profile[:, 1:] * inward
    if not _roomy(ring, mouth, along, width, depth, gap):
        return ring
    return np.vstack([ring[: edge + 1], points, ring[edge + 1 :]])


def _roomy(ring: Float64s, mouth: Float64s, along: Float64s, width: float, depth: float, gap: float) -> bool:
    """Whether a bite keeps clear of the rest of the ring, all along its depth."""
    inward, contour = np.array([-along[1], along[0]]), ring.astype(np.float32)
    for deep in np.linspace(0.05, 1, 24) * (depth + gap):
        for side in (-0.5, 0, 0.5):
            x, y = mouth + side * (width + gap) * along + deep * inward
            if cv2.pointPolygonTest(contour, (float(x), float(y)), True) < 0.7 * min(gap, deep):
                return False
    return True


def _fillet(ring: Float64s, radius: float) -> Float64s:
    """The ring with its sharp corners rounded, by a radius in pixels."""
    rounded: list[Float64s] = []
    for before, corner, after in zip(np.roll(ring, 1, axis=0), ring, np.roll(ring, -1, axis=0), strict=True):
        first, second = before - corner, after - corner
        one, two = float(np.hypot(*first)), float(np.hypot(*second))
        bend = np.arccos(np.clip(first @ second / (one * two + 1e-12), -1, 1))
        if np.pi - bend < 0.45 or radius <= 0:
            rounded.append(corner[None])
            continue
        reach = min(radius / np.tan(bend / 2), 0.45 * one, 0.45 * two)
        start, end = corner + first / one * reach, corner + second / two * reach
        t = np.linspace(0, 1, 12)[:, None]
        rounded.append((1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t * t * end)
    return np.vstack(rounded)


def _bites(ring: Float64s, feature: str | None, pitch: float, rng: Rng) -> Float64s:
    """The ring with the bites that a feature asks for."""
    span = float(np.sqrt(abs(_signed_area(ring))))
    if feature == "teeth":
        for _ in range(int(rng.integers(6, 30))):
            width = pitch * rng.uniform(1, 4)
            ring = _bite(ring, any_of(rng, ("vee", "box", "bay")), width, width * rng.uniform(0.4, 1.5), rng, pitch)
        return ring
    count = {"slots": rng.integers(2, 7), "notches": rng.integers(2, 7)}.get(feature or "", rng.integers(0, 3))
    for _ in range(int(count)):
        slim = feature == "slots" or (feature != "notches" and rng.random() < 0.4)
        width = pitch * rng.uniform(0.6, 3) if slim else span * rng.uniform(0.06, 0.3)
        depth = span * rng.uniform(0.12, 0.55) if slim else width * rng.uniform(0.4, 1.4)
        kind = any_of(rng, ("slot", "box") if slim else ("vee", "bay", "box", "slot"))
        ring = _bite(ring, kind, width, max(depth, width * 0.6), rng, 1.5 * pitch)
    return ring


def _hole(rng: Rng, clear: float) -> Float64s:
    """A hole about the origin, within a circle of a radius."""
    kind = any_of(rng, ("round", "round", "slot", "box", "ngon", "blob"))
    if kind == "round":
        return _arc((0, 0), clear, 0, 2 * np.pi * 79 / 80, 80)
    if kind == "slot":
        half = clear * rng.uniform(0.2, 0.6)
        reach = clear - half
        ring = np.vstack(
            [_arc((reach, 0), half, -np.pi / 2, np.pi / 2, 20), _arc((-reach, 0), half, np.pi / 2, 1.5 * np.pi, 20)]
        )
    elif kind == "box":
        phi = rng.uniform(0.3, 1.2)
        corner = clear * np.array([np.cos(phi), np.sin(phi)])
        ring = _fillet(np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * corner, clear * rng.choice([0, 0.1, 0.3]))
    elif kind == "ngon":
        count = int(rng.integers(3, 8))
        ring = _fillet(_arc((0, 0), clear, 0, 2 * np.pi * (count - 1) / count, count), clear * rng.choice([0, 0.15]))
    else:
        ring = lobes(rng, 0.3)
        ring *= clear / np.hypot(*ring.T).max()
    return ring @ turn(rng.uniform(0, 6.3)).T


def _holes(ring: Float64s, count: int, pitch: float, shape: Shape, rng: Rng) -> list[Float64s]:
    """At most so many holes, clear of the exterior and of each other."""
    coarse = np.zeros((shape[0] // 4, shape[1] // 4), np.uint8)
    cv2.fillPoly(coarse, [np.round(ring / 4).astype(np.int32)], 1)
    holes: list[Float64s] = []
    for _ in range(count):
        room = cv2.distanceTransform(coarse, cv2.DIST_L2, 3) * 4 - 1.5 * pitch
        spots = np.argwhere(room > 1.2 * pitch)
        if not len(spots):
            break
        y, x = spots[int(rng.integers(len(spots)))]
        clear = max(1.2 * pitch, room[y, x] * rng.uniform(0.3, 0.95))
        hole = _hole(rng, clear) + np.array((x * 4.0, y * 4.0))
        cv2.fillPoly(coarse, [np.round(hole / 4).astype(np.int32)], 0)
        holes.append(hole)
    return holes


def _fit(ring: Float64s, shape: Shape, rng: Rng) -> Float64s:
    """The ring turned, scaled and placed in a picture, pixels."""
    angle = rng.uniform(0, 6.3) if rng.random() < 0.6 else rng.integers(4) * np.pi / 2 + rng.normal(0, 0.04)
    ring = ring @ turn(angle).T
    ring = ring if _signed_area(ring) > 0 else ring[::-1]
    size = np.array([shape[1], shape[0]], float)
    low, high = ring.min(axis=0), ring.max(axis=0)
    scale = min(
        float(np.sqrt(rng.uniform(0.2, 0.6) * size.prod() / _signed_area(ring))),
        float(((size * 0.9) / (high - low)).min()),
    )
    free = size - (high - low) * scale
    return np.asarray((ring - low) * scale + free * (0.05 + 0.9 * rng.uniform(0.1, 0.9, 2) * (free > 0)))
