"""How well a picture shows a block's walls: sharpness, exposure, contrast, each measured and held against a limit.

What is measured on a traced block is measured on small tiles along and inside its outline, in units of its own cells,
so that the size of the picture does not matter. Where nothing was traced only the picture as a whole can be judged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from statistics import NormalDist

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Int64s, median
from contour.geometry.rings import Contour, Ring
from contour.image.channels import largest
from contour.image.pixel_sampling import FULL_SCALE

# So many pixels tell enough, and cost about a millisecond.
_SAMPLED_PX = 60_000
_MOST_TILES = 48
_LEAST_TILE_PX = 16
_TILE_PITCHES = 1.6
_USUAL_PITCH_PX = 24.0
# Walls and cells cover more than this of any tile; dust and glints less. Of large cells walls a pixel wide cover two
# pixels over the pitch: half of that then.
_TAIL, _TAIL_PX = 0.04, 1.0
# What a fifth of normal deviates stay below in size, times what a second difference both ways adds up: 6 deviations.
_SECOND_OF_NOISE = 0.2533 * 6.0
# Nothing in cells of fewer pixels is flat: their noise is that of the table beside them.
_NOWHERE_FLAT_PX = 6.0
# Steepest rise of a blurred step, and of a blurred line, over their height: 0.40 and 0.61 of 1/sigma.
_STEEPEST = 0.5
# Blur that motion or defocus adds to, variance to variance.
_LENS_BLUR_PX = 1.4

# Of a picture in which nothing was traced.
_LOOKED_AT_PX = 300_000
_SPECKS = 0.002
_DARK_LEVEL = 24.0
_MOST_CLIPPED = 0.5
_SOFTEST_EDGE_PX = 3.5
_EDGE_REACH_PX = 12
_LEAST_EDGE = 12.0


@dataclass(frozen=True)
class Quality:
    """How the walls of a block are seen.

    level: grey level of what is brightest in it (96th percentile and more). contrast: from cells to walls, grey levels.
    noise: standard deviation of a pixel. blur_px: standard deviation of the blur, in the direction in which it is
    worst. pitch_px: of the cells. clipped_share: of the pixels at and inside the outline, those at full scale.
    """

    level: float
    contrast: float
    noise: float
    blur_px: float
    pitch_px: float
    clipped_share: float

    def reduced(self, times: int) -> Quality:
        """The same in the pixels of a picture that is shown so many times as large."""
        return replace(self, blur_px=self.blur_px / times, pitch_px=self.pitch_px / times)


@dataclass(frozen=True)
class QualityLimits:
    """Beyond these a contour is not trusted. Blur may reach a share of the pitch on top of that of a fair lens, or a
    number of pixels where that is more: cells of a few pixels cannot look sharper than the pixels are. Walls at full
    scale still show where they end: the bound on the outline tells what it costs.
    """

    max_blur_pitches: float = 0.12
    max_blur_px: float = 1.9
    max_clipped_share: float = 0.7
    min_level: float = 16.0
    min_contrast: float = 8.0
    min_contrast_to_noise: float = 4.0


def block_quality(picture: Bytes, light: Bytes, contour: Contour, pitch_px: float | None) -> Quality:
    """The quality of the walls within `contour` (pixels) in a picture, grey (H, W) or BGR (H, W, 3), uint8.

    `light` (H, W), uint8, is the channel of it that shows the walls. `pitch_px` None takes the place of an unknown
    pitch by a usual one.
    """
    pitch_px = pitch_px or _USUAL_PITCH_PX
    places = _tile_places(light.shape, contour.exterior, pitch_px)
    colours, tiles = _tiles(picture, places), _tiles(light, places)
    clipped = float(np.mean(colours.reshape(*tiles.shape, -1).max(axis=3) >= FULL_SCALE))
    tail = min(_TAIL, _TAIL_PX / pitch_px)
    low, high = _tails(tiles, tail)
    noise = _noise(tiles)
    if pitch_px < _NOWHERE_FLAT_PX:
        noise = min(noise, _noise(light[None]))
    # Between such tails of nothing but normal noise there is a spread, too.
    of_noise = 2.0 * NormalDist().inv_cdf(1.0 - tail) * noise
    contrast = np.maximum(high - low - np.float32(of_noise), np.float32(0.0))
    blur = _blur_px(tiles, contrast, noise)
    return Quality(
        level=median(high),
        contrast=median(contrast),
        noise=noise,
        blur_px=blur,
        pitch_px=pitch_px,
        clipped_share=clipped,
    )


def quality_faults(quality: Quality, limits: QualityLimits) -> tuple[str, ...]:
    """What is too bad, each as a sentence with the measured value, the limit and what to do; empty = good enough."""
    faults = []
    if quality.level < limits.min_level:
        faults.append(
            f"the block's brightest parts reach {quality.level:.0f} of 255 grey levels, at least {limits.min_level:g} "
            "are needed. Give more light or a longer exposure"
        )
    if quality.clipped_share > limits.max_clipped_share:
        faults.append(
            f"{100 * quality.clipped_share:.0f} % of the block is overexposed (at full scale), at most "
            f"{100 * limits.max_clipped_share:g} % is allowed. Give less light or a shorter exposure"
        )
    if quality.contrast < limits.min_contrast:
        faults.append(
            f"walls stand out of their cells by {quality.contrast:.1f} grey levels, at least {limits.min_contrast:g} "
            "are needed. Check the light, the exposure and the lens"
        )
    most = most_blur_px(quality.pitch_px, limits)
    if quality.blur_px > most:
        faults.append(
            f"walls are blurred by {quality.blur_px:.1f} px where cells are {quality.pitch_px:.0f} px apart, at most "
            f"{most:.1f} px is allowed. Check the focus, clean the lens, keep block and camera still"
        )
    return tuple(faults)


def most_blur_px(pitch_px: float, limits: QualityLimits) -> float:
    """The blur up to which walls of cells this far apart are sharp enough."""
    return max(float(np.hypot(limits.max_blur_pitches * pitch_px, _LENS_BLUR_PX)), limits.max_blur_px)


def lost_in_noise(quality: Quality, limits: QualityLimits) -> str | None:
    """What says that there are no walls at all, as a sentence; None where they stand out of the noise."""
    least = limits.min_contrast_to_noise * quality.noise
    if quality.contrast >= least:
        return None
    return (
        f"what looks like cells stands out by {quality.contrast:.1f} grey levels of a noise of {quality.noise:.1f}, at "
        f"least {least:.1f} are needed. Check that a block lies in view, and the light"
    )


@dataclass(frozen=True, eq=False)
class _TilePlaces:
    """Left and top pixels of square tiles, (N,) each, and their side, pixels."""

    left: Int64s
    top: Int64s
    side: int


def _tile_places(shape: tuple[int, ...], exterior: Ring, pitch_px: float) -> _TilePlaces:
    """Places of tiles along and inside the outline, in a picture of `shape` (H, W)."""
    height, width = shape
    side = int(min(max(_LEAST_TILE_PX, round(_TILE_PITCHES * pitch_px)), height, width))
    count = int(np.clip(_SAMPLED_PX // side**2, 6, _MOST_TILES))
    low, high = np.floor(exterior.min(axis=0)), np.ceil(exterior.max(axis=0))
    # A raster of the outline with some 40 samples along its longer side finds places inside it.
    step = max(1.0, float((high - low).max()) / 40.0)
    size = np.maximum(np.ceil((high - low) / step), 1).astype(int) + 1
    inside = np.zeros((size[1], size[0]), np.uint8)
    cv2.fillPoly(inside, [np.rint((exterior - low) / step).astype(np.int32)], 1)
    # Every so many rows and columns: one in so many of all, row by row, would lie along the sides.
    hop = max(1, round(float(np.sqrt(np.count_nonzero(inside) / count))))
    if not inside[hop // 2 :: hop, hop // 2 :: hop].any():
        hop = 1
    rows, columns = np.nonzero(inside[hop // 2 :: hop, hop // 2 :: hop])
    chosen = np.linspace(0, len(rows) - 1, min(count, len(rows))).astype(int)
    centres = low + step * (hop * np.column_stack([columns[chosen], rows[chosen]]) + hop // 2)
    left = np.clip(np.rint(centres[:, 0] - side / 2), 0, width - side).astype(int)
    top = np.clip(np.rint(centres[:, 1] - side / 2), 0, height - side).astype(int)
    return _TilePlaces(left, top, side)


def _tiles(picture: Bytes, at: _TilePlaces) -> Bytes:
    """The picture's tiles, shape (N, S, S) or (N, S, S, 3)."""
    return np.stack([picture[y : y + at.side, x : x + at.side] for x, y in zip(at.left, at.top, strict=True)])


