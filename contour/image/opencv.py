"""OpenCV calls with the types and shapes the package relies on; the one place that knows the gaps in its stubs."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Indices, Int32s, Int64s

Anything = TypeVar("Anything", Bytes, NDArray[np.uint16], Float32s)

_SAMPLED, _MOST_OTHERS = 8, 8192
"""The largest piece is told from every so many rows and columns; so many pixels of others are gathered one by one."""

_LARGEST_DISC = 9.0
"""Pixels: larger discs take longer than distances."""

_LENS_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
"""undistortPoints stops after 5 steps by itself, which leaves tenths of a pixel in the corners of wide lenses."""


def rotation_matrix(rotation_vector: Float64s) -> Float64s:
    """Rotation matrix (3, 3) of a Rodrigues vector."""
    return np.asarray(cv2.Rodrigues(np.asarray(rotation_vector, np.float64).reshape(3, 1))[0], np.float64)


def camera_rays(points_px: Float64s, camera_matrix: Float64s, distortion: Float64s) -> Float64s:
    """Directions in the camera frame with z = 1, shape (N, 3), that the lens maps to the pixels."""
    if len(points_px) == 0:
        return np.zeros((0, 3))
    source = np.ascontiguousarray(points_px, np.float64).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(source, camera_matrix, distortion, criteria=_LENS_STEPS)
    return np.column_stack([np.asarray(rays, np.float64).reshape(-1, 2), np.ones(len(points_px))])


def project(
    points: Float64s, rotation: Float64s, translation: Float64s, camera_matrix: Float64s, distortion: Float64s
) -> Float64s:
    """Pixels, shape (N, 2), of points in space, shape (N, 3)."""
    if len(points) == 0:
        return np.zeros((0, 2))
    source = np.ascontiguousarray(points, np.float64).reshape(-1, 1, 3)
    pixels, _ = cv2.projectPoints(source, rotation, translation, camera_matrix, distortion)
    return np.asarray(pixels, np.float64).reshape(-1, 2)


class FoundContours(NamedTuple):
    """Rings through pixel centres, each (N, 2) int32, and for each its parent's index, -1 for an outer one."""

    rings: list[Int32s]
    parents: Int32s


def outer_contours(mask: Bytes) -> list[Int32s]:
    """The outer contours of the white components, all their points."""
    found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return [cast(Int32s, ring).reshape(-1, 2) for ring in found]


def contours_in_two_levels(mask: Bytes) -> FoundContours:
    """Outer contours of the white components and inner contours around their holes, all their points."""
    found, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    rings = [cast(Int32s, ring).reshape(-1, 2) for ring in found]
    parents = np.asarray(hierarchy, np.int32).reshape(-1, 4)[:, 3] if rings else np.zeros(0, np.int32)
    return FoundContours(rings, parents)


def enclosed_area(ring: Int32s) -> float:
    """Area within a pixel ring, px²."""
    return float(cv2.contourArea(ring))


def integral(picture: Bytes) -> Int32s:
    """Sums of all pixels above and left, shape (H + 1, W + 1)."""
    return cast(Int32s, cv2.integral(picture, sdepth=cv2.CV_32S))


def box_mean(picture: Anything, size: int) -> Anything:
    """Mean over the square of `size` px around each pixel, same type; the border pixel goes on beyond the picture."""
    return cast(Anything, cv2.blur(picture, (size, size), borderType=cv2.BORDER_REPLICATE))


def gaussian(picture: Bytes) -> Bytes:
    """The picture under a 3 x 3 binomial blur (sigma 0.85 px)."""
    return cast(Bytes, cv2.GaussianBlur(picture, (3, 3), 0))


