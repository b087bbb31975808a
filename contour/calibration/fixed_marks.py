"""Fixed marks beside the table: where the calibration saw them, where a frame shows them, and how far apart that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.errors import CalibrationError
from contour.geometry.arrays import Bytes, Float64s
from contour.image.opencv import grey, shrunk
from contour.image.opencv_boards import find_marks, known_dictionaries, refined_corners
from contour.image.pixel_grid import pixels_of

REACH_SIDES, REACH_PX = 0.75, 30.0
"""A mark is searched this far around its place, 30 px at least. What was knocked farther is found by a search of the
whole picture. With less than 0.6 sides around it the finder misses a mark that has not moved."""

SEARCHED_SIDE_PX = 40
"""Marks are recognised at about this size (an ArUco cell is then 5 to 7 px wide) and measured at full size: with marks
of 160 px at 12 MP a look takes 2 ms instead of 13."""


@dataclass(frozen=True, eq=False)
class Mark:
    """An ArUco mark: its id, and the pixels of its corners as its dictionary orders them, shape (4, 2)."""

    id: int
    corners_px: Float64s

    def __post_init__(self) -> None:
        corners = np.array(self.corners_px, dtype=np.float64)
        if corners.shape != (4, 2) or not np.isfinite(corners).all():
            raise CalibrationError(f"Mark {self.id} has corners of shape {corners.shape}, expected (4, 2), all finite.")
        corners.flags.writeable = False
        object.__setattr__(self, "corners_px", corners)

    @property
    def middle_px(self) -> Float64s:
        """The mean of its corners, shape (2,)."""
        return np.asarray(self.corners_px.mean(axis=0))

    @property
    def side_px(self) -> float:
        """The mean length of its sides."""
        return float(np.linalg.norm(self.corners_px - np.roll(self.corners_px, 1, axis=0), axis=1).mean())


@dataclass(frozen=True)
class Sentinels:
    """The marks of one dictionary (DICT_5X5_250, …) that the calibration saw, each id once."""

    dictionary: str
    marks: tuple[Mark, ...]

    def __post_init__(self) -> None:
        ids = [mark.id for mark in self.marks]
        if not ids or len(set(ids)) != len(ids):
            raise CalibrationError(f"Sentinels {ids}: expected one or more marks, each id once.")
        if self.dictionary not in known_dictionaries():
            known = ", ".join(known_dictionaries())
            raise CalibrationError(f"Sentinels of dictionary {self.dictionary!r}: expected one of {known}.")


@dataclass(frozen=True)
class Offset:
    """How far a mark lies from where the calibration saw it: its middle, pixels."""

    id: int
    middle_px: tuple[float, float]

    @property
    def distance_px(self) -> float:
        """How far its middle has moved."""
        return float(np.hypot(*self.middle_px))


@dataclass(frozen=True)
class SentinelCheck:
    """The marks that were found, with their offsets, and the ids of those that were not."""

    offsets: tuple[Offset, ...]
    missing: tuple[int, ...]

    @property
    def largest_px(self) -> float | None:
        """The largest offset of a mark's middle, None where no mark was found."""
        return max((offset.distance_px for offset in self.offsets), default=None)

    def __str__(self) -> str:
        parts = [f"mark {one.id} by {one.distance_px:.2f} px" for one in self.offsets]
        parts += [f"mark {number} not seen" for number in self.missing]
        return ", ".join(parts)


def see_sentinels(picture: Bytes, dictionary: str, *, without: range = range(0)) -> Sentinels | None:
    """The marks of a dictionary in a picture, or None; without a board's own ids (`without`) and any seen twice."""
    found = find_marks(grey(picture), dictionary)
    numbers, counts = np.unique(found.ids, return_counts=True)
    single = set(numbers[counts == 1].tolist()) - set(without)
    rough = [Mark(int(n), c) for n, c in zip(found.ids, found.corners_px, strict=True) if int(n) in single]
    # Measured as each frame will be: what one way of measuring is off by then drops out of the comparison.
    marks = [_around(picture, mark, dictionary) or mark for mark in rough]
    return Sentinels(dictionary, tuple(sorted(marks, key=lambda mark: mark.id))) if marks else None


def check_sentinels(picture: Bytes, sentinels: Sentinels) -> SentinelCheck:
    """Where the marks are now, (H, W) grey or (H, W, 3) BGR: searched around their places, a few milliseconds.

    Where none is found there, the whole picture is searched: a camera that was knocked far shows them elsewhere.
    """
    found = {mark.id: seen for mark in sentinels.marks if (seen := _around(picture, mark, sentinels.dictionary))}
    if not found:
        everywhere = see_sentinels(picture, sentinels.dictionary)
        found = {mark.id: mark for mark in everywhere.marks} if everywhere else {}
    offsets = tuple(_offset(mark, found[mark.id]) for mark in sentinels.marks if mark.id in found)
    return SentinelCheck(offsets, tuple(mark.id for mark in sentinels.marks if mark.id not in found))


def _around(picture: Bytes, mark: Mark, dictionary: str) -> Mark | None:
    """The mark in the window around its place, or None."""
    reach = max(REACH_SIDES * mark.side_px, REACH_PX)
    height, width = picture.shape[:2]
    left, top = np.clip(np.floor(mark.corners_px.min(axis=0) - reach), 0, [width, height]).astype(int)
    right, bottom = np.clip(np.ceil(mark.corners_px.max(axis=0) + reach) + 1, 0, [width, height]).astype(int)
    if right - left < 8 or bottom - top < 8:
        return None
    factor = max(int(mark.side_px / SEARCHED_SIDE_PX), 1)
    bottom, right = bottom - (bottom - top) % factor, right - (right - left) % factor
    window = grey(np.ascontiguousarray(picture[top:bottom, left:right]))
    found = find_marks(shrunk(window, factor), dictionary)
    same = np.flatnonzero(found.ids == mark.id)
    if len(same) != 1:
        return None
    corners = pixels_of(found.corners_px[same[0]], factor)
    fine = refined_corners(window, corners, int(np.clip(mark.side_px / 16, 2, 8)))
    return Mark(mark.id, fine + np.array([left, top]))


def _offset(was: Mark, now: Mark) -> Offset:
    x, y = (now.middle_px - was.middle_px).tolist()
    return Offset(was.id, (x, y))
