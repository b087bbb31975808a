"""Things that lie over a block's edge: tape, clamps, cables and hands."""

from __future__ import annotations

import math

import cv2
import numpy as np

from benchmarks.other_hand.canvas import Canvas
from benchmarks.other_hand.drawings import depth, disc, filled, share, stroke
from benchmarks.other_hand.fields import blurred, ramp, spread, tint
from benchmarks.other_hand.layout import Layout
from benchmarks.other_hand.outlines import around, curve, direction, rotated, rounded
from contour.geometry.arrays import Bytes, Float32s, Float64s


def tape(canvas: Canvas, where: Layout) -> None:
    """One to three torn strips, one of five along the edge; cells show through half of them."""
    rng = canvas.rng
    for _ in range(rng.integers(1, 4)):
        point, aside, outward = where.edge(rng, 0.4)
        if rng.random() < 0.2:
            outward, aside = aside, -outward
        wide = max(14.0, where.pitch * spread(rng, 0.8, 4.0))
        ends = where.pitch * rng.uniform(2.0, 8.0, 2) * (1.0, -1.0)
        places = np.linspace(-0.5, 0.5, int(rng.integers(6, 16))) * wide
        torn = [end + rng.uniform(-0.04, 0.04, len(places)) * wide for end in ends]
        sides = [np.outer(far, outward) + np.outer(places, aside) for far in torn]
        cover = share(filled(canvas.shape, [point + np.vstack([sides[0], sides[1][::-1]])], cv2.LINE_AA))
        texture = canvas.mottled((2.0, 0.02), (0.8 * where.pitch, rng.uniform(0.01, 0.08))) * spread(rng, 0.08, 1.1)
        if rng.random() < 0.5:
            texture += 0.1 * blurred(canvas.tops, 0.1 * where.pitch)
        canvas.cover(cover, texture, tint(*rng.uniform(0.4, 1.5, 3)), 2.0, 0.3)


def clamp(canvas: Canvas, where: Layout) -> None:
    """One to three bars with bevelled sides and bolts, three of ten on a wider pad."""
    rng = canvas.rng
    for _ in range(rng.integers(1, 4)):
        point, aside, outward = where.edge(rng, 0.3)
        wide = max(24.0, rng.uniform(1.2, 4.0) * where.pitch)
        inner, outer = rng.uniform((1.2, 2.0), (4.0, 9.0)) * where.pitch
        half, tip = 0.5 * wide * aside, 0.5 * wide * aside * rng.uniform(0.5, 1.0)
        near, far = point - outward * inner, point + outward * outer
        corners = np.stack([far + half, far - half, near - tip, near + tip])
        drawn = filled(canvas.shape, [rounded(corners, wide * rng.uniform(0.02, 0.24))], cv2.LINE_AA)
        side = ramp(canvas.shape, point, aside) / wide * np.float32(aside @ direction(canvas.lamp))
        bevel = np.clip(1.0 - blurred(depth(drawn), 1.5) / (0.1 * wide), 0.0, 1.0)
        light = canvas.mottled((2.0, 0.03), (60.0, 0.08)) + 0.5 * bevel * np.sign(side) + 0.2 * side
        light *= spread(rng, 0.06, 0.8)
        for _ in range(rng.integers(0, 3)):
            place = point + outward * rng.uniform(-0.5 * inner, 0.8 * outer)
            bolt = _bolt(canvas, place, wide * rng.uniform(0.15, 0.33))
            light = np.where(bolt > 0.0, bolt * spread(rng, 0.2, 0.9), light)
        if rng.random() < 0.3:
            pad = canvas.blank()
            disc(pad, point - outward * 0.7 * inner, wide * rng.uniform(0.55, 0.8), 255)
            canvas.cover(share(pad), spread(rng, 0.04, 0.5) * canvas.mottled((2.0, 0.03)), tint(0.4, 0.5, 1.5), 4.0)
        canvas.cover(share(drawn), light, tint(*rng.uniform(0.5, 1.4, 3)), max(4.0, 0.15 * wide))


def _bolt(canvas: Canvas, middle: Float64s, radius: float) -> Float32s:
    """Light of a bolt with a hexagonal socket, 0 where there is none."""
    drawn = canvas.blank()
    disc(drawn, middle, 1.15 * radius, 140)
    disc(drawn, middle, radius, 255)
    socket = middle + around(np.arange(6) * math.pi / 3.0 + canvas.rng.random(), 0.55 * radius)
    dark = share(filled(canvas.shape, [socket], cv2.LINE_AA))
    return np.asarray(share(drawn) * (1.0 - 0.7 * dark), np.float32)


