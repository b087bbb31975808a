"""Outlines of blocks with their holes: rings (N, 2) float64 of x and y, the first point not repeated."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.drawings import box, disc
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float64s


def outline(rng: Rng, cuts: str, count: int, shape: Shape) -> list[Float64s]:
    """The block's rings before the tilt, pixels: its exterior and then its holes, at most `count`."""
    h, w = shape
    for _ in range(40):
        ring = _corners(rng) * (1, rng.uniform(0.45, 1))
        for _ in range(int(rng.integers(1, 4))):
            if cuts in ("slot", "both"):
                ring = _cut_in(ring, rng, rng.uniform(0.025, 0.09), rng.uniform(0.15, 0.5), rng.uniform(0.7, 1.05))
            if cuts in ("notch", "both"):
                ring = _cut_in(ring, rng, rng.uniform(0.1, 0.3), rng.uniform(0.06, 0.25), rng.uniform(0.1, 1.1))
        ring = _fillet(ring, rng.choice([0.004, 0.03, 0.12]))
        if cuts == "ragged":
            ring = ring + rng.normal(0, 0.006, ring.shape)
        angle = rng.uniform(0, 2 * np.pi) if rng.random() < 0.5 else rng.normal(0, 0.12)
        ring = ring @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        span = np.ptp(ring, axis=0)
        area = cv2.contourArea(ring.astype(np.float32))
        scale = min(np.sqrt(rng.uniform(0.24, 0.56) * h * w / area), 0.84 * w / span[0], 0.84 * h / span[1])
        if area * scale**2 > 0.2 * h * w:
            break
    ring = (ring - ring.min(0)) * scale
    spare = np.array([w, h]) - span * scale
    ring = ring + spare * rng.uniform(0.35, 0.65, 2)
    return [ring, *_bore(rng, ring, count, shape)]


def _corners(rng: Rng) -> Float64s:
    """A rough outline about from -1 to 1."""
    a, b = rng.uniform(0.25, 0.6, 2)
    shape = rng.choice(["box", "ell", "tee", "you", "poly", "round", "trapeze", "wavy", "dee"])
    if shape == "ell":
        return np.array([(-1, -1), (1, -1), (1, -1 + 2 * a), (-1 + 2 * b, -1 + 2 * a), (-1 + 2 * b, 1), (-1, 1)])
    if shape == "tee":
        return np.array(
            [
                (-1, -1),
                (1, -1),
                (1, -1 + 2 * a),
                (b, -1 + 2 * a),
                (b * 0.8, 1),
                (-b, 1),
                (-b, -1 + 2 * a),
                (-1, -1 + 2 * a),
            ]
        )
    if shape == "you":
        return np.array([(-1, -1), (1, -1), (1, 1), (b, 1), (b, -1 + 2 * a), (-b, -1 + 2 * a), (-b, 0.9), (-1, 0.9)])
    if shape in ("poly", "round", "wavy"):
        count = int(rng.integers(4, 8)) if shape == "poly" else 90
        angle = (np.arange(count) + (rng.uniform(-0.3, 0.3, count) if shape == "poly" else 0)) * 2 * np.pi / count
        radius = 1 + (0.13 * np.sin(int(rng.integers(2, 6)) * angle + rng.uniform(0, 6)) if shape == "wavy" else 0)
        ring = np.stack([np.cos(angle), np.sin(angle)], 1) * np.broadcast_to(radius, (count,))[:, None]
        return np.asarray(ring)
    if shape == "trapeze":
        return np.array([(-1, -1), (1, -1 + a * 0.5), (1 - a, 1), (-1 + b * 0.6, 1)])
    out = np.array([(-1.0, -1), (1, -1), (1, 1), (-1, 1)])
    if shape == "dee":
        t = np.linspace(0, np.pi, 50)[1:-1]
        bulge = rng.uniform(-0.5, 0.7)
        out = np.concatenate([out[:2], np.stack([1 + bulge * np.sin(t), -np.cos(t)], 1), out[2:]])
    return out


def _cut_in(ring: Float64s, rng: Rng, width: float, depth: float, taper: float) -> Float64s:
    """The ring with a slot or notch cut into one of its edges, if there is room; width and depth are shares of its
    size.
    """
    size = np.sqrt(cv2.contourArea(ring.astype(np.float32)))
    turn = np.sign(np.sum(ring[:, 0] * np.roll(ring[:, 1], -1) - ring[:, 1] * np.roll(ring[:, 0], -1)))
    for k in rng.permutation(len(ring)):
        a, b = ring[k], ring[(k + 1) % len(ring)]
        length = np.linalg.norm(b - a)
        way = (b - a) / (length + 1e-9)
        inward = turn * np.array([-way[1], way[0]])
        half, reach = size * width / 2, size * depth
        if length < half * 4:
            continue
        mid = a + way * rng.uniform(half * 1.6, length - half * 1.6)
        new = np.array(
            [
                mid - way * half,
                mid - way * half * taper + inward * reach,
                mid + way * half * taper + inward * reach,
                mid + way * half,
            ]
        )
        room = [
            cv2.pointPolygonTest(ring.astype(np.float32), tuple(map(float, q)), True)
            for q in (*new[1:3], (new[1] + mid) / 2, (new[2] + mid) / 2)
        ]
        if room[0] > 0.12 * size and room[1] > 0.12 * size and min(room[2:]) > 0.05 * size:
            return np.insert(ring, [k + 1] * 4, new, axis=0)
    return ring


def _fillet(ring: Float64s, radius: float) -> Float64s:
    """The ring with corners that curves round, which start a radius before them."""
    out = []
    t = np.linspace(0, 1, 9)[:, None]
    for before, here, after in zip(np.roll(ring, 1, 0), ring, np.roll(ring, -1, 0), strict=True):
        one, two = before - here, after - here
        a, b = (w * min(radius / (np.linalg.norm(w) + 1e-9), 0.45) for w in (one, two))
        out.append((1 - t) ** 2 * (here + a) + 2 * t * (1 - t) * here + t**2 * (here + b))
    return np.concatenate(out)


def _bore(rng: Rng, ring: Float64s, count: int, shape: Shape) -> list[Float64s]:
    """Holes of several shapes, as many of `count` as there is room for in the ring."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.round(ring).astype(np.int32)], 1)
    unit = float(np.sqrt(mask.sum()))
    holes = []
    for _ in range(count):
        room = cv2.distanceTransform(mask, cv2.DIST_L2, 5)
        reach = unit * rng.uniform(0.03, 0.16 if count < 4 else 0.08)
        spots = np.argwhere(room > reach + unit * 0.035)
        if not len(spots):
            continue
        at = spots[rng.integers(len(spots))][::-1].astype(float)
        turn = rng.uniform(0, np.pi)
        way = np.array([np.cos(turn), np.sin(turn)])
        choice = rng.choice(["round", "slot", "rect", "tri"])
        hole = {
            "round": disc(at, reach),
            "slot": box(at, way, reach * 1.95, reach * rng.uniform(0.3, 0.8), 0.499),
            "rect": box(at, way, reach * 1.6, reach * rng.uniform(0.6, 1.2), rng.choice([0.02, 0.2])),
            "tri": _fillet(disc(at, reach, int(rng.integers(3, 7)), turn), reach * 0.15),
        }[str(choice)]
        cv2.fillPoly(mask, [np.round(hole).astype(np.int32)], 0)
        holes.append(hole)
    return holes