def _tails(light: Bytes, tail: float) -> tuple[Float32s, Float32s]:
    """Grey levels that such a share of each tile lies below and above, shape (N,) each."""
    flat = light.reshape(len(light), -1)
    cut = max(1, round(tail * flat.shape[1]))
    ordered = np.partition(flat, (cut, flat.shape[1] - 1 - cut), axis=1)
    return ordered[:, cut].astype(np.float32), ordered[:, -1 - cut].astype(np.float32)


def _noise(light: Bytes) -> float:
    """Standard deviation of a pixel's noise: what second differences both ways see where they see least else."""
    part = light.astype(np.int16)
    bent = part[:, :, :-2] - 2 * part[:, :, 1:-1] + part[:, :, 2:]
    second = np.abs(bent[:, :-2] - 2 * bent[:, 1:-1] + bent[:, 2:])
    # Differences are whole numbers: a fifth of them at 0 says no more than "below one".
    fifth = np.partition(second.ravel(), second.size // 5)[second.size // 5]
    return float((fifth + 0.5) / _SECOND_OF_NOISE)


def _blur_px(light: Bytes, contrast: Float32s, noise: float) -> float:
    """Blur in the direction in which it is worst: contrast over the steepest rise, median over the tiles.

    A honeycomb has walls in three directions: none leaves a direction without rises, unless the block moved along it.
    """
    smooth = np.stack([cv2.GaussianBlur(tile, (3, 3), 0) for tile in light.astype(np.float32)])
    dx = 0.5 * (smooth[:, 1:-1, 2:] - smooth[:, 1:-1, :-2])
    dy = 0.5 * (smooth[:, 2:, 1:-1] - smooth[:, :-2, 1:-1])
    worst = 0.0
    for rise in (dx, dy, (dx + dy) * np.float32(0.7071), (dx - dy) * np.float32(0.7071)):
        flat = np.abs(rise).reshape(len(rise), -1)
        place = flat.shape[1] - 1 - max(1, flat.shape[1] // 100)
        steepest = np.partition(flat, place, axis=1)[:, place]
        # Of noise alone the steepest hundredth is 2.6 of its deviations, a quarter of a pixel's after the smoothing.
        clean = np.sqrt(np.maximum(steepest**2 - (0.65 * noise) ** 2, 1e-6))
        worst = max(worst, median(_STEEPEST * contrast / clean))
    # The smoothing's own blur comes off.
    return float(np.sqrt(max(worst**2 - 0.5, 0.0)))


def picture_faults(picture: Bytes) -> tuple[str, ...]:
    """What is wrong with a picture as a whole, in which nothing was traced: too dark, overexposed, nothing sharp.

    Only what no table and no thing on it can look like: black all over, white over most of it, or things that stand out
    but have no sharp edge anywhere.
    """
    hop = max(1, round(np.sqrt(picture.shape[0] * picture.shape[1] / _LOOKED_AT_PX)))
    light = largest(picture)
    brightest = float(np.quantile(light[::hop, ::hop], 1 - _SPECKS))
    clipped = float(np.mean(light[::hop, ::hop] >= FULL_SCALE))
    if brightest < _DARK_LEVEL:
        return (
            f"its brightest parts reach {brightest:.0f} of 255 grey levels, at least {_DARK_LEVEL:g} are needed. "
            "Check the lamp, the exposure, and that the lens is not covered",
        )
    if clipped > _MOST_CLIPPED:
        return (
            f"{100 * clipped:.0f} % of it is overexposed (at full scale), at most {100 * _MOST_CLIPPED:g} % is "
            "allowed. Give less light or a shorter exposure",
        )
    width = _edge_width_px(light)
    if width is not None and width > _SOFTEST_EDGE_PX:
        return (
            f"its sharpest edges are blurred by {width:.1f} px, at most {_SOFTEST_EDGE_PX:g} px is allowed where no "
            "cells can be seen. Check the focus, clean the lens, keep block and camera still",
        )
    return ()


def _edge_width_px(light: Bytes) -> float | None:
    """Blur of the sharpest edges in a picture, pixels; None where nothing stands out of the noise.

    The sharpest are those with the steepest rise for their height within a few pixels; a step blurred by sigma rises by
    its height over 2.5 sigma.
    """
    smooth = cv2.GaussianBlur(light, (0, 0), 1.0).astype(np.float32)
    dx, dy = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=0.125)
    steep = cv2.magnitude(dx, dy)
    size = (2 * _EDGE_REACH_PX + 1,) * 2
    around = np.ones(size, np.uint8)
    height = cv2.dilate(smooth, around) - cv2.erode(smooth, around)
    edges = height >= max(_LEAST_EDGE, 0.5 * float(np.quantile(height, 0.999)))
    steepest = np.quantile(steep[edges] / height[edges], 0.99) if edges.any() else 0.0
    if not edges.any() or steepest <= 0:
        return None
    # The smoothing's own blur comes off.
    return float(np.sqrt(max((1 / (2.507 * steepest)) ** 2 - 1.2, 0.0)))
