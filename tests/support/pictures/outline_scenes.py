"""Witnesses of known outlines for tests of the fit: wall ends about a pitch apart, some deep, some missing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contour.walls.wall_evidence import RingEvidence, WitnessKind

PITCH = 25.0


def rectangle(width: float, height: float, angle: float = 0.3) -> NDArray[np.float64]:
    """Corners of a turned rectangle about (700, 500), positive shoelace."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([width, height]) / 2.0
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return corners @ turn + np.array([700.0, 500.0])


def circle(radius: float) -> NDArray[np.float64]:
    """A circle about (700, 500) in 720 steps, positive shoelace."""
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius + np.array([700.0, 500.0])


def blob(radius: float) -> NDArray[np.float64]:
    """A smooth closed curve without straight parts, positive shoelace."""
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    reach = radius * (1.0 + 0.12 * np.cos(2.0 * angle + 0.4) + 0.05 * np.cos(3.0 * angle + 1.9))
    return np.column_stack([np.cos(angle), np.sin(angle)]) * reach[:, None] + np.array([700.0, 500.0])


def along(ring: NDArray[np.float64], place: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and outward normals (material on the left) at arc lengths of a ring."""
    step = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(step[:, 0], step[:, 1])
    start = np.concatenate([[0.0], np.cumsum(length)])
    place = np.mod(place, start[-1])
    which = np.clip(np.searchsorted(start, place, side="right") - 1, 0, len(ring) - 1)
    tangent = step[which] / length[which][:, None]
    points = ring[which] + tangent * (place - start[which])[:, None]
    return points, np.column_stack([tangent[:, 1], -tangent[:, 0]])


def perimeter(ring: NDArray[np.float64]) -> float:
    """Length of a closed ring."""
    return float(np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum())


def witnesses(
    ring: NDArray[np.float64],
    *,
    seed: int,
    sigma: float = 0.2,
    deep: float = 0.0,
    outside: float = 0.0,
    spacing: float = 0.8 * PITCH,
    gaps: tuple[tuple[float, float], ...] = (),
    hole: bool = False,
    noise: float = 1.0,
) -> RingEvidence:
    """Evidence of one ring. gaps: stretches of arc length without witnesses. noise: stated over true sigma."""
    if hole:
        ring = ring[::-1]
    rng = np.random.default_rng(seed)
    total = perimeter(ring)
    count = int(total / spacing)
    place = np.sort((np.arange(count) + rng.uniform(0.15, 0.85, count)) * total / count)
    for begin, end in gaps:
        place = place[(place < begin) | (place > end)]
    points, normal = along(ring, place)
    depth = rng.normal(0.0, sigma, len(place))
    depth = np.where(rng.random(len(place)) < deep, -rng.uniform(0.05, 1.0, len(place)) * PITCH, depth)
    depth = np.where(rng.random(len(place)) < outside, rng.uniform(0.1, 0.8, len(place)) * PITCH, depth)
    return RingEvidence(
        coarse=ring,
        is_hole=hole,
        points=points + normal * depth[:, None],
        position=place,
        normal=normal,
        sigma=np.full(len(place), sigma * noise),
        kind=np.full(len(place), WitnessKind.CLEAN, dtype=np.int8),
    )


def distances(points: NDArray[np.float64], ring: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each point from the nearest place of a closed ring."""
    start, step = ring[None], (np.roll(ring, -1, axis=0) - ring)[None]
    share = ((points[:, None] - start) * step).sum(axis=2) / np.maximum((step**2).sum(axis=2), 1e-12)
    foot = start + step * np.clip(share, 0.0, 1.0)[..., None]
    nearest: NDArray[np.float64] = np.hypot(*np.moveaxis(points[:, None] - foot, 2, 0)).min(axis=1)
    return nearest


def errors(found: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances both ways between two outlines, every two pixels along them."""
    even = [along(ring, np.arange(0.0, perimeter(ring), 2.0))[0] for ring in (found, truth)]
    return np.concatenate([distances(even[0], truth), distances(even[1], found)])


def area(ring: NDArray[np.float64]) -> float:
    """Shoelace area."""
    following = np.roll(ring, -1, axis=0)
    return float(0.5 * (ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]).sum())
