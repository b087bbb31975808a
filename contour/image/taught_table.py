"""The empty table as it was taught: its light and its pattern, to tell a block from it and to notice a change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from contour.errors import CalibrationError, PictureError
from contour.geometry.arrays import Bytes, Float32s, median, medians
from contour.image.line_noise import without_line_noise

_CELL_PX = 16
_RIM_CELLS = 2
_RIM_SHARE = 0.03
# Apart by this share of the table's light, or by so many levels, or so many deviations of the noise, is not the table.
_APART_SHARE = 0.15
_APART_LEVELS = 6.0
_APART_NOISES = 5.0
# Small squares of which so much differs hold more than noise.
_SMALL_PX = 4
_CHANGED_SHARE = 0.2
_TILE_PX = 128
_TILES = 8
_SURE_RESPONSE = 0.12
_AGREE_PX = 0.75
_STILL_PX = 0.1
# Of one cell between the pictures that are averaged, in grey levels above their noise.
_UNREST = 4.0


@dataclass(frozen=True, eq=False)
class TaughtTable:
    """A picture of the empty table, (H, W) grey or (H, W, 3) BGR, uint8, and the noise of one pixel of one picture."""

    picture: Bytes
    noise: float

    @cached_property
    def pattern(self) -> Bytes:
        """What takes the pattern out when it is added to the picture: light without pattern − picture + 128."""
        rough = cv2.medianBlur(np.rint(_cells(self.picture)).astype(np.uint8), 5)
        height, width = self.picture.shape[:2]
        smooth = cv2.resize(cv2.GaussianBlur(rough, (0, 0), 1.5), (width, height), interpolation=cv2.INTER_LINEAR)
        return np.asarray(cv2.addWeighted(smooth, 1.0, self.picture, -1.0, 128.0), np.uint8)

    @cached_property
    def landmarks(self) -> tuple[tuple[int, int], ...]:
        """Corners (x, y) of the tiles with most of the pattern in them, apart from each other."""
        light = _grey(self.picture)
        rough = cv2.absdiff(light, cv2.GaussianBlur(light, (0, 0), 6.0))
        size = (light.shape[1] // _TILE_PX, light.shape[0] // _TILE_PX)
        if min(size) == 0:
            return ()
        busy = cv2.resize(rough[: size[1] * _TILE_PX, : size[0] * _TILE_PX], size, interpolation=cv2.INTER_AREA)
        order = np.argsort(-busy.ravel().astype(int), kind="stable")[:_TILES]
        return tuple((int(place % size[0]) * _TILE_PX, int(place // size[0]) * _TILE_PX) for place in order)


@dataclass(frozen=True)
class TableLimits:
    """How far the table may look otherwise than it was taught."""

    gain: tuple[float, float] = (0.6, 1.6)
    max_shift_px: float = 3.0
    min_rim_share: float = 0.5


@dataclass(frozen=True, eq=False)
class TableLook:
    """A picture compared with the taught table.

    `picture` is the picture without the table's pattern; `known` the taught table where it lies now; `gain` the light
    of the table now over what it was; `shift_px` how far the pattern has moved, None where no pattern shows;
    `rim_share` of the picture's rim that looks as taught; `changed_share` of the picture that does not.
    """

    picture: Bytes
    known: Bytes
    gain: float
    shift_px: float | None
    rim_share: float
    changed_share: float


def teach(pictures: Sequence[Bytes]) -> TaughtTable:
    """The table in pictures of the empty table, averaged.

    Raises PictureError where there is none, they differ in size, or something moved between them.
    """
    if not pictures:
        raise PictureError("There is no picture to teach the table from: expected one or more. Take some.")
    shapes = {picture.shape for picture in pictures}
    if len(shapes) > 1:
        kinds = ", ".join(sorted({_kind(picture) for picture in pictures}))
        raise PictureError(f"The pictures differ: {kinds}; expected one size and kind. Do not change the camera.")
    pictures = [without_line_noise(picture) for picture in pictures]
    total = np.zeros(pictures[0].shape, np.float32)
    for picture in pictures:
        total += picture
    mean = np.clip(np.rint(total / len(pictures)), 0, 255).astype(np.uint8)
    spread = np.std([_fine(picture) for picture in pictures], axis=0, ddof=1 if pictures[1:] else 0)
    noise = max(median(spread), 0.5)
    unrest = max(float(np.abs(_cells(picture) - _cells(mean)).max()) for picture in pictures)
    if unrest > _UNREST + noise:
        raise PictureError(
            f"Part of the table changed by {unrest:.0f} grey levels while it was taught, at most {_UNREST + noise:.0f} "
            "are allowed. Keep hands and shadows away, let the light settle, and teach it again."
        )
    return TaughtTable(mean, noise)


def look_at(picture: Bytes, table: TaughtTable) -> TableLook:
    """The picture compared with the taught table. Raises CalibrationError where they differ in size or colour."""
    if picture.shape != table.picture.shape:
        raise CalibrationError(
            f"The picture is {_kind(picture)}, the table was taught with {_kind(table.picture)}. Set the camera to "
            "that, or teach the table again."
        )
    shift = _shift(picture, table)
    still = shift is None or np.hypot(*shift) <= _STILL_PX
    known, pattern = table.picture, table.pattern
    if shift is not None and not still:
        known, pattern = _moved(known, shift), _moved(pattern, shift)
    gain, over, changed = _changed(picture, known, table.noise)
    margin = max(2, round(_RIM_SHARE * min(changed.shape)))
    rim = np.ones(changed.shape, np.bool_)
    rim[margin:-margin, margin:-margin] = False
    plain = np.asarray(cv2.addWeighted(picture, 1.0, pattern, gain, -128.0 * gain), np.uint8)
    # What differs stays as it is, to the pixel: half a line of the pattern beside a wall would pass for a wall.
    things = cv2.dilate(over, np.ones((3, 3), np.uint8))
    size = (picture.shape[1], picture.shape[0])
    cv2.copyTo(picture, cv2.resize(things, size, interpolation=cv2.INTER_NEAREST), plain)
    return TableLook(
        picture=plain,
        known=known,
        gain=gain,
        shift_px=None if shift is None else float(np.hypot(*shift)),
        rim_share=float(1 - changed[rim].mean()),
        changed_share=float(changed.mean()),
    )


def _changed(picture: Bytes, known: Bytes, noise: float) -> tuple[float, Bytes, Bytes]:
    """The light now over what it was; samples that are not the table's, 255 or 0; small squares of which a part is not,
    1 or 0.
    """
    now, then = _cells(picture), _cells(known)
    ratio = (now + 1.0) / (then + 1.0)
    rim = np.ones(now.shape[:2], np.bool_)
    rim[_RIM_CELLS:-_RIM_CELLS, _RIM_CELLS:-_RIM_CELLS] = False
    gain = median(ratio[rim])
    off = np.abs(now - gain * then) - _APART_SHARE * gain * then
    alike = off.reshape(*rim.shape, -1).max(axis=2) < _APART_LEVELS
    if np.count_nonzero(alike) > 0.2 * alike.size:
        gain = median(ratio[alike])
    hop = max(1, round(np.sqrt(picture.shape[0] * picture.shape[1] / 1.5e6)))
    here, there = picture[::hop, ::hop], cv2.convertScaleAbs(known[::hop, ::hop], alpha=gain)
    apart = cv2.absdiff(here, there)
    bound = cv2.convertScaleAbs(there, alpha=_APART_SHARE, beta=max(_APART_LEVELS, _APART_NOISES * noise))
    over = cv2.compare(apart, bound, cv2.CMP_GT).reshape(*here.shape[:2], -1).max(axis=2)
    size = (max(5, over.shape[1] // _SMALL_PX), max(5, over.shape[0] // _SMALL_PX))
    share = cv2.resize(over, size, interpolation=cv2.INTER_AREA)
    return gain, over, (share > 255 * _CHANGED_SHARE).astype(np.uint8)


def _shift(picture: Bytes, table: TaughtTable) -> tuple[float, float] | None:
    """How far (x, y) the table's pattern has moved, pixels; None where it does not show in several places alike."""
    window = cv2.createHanningWindow((_TILE_PX, _TILE_PX), cv2.CV_32F)
    found = []
    for x, y in table.landmarks:
        tiles = [
            _grey(part[y : y + _TILE_PX, x : x + _TILE_PX]).astype(np.float32) for part in (table.picture, picture)
        ]
        high = [tile - cv2.GaussianBlur(tile, (0, 0), 6.0) for tile in tiles]
        moved, response = cv2.phaseCorrelate(high[0], high[1], window)
        if response > _SURE_RESPONSE:
            found.append(moved)
    if len(found) < 2:
        return None
    middle = medians(np.array(found), axis=0)
    if np.count_nonzero(np.abs(np.array(found) - middle).max(axis=1) < _AGREE_PX) < max(2, 0.6 * len(found)):
        return None
    return float(middle[0]), float(middle[1])


def _moved(picture: Bytes, shift: tuple[float, float]) -> Bytes:
    move = np.array([[1.0, 0.0, shift[0]], [0.0, 1.0, shift[1]]])
    size = (picture.shape[1], picture.shape[0])
    return np.asarray(cv2.warpAffine(picture, move, size, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def _cells(picture: Bytes) -> Float32s:
    """Means over squares of the picture, (h, w) or (h, w, 3)."""
    size = (max(5, picture.shape[1] // _CELL_PX), max(5, picture.shape[0] // _CELL_PX))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.float32)


def _fine(picture: Bytes) -> Float32s:
    """Some of the pixels, less the light around them: light that changes is no noise."""
    every = (slice(None, None, 7), slice(None, None, 7))
    height, width = picture.shape[:2]
    around = cv2.resize(_cells(picture), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(picture[every].astype(np.float32) - around[every], np.float32)


def _grey(picture: Bytes) -> Bytes:
    return picture if picture.ndim == 2 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)


def _kind(picture: Bytes) -> str:
    return f"{picture.shape[1]} x {picture.shape[0]} px {'grey' if picture.ndim == 2 else 'in colour'}"
