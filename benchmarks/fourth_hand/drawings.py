"""Places, and what is drawn there: points (N, 2) float64 of x and y, pixels, rings without the first point again."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Rng, Shape
from benchmarks.other_hand.outlines import across
from contour.geometry.arrays import Bytes, Float32s, Float64s

FINE = 3  # masks are drawn this much finer than the picture


@dataclass(frozen=True, eq=False)
class Place:
    """Where a thing goes: a point of the block's edge, the way inward, a unit vector, and measures in pixels."""

    rng: Rng
    shape: Shape
    at: Float64s
    inward: Float64s
    unit: float  # about the block's size
    pitch: float
    apart: bool = False  # lies along the edge, beside the block, instead of across it

    def heading(self, spread: float = 1.0) -> Float64s:
        """A unit vector turned by at most `spread` radians from the way inward or, apart, from along the edge."""
        turn = self.rng.uniform(-spread, spread) + (np.pi / 2 if self.apart else 0.0)
        c, s = np.cos(turn), np.sin(turn)
        return np.array([c * self.inward[0] - s * self.inward[1], s * self.inward[0] + c * self.inward[1]])


def fill(shape: Shape, polygons: list[Float64s], thickness: float | None = None) -> Float32s:
    """How much of each pixel lies within polygons, of which one inside another is a hole, or on open lines of a
    thickness, pixels: (H, W) float32 from 0 to 1.
    """
    mask = np.zeros((shape[0] * FINE, shape[1] * FINE), np.uint8)
    bound = 8.0 * max(shape) + 500.0
    points = [np.round((np.clip(q, -bound, bound) * FINE + (FINE - 1) / 2) * 16).astype(np.int32) for q in polygons]
    if thickness is None:
        cv2.fillPoly(mask, points, 255, cv2.LINE_8, 4)
    else:
        cv2.polylines(mask, points, False, 255, max(1, round(thickness * FINE)), cv2.LINE_8, 4)
    return shrink(mask)


def shrink(drawn: Bytes) -> Float32s:
    """A drawing that is `FINE` times as fine as the picture, 255 where something is, as shares of its pixels, (H, W)
    float32 from 0 to 1.
    """
    size = (drawn.shape[1] // FINE, drawn.shape[0] // FINE)
    return share(np.asarray(cv2.resize(drawn, size, interpolation=cv2.INTER_AREA), np.uint8))


def run(p: Place, before: float, after: float, wiggle: float, waves: float = 1.0) -> Float64s:
    """A path through the place, (160, 2), from so many pixels before it to so many after, that swings aside by `wiggle`
    pixels.
    """
    way = p.heading()
    t = np.linspace(0, 1, 160)
    side = np.zeros_like(t)
    for order in range(1, 4):
        side += p.rng.normal() / order * np.sin(2 * np.pi * waves * order * t / 2 + p.rng.uniform(0, 6.3))
    side = (side - np.interp(before / (before + after), t, side)) * wiggle
    step = t * (before + after) - before
    return p.at + step[:, None] * way + side[:, None] * across(way)


def ribbon(path: Float64s, half: Float64s | float, tear: float = 0.0, rng: Rng | None = None) -> Float64s:
    """The ring about a path, so many pixels to each side, one number or one of each point; its ends are torn by some
    pixels if there is an `rng`.
    """
    slope = np.gradient(path, axis=0)
    slope /= np.linalg.norm(slope, axis=1, keepdims=True) + 1e-9
    normal = across(slope) * np.broadcast_to(half, (len(path),))[:, None]
    ends = []
    for end, sign in ((-1, 1.0), (0, -1.0)):
        cut = np.linspace(sign, -sign, 14)[1:-1, None]
        ragged = 0.0 if rng is None else rng.normal(0, tear, (12, 1)) * sign
        ends.append(path[end] + normal[end] * cut + slope[end] * ragged)
    return np.concatenate([path + normal, ends[0], (path - normal)[::-1], ends[1]])


def box(at: Float64s, along: Float64s, length: float, width: float, corner: float = 0.1) -> Float64s:
    """A rectangle about a middle, its length along a unit vector, its corners round by a share of its shorter side."""
    r = corner * min(length, width)
    turn = np.linspace(0, np.pi / 2, 6)
    quarter = np.stack([np.cos(turn), np.sin(turn)], 1) * r
    pts = []
    for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        part = quarter * (sx, sy) + (sx * (length / 2 - r), sy * (width / 2 - r))
        pts.append(part if k % 2 == 0 else part[::-1])
    q = np.concatenate(pts)
    return np.asarray(at + q[:, :1] * along + q[:, 1:] * across(along))


def disc(at: Float64s, radius: float, sides: int = 72, turn: float = 0.0) -> Float64s:
    """A circle about a middle, or a regular polygon, its first corner at an angle in radians."""
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False) + turn
    return at + radius * np.stack([np.cos(a), np.sin(a)], 1)


def blob(p: Place, at: Float64s, radius: float, rough: float, stretch: float = 1.0) -> Float64s:
    """A wavy ring about a middle, as a rag's or a stain's."""
    a = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    r = 1 + np.add.reduce([p.rng.normal() * rough / k * np.cos(k * a + p.rng.uniform(0, 6.3)) for k in range(2, 12)])
    q = np.stack([np.cos(a) * stretch, np.sin(a) / stretch], 1) * (radius * np.clip(r, 0.4, 1.7))[:, None]
    way = p.heading(3.1)
    return np.asarray(at + q[:, :1] * way + q[:, 1:] * across(way))
