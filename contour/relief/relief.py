"""What differs from a table that is known, brighter or darker, and how far walls' lower edges are displaced."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s
from contour.image.pixel_sampling import FULL_SCALE, planes_of, sample_at
from contour.relief.shadow import in_shadow

# The table's shade is the median of its light now over what it was, over so many pitches: cells show more of the
# table than walls cover. The median of so many samples is enough, in steps of a 64th that a blur takes out again.
_SHADE_PITCHES, _SHADE_SAMPLES, _STEPS = 0.8, 24, 64.0
# Nothing that shades a table makes it lighter, but lamps differ a little from place to place.
_LIGHTEST = 1.15
_MOST_CLIPPED = 0.02
# Light over light, where the table is as it was; and grey levels that are added to both: dark grooves are noise.
_ALIKE, _DARK = 120.0, 8.0
# Walls' tops and sides, one brighter than the table and one darker, meet in a line of no difference.
_GAP_PX = 5
# A share that displaces nothing by a hundredth of a pixel.
_FLAT = 1e-6
# Roots of differences, so that faint walls beside bright ones are walls as well: 255 at full scale.
_ROOT = 16.0


@dataclass(frozen=True, eq=False)
class Displacement:
    """How far the lower edges of walls seem displaced towards `middle`, picture pixels (x, y): by this share of the
    distance from it, as a camera that looks down shows them.
    """

    share: float
    middle: Float64s

    def at(self, points: Float64s) -> Float64s:
        """Where from points (N, 2) on top of the block what lies below them on the table is seen, shape (N, 2)."""
        return -self.share * (points - self.middle)

    @staticmethod
    def of(points: Float64s, below: Float64s) -> Displacement:
        """Fitted to points (N, 2) at the top and where what lies below them is seen, (N, 2)."""
        x, y = points.T
        zero, one = np.zeros_like(x), np.ones_like(x)
        terms = np.concatenate([np.stack([-x, one, zero], axis=1), np.stack([-y, zero, one], axis=1)])
        share, *offset = np.linalg.lstsq(terms, (below - points).T.ravel(), rcond=None)[0].tolist()
        return Displacement(share, np.array(offset) / share) if abs(share) > _FLAT else Displacement(0.0, np.zeros(2))


@dataclass(frozen=True, eq=False)
class Relief:
    """A picture on a known table.

    apart: how much it differs from the table in its shade, (H, W), uint8, roots of grey levels, in the channel in which
    it does most. signed: channels less the table's in its shade, (H, W) each, float32, grey levels. lit: light now over
    light then, 120 where they are alike, in the picture's shape, uint8. displacement: that of walls' lower edges.
    wall_px: how wide walls measure. even: whether the table is known from the picture alone, as one without a pattern.
    """

    apart: Bytes
    signed: tuple[Float32s, ...]
    lit: Bytes
    displacement: Displacement
    wall_px: float
    even: bool = False

    def height_at(self, points: Float64s) -> Float64s:
        """By how much walls at points (N, 2) of their boundary differ from the table, at most, grey levels, shape (N,):
        in the channel in which they do most, within half a wall of each.
        """
        half = max(1, round(0.5 * self.wall_px))
        steps = np.arange(-half, half + 1)
        across, down = (side.ravel() for side in np.meshgrid(steps, steps))
        x, y = points[:, :1] + across, points[:, 1:] + down
        heights = [np.abs(sample_at(plane, x, y)).max(axis=1) for plane in self.signed]
        return np.asarray(np.max(heights, axis=0), np.float64)

    def cut(self, first: Float64s, size: tuple[int, int]) -> Relief:
        """The same of a part of the picture, whose first pixel is `first` (x, y), of `size` (width, height)."""
        x, y = first.astype(int).tolist()
        part = slice(y, y + size[1]), slice(x, x + size[0])
        moved = replace(self.displacement, middle=self.displacement.middle - first)
        signed = tuple(plane[part] for plane in self.signed)
        return replace(self, apart=self.apart[part], signed=signed, lit=self.lit[part], displacement=moved)


def relief_of(picture: Bytes, table: Bytes, pitch_px: float, displacement: Displacement, wall_px: float) -> Relief:
    """How a picture stands out of a known table, both grey (H, W) or BGR (H, W, 3), uint8, as light as it is now."""
    planes = list(zip(planes_of(picture), planes_of(table), strict=True))
    # What a shadow does to a channel at full scale is not known.
    told = [pair for pair in planes if np.mean(pair[1][::7, ::7] >= FULL_SCALE) < _MOST_CLIPPED] or planes
    light, known = (_mean(side) for side in zip(*told, strict=True))
    shade = _shade(light, known, _SHADE_PITCHES * pitch_px)
    signed = tuple(now + np.float32(1.0) - shade * (then + np.float32(1.0)) for now, then in told)
    size = np.maximum.reduce([np.abs(plane) for plane in signed])
    root = np.minimum(_ROOT * np.sqrt(size), 255.0).astype(np.uint8)
    closed = cv2.morphologyEx(root, cv2.MORPH_CLOSE, np.ones((_GAP_PX, _GAP_PX), np.uint8))
    # A shadow lies over nothing.
    unshaded = np.where(in_shadow(light, known, shade, pitch_px), shade, np.float32(1.0))
    then = table * (unshaded if table.ndim == 2 else unshaded[:, :, None])
    ratio = np.float32(_ALIKE) * (picture + np.float32(_DARK)) / (then + np.float32(_DARK))
    lit = np.minimum(ratio, 255.0).astype(np.uint8)
    return Relief(np.asarray(closed, np.uint8), signed, lit, displacement, wall_px)


def _mean(planes: tuple[Bytes, ...]) -> Float32s:
    return np.asarray(np.mean(planes, axis=0, dtype=np.float32) + 1.0, np.float32)


def _shade(light: Float32s, known: Float32s, window_px: float) -> Float32s:
    """The table's light now over what it was, wherever most of a window shows table, (H, W), float32."""
    step = max(1, round(window_px / _SHADE_SAMPLES))
    ratio = np.minimum(_STEPS * light[::step, ::step] / known[::step, ::step], _STEPS * _LIGHTEST).astype(np.uint8)
    size = max(3, 2 * round(0.5 * window_px / step) + 1)
    middle = cv2.medianBlur(ratio, size).astype(np.float32) / np.float32(_STEPS)
    smooth = cv2.blur(middle, (size // 4 + 1, size // 4 + 1))
    return np.asarray(cv2.resize(smooth, light.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)