def cable(canvas: Canvas, where: Layout) -> None:
    """One or two cables that come in from afar and end on the block or turn away again."""
    rng, width = canvas.rng, canvas.shape[1]
    for _ in range(rng.integers(1, 3)):
        point, _, outward = where.edge(rng, 0.5)
        end = point - outward * rng.uniform(2.0, 10.0) * where.pitch
        knots = [point + outward * 1.5 * max(canvas.shape), point + outward * 0.22 * width, point, end]
        if rng.random() < 0.65:
            back = rotated(outward, rng.uniform(0.6, 2.6) * rng.choice([-1.0, 1.0]))
            knots += [end + back * 0.35 * width, end + back * 2.0 * width]
        points = np.array(knots)
        points[1:-1] += rng.standard_normal((len(points) - 2, 2)) * 0.01 * width
        drawn, thick = canvas.blank(), int(max(5.0, where.pitch * spread(rng, 0.25, 1.5)))
        stroke(drawn, curve(points, 300), 255, thick)
        off = np.clip(1.0 - 2.0 * depth(drawn) / thick, 0.0, 1.0)
        light = spread(rng, 0.04, 0.8) * (0.35 + 0.65 * np.sqrt(1.0 - off**2))
        light += rng.uniform(0.02, 0.5) * np.exp(-(((off - rng.uniform(0.0, 0.4)) / 0.15) ** 2))
        canvas.cover(share(drawn), light, tint(*rng.uniform(0.3, 1.6, 3)), max(3.0, 0.5 * thick))


def hand(canvas: Canvas, where: Layout) -> None:
    """A hand with its arm, one of four times two, gloved or not, that reaches over the edge."""
    for _ in range(1 if canvas.rng.random() < 0.75 else 2):
        rng, (point, aside, outward) = canvas.rng, where.edge(canvas.rng, 0.45)
        size = canvas.shape[1] * rng.uniform(0.07, 0.17)
        palm = point + outward * size * rng.uniform(-0.3, 0.9)
        frame = np.stack([-outward, aside * rng.choice([-1.0, 1.0])]) * size
        drawn, height = canvas.blank(), np.zeros(canvas.shape, np.float32)
        for points, first, last in _limbs(canvas, 1.5 * max(canvas.shape) / size):
            limb = _limb(canvas, palm + points @ frame, first * size, last * size)
            up = 1.0 - np.clip(depth(limb) / (max(first, last) * size), 0.0, 1.0)
            np.maximum(height, np.sqrt(1.0 - up**2) * np.float32(max(first, last) * size), out=height)
            np.maximum(drawn, limb, out=drawn)
        height = blurred(height, 1.5)
        y, x = np.gradient(height)
        right, down = direction(canvas.lamp).tolist()
        facing = np.clip((0.8 - 0.5 * (x * right + y * down)) / np.sqrt(1.0 + x**2 + y**2), 0.12, 1.2)
        skin = canvas.mottled((2.2, rng.uniform(0.01, 0.08)), (0.1 * size, 0.06)) * spread(rng, 0.06, 0.95)
        canvas.cover(share(drawn), skin * facing, tint(*rng.uniform(0.4, 1.5, 3)), max(6.0, 0.12 * size), 0.55)


def _limbs(canvas: Canvas, far: float) -> list[tuple[Float64s, float, float]]:
    """Arm, palm, thumb and fingers: points along and aside of the hand, and radii at both ends, of a palm's width."""
    rng = canvas.rng
    limbs = [
        (np.array([(-far, 0.0), (-1.0, 0.0), (-0.3, 0.0)]), 0.42, 0.4),
        (np.array([(-0.3, -0.12), (0.25, 0.05)]), 0.45, 0.5),
        (np.array([(-0.1, 0.4), (0.3, 0.75), (0.75, 0.8)]), 0.17, 0.12),
    ]
    for place, length in zip((-1.5, -0.5, 0.5, 1.5), (1.0, 1.15, 1.1, 0.85), strict=True):
        root = np.array([0.45, 0.27 * place])
        finger = np.array([1.0, place * rng.uniform(0.05, 0.2)]) * length * rng.uniform(0.75, 1.1)
        tip = root + finger + np.array([0.0, 0.05 * rng.standard_normal()])
        limbs.append((np.stack([root, root + 0.55 * finger, tip]), 0.135, 0.105))
    return limbs


def _limb(canvas: Canvas, points: Float64s, first: float, last: float) -> Bytes:
    """Discs along a curve, their radii from the first to the last."""
    drawn, bent = canvas.blank(), curve(points, 400)
    near = ((bent > -300.0) & (bent < np.array(canvas.shape[::-1]) + 300.0)).all(axis=1)
    for place, radius in zip(bent[near], np.linspace(first, last, 400)[near].tolist(), strict=True):
        disc(drawn, place, radius, 255)
    return drawn
