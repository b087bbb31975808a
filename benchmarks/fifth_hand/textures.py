"""Surfaces of tables and things: deviations of about unit size about 0, (H, W), drawn along an angle, radians."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.fifth_hand.noise import fractal_noise, smooth_noise, turned_axes, turned_noise
from benchmarks.other_hand.fields import Field, Rng, Shape
from contour.geometry.arrays import Float32s


def _plain(rng: Rng, shape: Shape, _angle: float) -> Field:
    """Almost nothing."""
    return 0.15 * smooth_noise(rng, shape, rng.uniform(20, 80))


def _grainy(rng: Rng, shape: Shape, _angle: float) -> Field:
    """Fine grain as of paper or cast metal."""
    return smooth_noise(rng, shape, rng.uniform(1.0, 2.5))


def _mottled(rng: Rng, shape: Shape, _angle: float) -> Field:
    """Cloudy spots of several sizes."""
    return fractal_noise(rng, shape, rng.uniform(12, 70), 4)


def _brushed(rng: Rng, shape: Shape, angle: float) -> Field:
    """Fine parallel scratches."""
    return turned_noise(rng, shape, angle, rng.uniform(1.0, 2.2), rng.uniform(25, 90))


def _wood(rng: Rng, shape: Shape, angle: float) -> Field:
    """Lines of grain bent by slow noise, with fibres."""
    _, across = turned_axes(shape, angle)
    bend = turned_noise(rng, shape, angle, rng.uniform(30, 80), rng.uniform(4, 9))
    rings = np.sin(across / rng.uniform(1.5, 6.0) + bend * rng.uniform(1.0, 4.0))
    return np.asarray(0.6 * rings + 0.5 * turned_noise(rng, shape, angle, 1.4, 30) + 0.4 * bend)


def _woven(rng: Rng, shape: Shape, angle: float) -> Field:
    """Crossing threads."""
    along, across = turned_axes(shape, angle)
    period = rng.uniform(2.2, 6.0)
    threads = np.sin(along * (2 * np.pi / period)) * np.sin(across * (2 * np.pi / period))
    return np.asarray(threads + 0.5 * smooth_noise(rng, shape, 2.0))


def _striped(rng: Rng, shape: Shape, angle: float) -> Field:
    """Regular bars or ribs."""
    along, _ = turned_axes(shape, angle)
    wave = np.sin(along * (2 * np.pi / rng.uniform(6.0, 30.0)))
    return np.asarray(np.tanh(wave * rng.uniform(1, 6)) + 0.2 * smooth_noise(rng, shape, 3))


def _porous(rng: Rng, shape: Shape, _angle: float) -> Field:
    """Foam: dark pores in a lighter ground."""
    field = smooth_noise(rng, shape, rng.uniform(2.0, 5.0))
    return np.asarray(0.6 - 1.6 * np.clip(field - 0.5, 0, 1.5) + 0.3 * smooth_noise(rng, shape, 30))


def _printed(rng: Rng, shape: Shape, angle: float) -> Field:
    """Lines of dark words on an even ground."""
    along, across = turned_axes(shape, angle)
    pitch = rng.uniform(7.0, 20.0)
    line = np.floor(across / pitch)
    inside = np.abs(across / pitch - line - 0.5) < rng.uniform(0.15, 0.32)
    letters = rng.random(4096) < rng.uniform(0.4, 0.7)
    key = (np.floor(along / (pitch * 0.16)).astype(np.int64) * 31 + line.astype(np.int64) * 977) % 4096
    ink = np.asarray(cv2.GaussianBlur((inside & letters[key]).astype(np.float32), (0, 0), 0.6), np.float32)
    return np.asarray(0.25 - 2.2 * ink)


def _creased(rng: Rng, shape: Shape, angle: float) -> Field:
    """Crumpled facets as of foil or used film."""
    field = np.zeros(shape, np.float32)
    along, across = turned_axes(shape, angle)
    for _ in range(int(rng.integers(5, 14))):
        turn = rng.uniform(0, np.pi)
        wave = along * np.float32(np.cos(turn)) + across * np.float32(np.sin(turn))
        phase = wave / rng.uniform(8, 60) + rng.uniform(0, 9)
        field += np.abs((phase % 2.0) - 1.0) - 0.5
    return field + 0.2 * smooth_noise(rng, shape, 4)


def _speckled(rng: Rng, shape: Shape, _angle: float) -> Field:
    """Sparse specks, light or dark."""
    field = smooth_noise(rng, shape, rng.uniform(1.5, 3.5))
    return np.asarray(rng.choice([-1.0, 1.0]) * 2.0 * np.clip(field - 1.1, 0, 1))


TEXTURES: dict[str, Callable[[Rng, Shape, float], Field]] = {
    "plain": _plain,
    "grainy": _grainy,
    "mottled": _mottled,
    "brushed": _brushed,
    "wood": _wood,
    "woven": _woven,
    "striped": _striped,
    "porous": _porous,
    "printed": _printed,
    "creased": _creased,
    "speckled": _speckled,
}


def texture(name: str, rng: Rng, shape: Shape, angle: float) -> Float32s:
    """One of `TEXTURES`, (H, W) float32."""
    return TEXTURES[name](rng, shape, angle).astype(np.float32)
