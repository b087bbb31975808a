"""Outlines of blocks and their holes: rings (N, 2) float64 of x and y, the first point not repeated."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Rng
from benchmarks.third_hand.plans import Plan
from contour.geometry.arrays import Float32s, Float64s


def exterior(rng: Rng, w: int, h: int, plan: Plan) -> Float64s:
    """The outer ring, wholly within a picture of this width and height, pixels, and of a fitting size; its signed area
    is positive.
    """
    while True:
        points: Float64s = _outline(rng) * [rng.uniform(0.8, 1.7), 1.0]
        points = points if _area(points) > 0 else points[::-1]
        if len(points) < 30:
            for _ in range(int(rng.integers(plan.cuts[0], plan.cuts[1] + 1))):
                points = _with_cut(points, rng, str(rng.choice(plan.cut_forms)))
        elif plan.cuts[0]:
            continue
        points = _rounded(points, rng.choice([1e-3, rng.uniform(0.005, 0.15)]))
        turn = rng.uniform(0, 2 * np.pi) if rng.random() < 0.6 else rng.normal(0, 0.06)
        points = points @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        points *= np.sqrt(rng.uniform(0.22, 0.55) * w * h / _area(points))
        points -= points.min(0)
        room = np.array([w, h]) * 0.94 - points.max(0)
        if (room < 0).any():
            fit = (np.array([w, h]) * 0.94 / points.max(0)).min()
            points, room = points * fit, np.array([w, h]) * 0.94 - points.max(0) * fit
        canvas = np.zeros((h, w), np.uint8)
        points = points + room * rng.random(2) + np.array([w, h]) * 0.03
        cv2.fillPoly(canvas, [np.rint(points).astype(np.int32)], 1)
        if 0.18 < canvas.mean() < 0.58 and abs(_area(points) / canvas.sum() - 1) < 0.02:
            return points


def _outline(rng: Rng) -> Float64s:
    """A ring about one unit wide, either way round."""
    form = rng.choice(["rect", "poly", "ell", "tee", "you", "curved", "skew"])
    a, b, c, d = rng.uniform(0.3, 0.65, 4)
    t = rng.uniform(0.2, 0.35)
    cornered = {
        "rect": [[0, 0], [1, 0], [1, 1], [0, 1]],
        "ell": [[0, 0], [1, 0], [1, a], [b, a], [b, 1], [0, 1]],
        "tee": [[0, 0], [1, 0], [1, a], [1 - t, a], [1 - t, 1], [t, 1], [t, a], [0, a]],
        "you": [[0, 0], [1, 0], [1, c + t], [1 - t, c + t], [1 - t, a], [t, a], [t, d + t], [0, d + t]],
    }
    if form in cornered:
        return np.array(cornered[form], np.float64)
    if form == "skew":
        return np.array([[t * rng.random(), 0], [1, 0], [1 - t * rng.random(), 1], [0, 1 - t * rng.random()]])
    if form == "poly":
        n = int(rng.integers(5, 9))
        at = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2 * np.pi / n
        return np.asarray(np.stack([np.cos(at), np.sin(at)], 1) * rng.uniform(0.42, 0.55, (n, 1)))
    at = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    r = 0.5 + np.add.reduce([rng.normal(0, 0.09 / k) * np.cos(k * at + rng.uniform(0, 6)) for k in (2, 3, 4)])
    return np.asarray(np.stack([np.cos(at), np.sin(at)], 1) * r[:, None])


def _with_cut(points: Float64s, rng: Rng, form: str) -> Float64s:
    """The ring with a notch or an open slot cut into one of its longest edges."""
    step = np.roll(points, -1, 0) - points
    size = np.hypot(*step.T)
    i = int(rng.choice(np.argsort(size)[-4:]))
    along = step[i] / size[i]
    inward = np.array([-along[1], along[0]])
    wide = size[i] * (rng.uniform(0.04, 0.12) if form == "slot" else rng.uniform(0.12, 0.3))
    deep = size[i] * (rng.uniform(0.15, 0.4) if form == "slot" else rng.uniform(0.04, 0.14))
    at = size[i] * rng.uniform(0.2, 0.8 - wide / size[i])
    shapes: dict[str, list[list[float]]] = {
        "vee": [[0, 0], [0.5, 1], [1, 0]],
        "step": [[0, 0], [0, 1], [1, 1], [1, 0]],
        "slot": [[0, 0], [0, 1], [1, 1], [1, 0]],
        "arc": [[0.5 - 0.5 * np.cos(k), np.sin(k)] for k in np.linspace(0, np.pi, 24)],
    }
    cut = np.array([points[i] + along * (at + wide * p) + inward * deep * q for p, q in shapes[form]])
    return np.insert(points, i + 1, cut, axis=0)


def _rounded(points: Float64s, radius: float) -> Float64s:
    """The ring with rounded corners, in units of the ring."""
    out = []
    for before, here, after in zip(np.roll(points, 1, 0), points, np.roll(points, -1, 0), strict=True):
        p, q = before - here, after - here
        lp, lq = np.hypot(*p), np.hypot(*q)
        reach = min(radius, 0.45 * lp, 0.45 * lq)
        t = np.linspace(0, 1, 12)[:, None]
        a, b = here + p / lp * reach, here + q / lq * reach
        out.append((1 - t) ** 2 * a + 2 * t * (1 - t) * here + t**2 * b)
    return np.concatenate(out)


def with_holes(rng: Rng, outer: Float64s, w: int, h: int, plan: Plan) -> list[Float64s]:
    """The outer ring, then holes wherever they fit, apart from each other and from the edge, pixels."""
    rings, wanted = [outer], int(rng.integers(plan.holes[0], plan.holes[1] + 1))
    mask = np.zeros((h, w), np.uint8)
    cv2.fillPoly(mask, [np.rint(outer).astype(np.int32)], 1)
    inside = np.argwhere(mask)[:, ::-1]
    for tries in range(60):
        if len(rings) > wanted:
            break
        size = rng.uniform(0.02, 0.085) * w * (1 - tries / 90)
        ring = _hole(rng, str(rng.choice(plan.forms)), size)
        ring = ring + inside[int(rng.integers(len(inside)))]
        at = np.rint(ring).astype(int)
        room = cv2.distanceTransform(mask, cv2.DIST_L2, 3)
        if (at >= 0).all() and (at < [w, h]).all() and room[at[:, 1], at[:, 0]].min() > 0.02 * w:
            rings.append(ring)
            cv2.fillPoly(mask, [at.astype(np.int32)], 0)
    return rings


def _hole(rng: Rng, form: str, size: float) -> Float64s:
    """A hole about the origin: round, a slot, a narrow slot or a rectangle."""
    at = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    if form == "round":
        ring = np.stack([np.cos(at), np.sin(at)], 1) * size
    elif form == "rect":
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [size, size * rng.uniform(0.4, 1.2)]
        ring = _rounded(corners, rng.choice([0.5, size * rng.uniform(0.1, 0.5)]))
    else:
        half = size * (rng.uniform(0.09, 0.2) if form == "narrow" else rng.uniform(0.25, 0.5))
        shift = np.where(np.cos(at) > 0, 1.0, -1.0) * size * (1.8 if form == "narrow" else 1.2)
        ring = np.stack([np.cos(at) * half + shift, np.sin(at) * half], 1)
    turn = rng.uniform(0, np.pi)
    return np.asarray(ring @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]))


def covered(rings: list[Float64s], shape: tuple[int, ...], ss: float) -> Float32s:
    """How much of each pixel lies within the first ring and no other, (H, W) float32 from 0 to 1, of a picture at `ss`
    times the size that rings are told in.
    """
    canvas = np.zeros(shape[:2], np.uint8)
    at = [np.rint(((ring + 0.5) * ss - 0.5) * 16).astype(np.int32) for ring in rings]
    cv2.fillPoly(canvas, at, 255, cv2.LINE_AA, 4)
    return share(canvas)


def _area(ring: Float64s) -> float:
    """Signed area, the ring's unit squared."""
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