def shrunk(picture: Anything, factor: int) -> Anything:
    """Means over squares of `factor` px, same type; the picture itself for factor 1."""
    if factor == 1:
        return picture
    height, width = picture.shape
    return shrunk_to(picture, (max(height // factor, 1), max(width // factor, 1)))


def shrunk_to(picture: Anything, shape: tuple[int, ...]) -> Anything:
    """Means over the parts of the picture that the pixels of the smaller shape (H, W) cover, same type."""
    if picture.shape == shape:
        return picture
    return cast(Anything, cv2.resize(picture, (shape[1], shape[0]), interpolation=cv2.INTER_AREA))


def grown(picture: Anything, shape: tuple[int, ...]) -> Anything:
    """The picture at another shape (H, W), linear between its pixels."""
    if picture.shape == shape:
        return picture
    return cast(Anything, cv2.resize(picture, (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR))


def sized(picture: Anything, shape: tuple[int, ...]) -> Anything:
    """The picture at another shape (H, W), shrunk or grown by its number of pixels."""
    return (grown if np.prod(shape) > picture.size else shrunk_to)(picture, shape)


def enlarged(picture: Anything, times: int) -> Anything:
    """The picture so many times as large, (times · H, times · W), its edges as sharp as they were."""
    return cast(Anything, cv2.resize(picture, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC))


def slid(large: Float32s, small: Float32s) -> Float64s:
    """Sums of products of a small array with the large one, at all places at which it lies within it."""
    return np.asarray(cv2.matchTemplate(large, small, cv2.TM_CCORR), np.float64)


def as_float32(picture: NDArray[np.uint16]) -> Float32s:
    """The picture with 32-bit floats."""
    return picture.astype(np.float32)


def subtracted(a: Bytes, b: Bytes) -> Bytes:
    """a - b, 0 where b is larger."""
    return cast(Bytes, cv2.subtract(a, b))


def inverted(picture: Bytes) -> Bytes:
    """255 less the picture."""
    return cast(Bytes, cv2.bitwise_not(picture))


def either(a: Bytes, b: Bytes) -> Bytes:
    """Bits that are set in a or in b."""
    return cast(Bytes, cv2.bitwise_or(a, b))


def exceeding(picture: Bytes, bound: Bytes) -> Bytes:
    """255 where the picture is greater than the bound, else 0."""
    return cast(Bytes, cv2.compare(picture, bound, cv2.CMP_GT))


def looked_up(picture: Bytes, table: Anything) -> Anything:
    """table[picture], in the table's type; shape (256,)."""
    return cast(Anything, cv2.LUT(picture, table))


def levels(picture: Bytes) -> Int64s:
    """Pixels at each of the 256 levels."""
    return np.asarray(cv2.calcHist([picture], [0], None, [256], [0, 256]), np.int64).ravel()


def grey(picture: Bytes) -> Bytes:
    """Grey levels of a BGR picture; a grey one is handed through."""
    return picture if picture.ndim == 2 else cast(Bytes, cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY))


def otsu_threshold(picture: Bytes) -> float:
    """Otsu's threshold (1979) of a grey picture."""
    return float(cv2.threshold(picture, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)[0])


def above(picture: Bytes, threshold: float) -> Bytes:
    """255 where the picture is greater than the threshold, else 0."""
    return cast(Bytes, cv2.threshold(picture, threshold, 255, cv2.THRESH_BINARY)[1])


def pieces_of(mask: Bytes | Bools, connectivity: int) -> tuple[int, Int32s]:
    """How many white pieces a mask has, black counted as one, and the number of each pixel's, (H, W), 0 on black."""
    count, labels = cv2.connectedComponents(mask.view(np.uint8), connectivity=connectivity)
    return count, np.asarray(labels, np.int32)


def pieces_and_areas(mask: Bytes, connectivity: int) -> tuple[Int32s, Int64s]:
    """The number of each pixel's white piece, (H, W), 0 on black, and the area of each, (N,), 0 for black: of what
    connectedComponentsWithStats tells this is had in a third of the time.
    """
    return pieces_and_lesser(mask, connectivity)[:2]


def pieces_and_lesser(mask: Bytes, connectivity: int) -> tuple[Int32s, Int64s, Indices]:
    """As `pieces_and_areas`, and the places in the flat mask of all but the one piece that most of it seems to be,
    (M,).
    """
    count, pieces, main, others = _pieces(mask, connectivity)
    area = np.bincount(pieces.ravel().take(others), minlength=count)
    area[main] = cv2.countNonZero(mask) - len(others)
    return pieces, area, others


def pieces_and_boxes(mask: Bytes, connectivity: int) -> tuple[Int32s, Int32s]:
    """What connectedComponentsWithStats tells of a mask, in half the time where most of it is one piece: the number of
    each pixel's white piece, (H, W), and left, top, width, height and area of each, (N, 5), 0 for black.
    """
    count, pieces, main, others = _pieces(mask, connectivity)
    if len(others) > _MOST_OTHERS:
        return pieces, _boxes_and_middles(mask, count, pieces)[0]
    stats = np.zeros((count, 5), np.int32)
    number, (rows, columns) = pieces.ravel().take(others), np.divmod(others, mask.shape[1])
    first, last = np.full((2, count), np.iinfo(np.int32).max), np.full((2, count), -1)
    for axis, places in enumerate((columns, rows)):
        np.minimum.at(first[axis], number, places)
        np.maximum.at(last[axis], number, places)
    stats[1:, :2], stats[1:, 2:4] = first[:, 1:].T, (last - first + 1)[:, 1:].T
    stats[:, 4] = np.bincount(number, minlength=count)
    if main:
        stats[main, :4] = cv2.boundingRect((pieces == main).view(np.uint8))
        stats[main, 4] = cv2.countNonZero(mask) - len(others)
    return pieces, stats


def pieces_and_middles(mask: Bytes, connectivity: int) -> tuple[Int32s, Int32s, Float64s]:
    """As `pieces_and_boxes`, and the mean place (x, y) of each, (N, 2), 0 for black: where many are alike in size what
    connectedComponentsWithStats tells is had in two thirds of its time.
    """
    count, pieces = pieces_of(mask, connectivity)
    return pieces, *_boxes_and_middles(mask, count, pieces)


def _boxes_and_middles(mask: Bytes, count: int, pieces: Int32s) -> tuple[Int32s, Float64s]:
    """Left, top, width, height and area of `count` numbered pieces, (N, 5), and their mean places, (N, 2), 0 for black,
    by their runs along rows.
    """
    wide = mask.shape[1] + 2  # black on both sides, or a run would go on in the next row
    along = np.asarray(cv2.copyMakeBorder(mask, 0, 0, 1, 1, cv2.BORDER_CONSTANT), np.uint8).ravel()
    ends = np.flatnonzero(along[1:] != along[:-1])
    (rows, left), size = np.divmod(ends[::2], wide), ends[1::2] - ends[::2]
    number = pieces[rows, left]
    area = np.bincount(number, size, count)
    middles = [np.bincount(number, size * mean, count) for mean in (left + 0.5 * (size - 1), rows)]
    first, behind = np.full((2, count), np.iinfo(np.int32).max), np.zeros((2, count), np.int64)
    np.minimum.at(first[0], number, left)
    np.maximum.at(behind[0], number, left + size)
    first[1, number[::-1]], behind[1, number] = rows[::-1], rows + 1  # rows rise: the last that is put down stays
    stats = np.zeros((count, 5), np.int32)
    stats[1:, :2], stats[1:, 2:4], stats[:, 4] = first[:, 1:].T, (behind - first)[:, 1:].T, area
    return stats, np.column_stack(middles) / np.maximum(area, 1.0)[:, None]


def _pieces(mask: Bytes, connectivity: int) -> tuple[int, Int32s, int, Indices]:
    """How many white pieces a mask of 0 and 1, or 255, has, black counted as one, each pixel's, (H, W), the one that
    most of it seems to be, and the places of all others, (M,), in the flat mask.
    """
    count, pieces = pieces_of(mask, connectivity)
    seen = np.bincount(pieces[::_SAMPLED, ::_SAMPLED].ravel(), minlength=count)
    main = 1 + int(seen[1:].argmax()) if count > 1 else 0
    others = cv2.bitwise_and(mask, (pieces != main).view(np.uint8))  # 1 where it is 1 or 255
    return count, pieces, main, np.flatnonzero(others.view(np.bool_))


def median_where(picture: Bytes, where: Bytes | Bools) -> float:
    """The median of the pixels, (H, W), where a mask is not 0, at one of them at least: told from their counts."""
    counts = cv2.calcHist([picture], [0], where.view(np.uint8), [256], [0, 256])
    reached = np.cumsum(np.asarray(counts, np.int64).ravel())
    middle = np.searchsorted(reached, [(reached[-1] - 1) // 2, reached[-1] // 2], side="right")
    return 0.5 * float(middle.sum())


def region_boxes_and_areas(mask: Bytes) -> tuple[Int32s, Int32s]:
    """Boxes (left, top, width, height), shape (N, 4), and areas, shape (N,), of the black regions, joined by edges."""
    _, _, stats, _ = cv2.connectedComponentsWithStats(cv2.bitwise_not(mask), connectivity=4, ltype=cv2.CV_32S)
    table = np.asarray(stats, np.int32)[1:]
    return table[:, :4], table[:, cv2.CC_STAT_AREA]


def within(mask: Bytes | Bools, radius: float, neighbours: int = 3) -> Bytes:
    """1 where a one of a mask of 0 and 1, (H, W), lies within the radius, pixels; nothing lies beyond its border.

    By the distances of cv2.distanceTransform over 3 or 5 `neighbours`: dilating with what these call a disc is the same
    to the pixel, in a sixth of the time.
    """
    part = mask.view(np.uint8)
    if radius > _LARGEST_DISC:
        return (cv2.distanceTransform(1 - part, cv2.DIST_L2, neighbours) <= radius).astype(np.uint8)
    return np.asarray(cv2.dilate(part, _disc(radius, neighbours)), np.uint8)


def deep(mask: Bytes | Bools, radius: float, neighbours: int = 3) -> Bytes:
    """1 where all zeros of a mask of 0 and 1, (H, W), lie farther than the radius; as `within`."""
    return np.asarray(1 - within(1 - mask.view(np.uint8), radius, neighbours), np.uint8)


@lru_cache(64)
def _disc(radius: float, neighbours: int) -> Bytes:
    point = np.ones((2 * int(radius) + 3,) * 2, np.uint8)
    point[int(radius) + 1, int(radius) + 1] = 0
    return (cv2.distanceTransform(point, cv2.DIST_L2, neighbours) <= radius).astype(np.uint8)


def opened(mask: Bytes, side: int) -> Bytes:
    """The picture, (H, W), without what is light and no square of so many pixels fits into."""
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((side, side), np.uint8)), np.uint8)


def closed_by_disc(mask: Bytes, radius: float) -> Bytes:
    """A mask of 0 and 1, (H, W), closed with a disc; nothing lies beyond its border."""
    pad = int(radius) + 2
    wide = np.asarray(cv2.copyMakeBorder(mask, pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0), np.uint8)
    closed = deep(within(wide, radius, 5), radius, 5)
    return np.asarray(closed[pad:-pad, pad:-pad] | mask, np.uint8)


def fewer_vertices(ring: Float64s, off: float) -> Float64s:
    """Vertices of a closed ring, (N, 2), between which the others lie within `off` of straight lines, (K, 2), in single
    precision (Douglas, Peucker 1973).
    """
    kept = cv2.approxPolyDP(ring.astype(np.float32)[:, None], off, True)
    return np.asarray(kept[:, 0], np.float64)


def bgr(picture: Bytes) -> Bytes:
    """A BGR copy of a grey or BGR picture."""
    return cast(Bytes, cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)) if picture.ndim == 2 else picture.copy()
