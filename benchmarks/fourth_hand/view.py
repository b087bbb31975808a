"""How the camera and the main lamp stand."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.fourth_hand.specs import Spec
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float32s, Float64s


@dataclass(frozen=True, eq=False)
class View:
    """How the camera stands, by a tilt of the block's plane, where verticals run to, and how light falls."""

    tilt: Float64s
    nadir: Float64s
    sink: float  # scale about the nadir from the block's top to the table
    light: Float64s  # way in which shadows fall, a unit vector
    height: float  # length of the block's shadow, pixels

    def place(self, q: Float64s) -> Float64s:
        """Points of the block's plane, (N, 2), as the picture shows them, pixels."""
        r = np.c_[q, np.ones(len(q))] @ self.tilt.T
        return np.asarray(r[:, :2] / r[:, 2:])

    def lower(self, image: Float32s, part: float, shift: Float64s | None = None) -> Float32s:
        """A field of the top, (H, W) float32, as it lies below, at 1 on the table, moved by a shift in pixels."""
        k = 1 + (self.sink - 1) * part
        move = self.nadir * (1 - k) + (0 if shift is None else shift)
        matrix = np.array([[k, 0, move[0]], [0, k, move[1]]], np.float64)
        return np.asarray(cv2.warpAffine(image, matrix, image.shape[1::-1], flags=cv2.INTER_LINEAR), np.float32)


def look(rng: Rng, shape: Shape, spec: Spec) -> View:
    """A camera slightly aside, and a lamp somewhere, as hard as the spec asks for."""
    h, w = shape
    centre = np.array([[1, 0, w / 2], [0, 1, h / 2], [0, 0, 1]])
    bend = np.eye(3)
    bend[2, :2] = rng.normal(0, 0.025, 2) / w * 2
    tilt = centre @ bend @ np.linalg.inv(centre)
    aside = rng.uniform(0, 2 * np.pi)
    nadir = np.array([w, h]) / 2 + np.array([np.cos(aside), np.sin(aside)]) * w * rng.uniform(0.1, 1.6)
    angle = rng.uniform(0, 2 * np.pi)
    height = {"hard": rng.uniform(15, 50), "soft": rng.uniform(10, 50)}.get(spec.shadow or "", rng.uniform(3, 32))
    sink = 1 - min(rng.uniform(0.004, 0.035) * spec.flank, 0.06)
    return View(tilt, nadir, sink, np.array([np.cos(angle), np.sin(angle)]), height)
