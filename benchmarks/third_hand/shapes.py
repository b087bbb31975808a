"""Signed distances to shapes, pixels, negative within, (H, W) float32; and reliefs over them, pixels high."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np

from benchmarks.third_hand.stage import Stage
from benchmarks.third_hand.textures import F32
from contour.geometry.arrays import Float32s, Float64s


def box(u: Float32s, v: Float32s, half_u: float, half_v: float, r: float = 0.0) -> Float32s:
    """Distance to a box of half lengths along u and v, its corners rounded by a radius."""
    qu, qv = np.abs(u) - F32(half_u - r), np.abs(v) - F32(half_v - r)
    return cv2.magnitude(np.maximum(qu, 0), np.maximum(qv, 0)) + np.minimum(np.maximum(qu, qv), 0) - F32(r)


def disc(u: Float32s, v: Float32s, r: float) -> Float32s:
    """Distance to a disc of a radius about the origin."""
    return cv2.magnitude(u, v) - F32(r)


def capsule(u: Float32s, v: Float32s, a: tuple[float, float], b: tuple[float, float], r: float) -> Float32s:
    """Distance to a line from a to b, (u, v) each, that is thick by a radius and ends round."""
    du, dv = b[0] - a[0], b[1] - a[1]
    t = np.clip(((u - F32(a[0])) * F32(du) + (v - F32(a[1])) * F32(dv)) / F32(du * du + dv * dv), 0, 1)
    return cv2.magnitude(u - F32(a[0]) - t * F32(du), v - F32(a[1]) - t * F32(dv)) - F32(r)


def dome(sd: Float32s, r: float, high: float | None = None) -> Float32s:
    """A round relief that rises over so many pixels from the edge, as high as that unless told."""
    t = 1 - np.clip(-sd / F32(r), 0, 1)
    return np.asarray(F32(high or r) * np.sqrt(1 - t * t), F32)


def bevel(sd: Float32s, high: float, edge: float) -> Float32s:
    """A flat relief with a slope of so many pixels at its edge."""
    return np.asarray(F32(high) * np.clip(-sd / F32(edge), 0, 1), F32)


def spine(st: Stage, points: Float64s) -> tuple[Float32s, Float32s]:
    """How far along a line through points, (N, 2), each pixel's nearest place lies, and how far it lies from there:
    pixels, (H, W) float32 both.
    """
    pieces = [np.linspace(p, q, 24, endpoint=False) for p, q in pairwise(points)]
    fine = np.concatenate([*pieces, points[-1:]])
    fine = cv2.GaussianBlur(fine.astype(F32), (1, 41), 12, borderType=cv2.BORDER_REPLICATE)
    way = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(fine, axis=0).T))])
    along = np.arange(0, way[-1], F32(0.5) / st.ss)
    canvas = np.full(st.x.shape, 255, np.uint8)
    dense = np.stack([np.interp(along, way, fine[:, k]) for k in (0, 1)], 1)
    at = np.rint((dense + 0.5) * st.ss - 0.5).astype(int)
    ok = (at >= 0).all(1) & (at[:, 0] < st.x.shape[1]) & (at[:, 1] < st.x.shape[0])
    canvas[at[ok, 1], at[ok, 0]] = 0
    dist, label = cv2.distanceTransformWithLabels(canvas, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    table = np.zeros(int(label.max()) + 1, F32)
    table[label[at[ok, 1], at[ok, 0]]] = along[ok]
    return table[label], np.asarray(cv2.GaussianBlur(dist, (0, 0), 0.8) / F32(st.ss), F32)
