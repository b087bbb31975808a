"""OpenCV's boards, markers and camera calibration, with the types and shapes the package relies on."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Int64s

_CORNER_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-4)
_SOLVE_STEPS = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
_PLAIN_CHESSBOARD = cv2.CALIB_CB_NORMALIZE_IMAGE

_REFINING_BLUR = 1 / 7
"""Blur before refining, as a share of half its window: it halves what pixel raster and noise do (0.028 to 0.012 px)."""


@cache
def known_dictionaries() -> tuple[str, ...]:
    """Names of the predefined ArUco dictionaries."""
    return tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))


@cache
def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


def dictionary_size(name: str) -> int:
    """Marks in a dictionary."""
    return len(_dictionary(name).bytesList)


def marker_bits(name: str, number: int) -> Bools:
    """True where a mark is white, its black border of one cell included, shape (cells, cells), row 0 at the top."""
    dictionary = _dictionary(name)
    cells = dictionary.markerSize + 2
    return np.asarray(cv2.aruco.generateImageMarker(dictionary, number, cells)) > 127


class FoundMarks(NamedTuple):
    """ArUco marks: ids, shape (N,), and corners, shape (N, 4, 2), pixels."""

    ids: Int64s
    corners_px: Float64s


class FoundCharuco(NamedTuple):
    """Inner corners by number, shape (N,) and (N, 2), and the marks they were found by."""

    ids: Int64s
    corners_px: Float64s
    marks: FoundMarks


def find_marks(picture: Bytes, dictionary: str) -> FoundMarks:
    """All marks of a dictionary in a grey picture, corners to a fraction of a pixel."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(_dictionary(dictionary), parameters)
    corners, ids, _ = detector.detectMarkers(picture)
    return _marks(corners, ids)


def find_charuco(
    picture: Bytes, squares: tuple[int, int], square_mm: float, marker_mm: float, dictionary: str
) -> FoundCharuco:
    """Inner corners of a ChArUco board in a grey picture; every mark of the dictionary, the board's or not."""
    board = cv2.aruco.CharucoBoard(squares, square_mm, marker_mm, _dictionary(dictionary))
    parameters = cv2.aruco.DetectorParameters()
    marks, mark_ids, _ = cv2.aruco.ArucoDetector(_dictionary(dictionary), parameters).detectMarkers(picture)
    found = _marks(marks, mark_ids)
    own = found.ids < squares[0] * squares[1] // 2
    none = FoundCharuco(np.zeros(0, np.int64), np.zeros((0, 2)), found)
    if not own.any() or len(set(found.ids.tolist())) < len(found.ids):
        return none
    own_corners = [np.asarray(found.corners_px[i : i + 1], np.float32) for i in np.flatnonzero(own)]
    own_ids = np.asarray(found.ids[own], np.int32).reshape(-1, 1)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(
        picture, markerCorners=own_corners, markerIds=own_ids
    )
    if ids is None or len(ids) == 0:
        return none
    return FoundCharuco(np.asarray(ids, np.int64).ravel(), np.asarray(corners, np.float64).reshape(-1, 2), found)


def _marks(corners: Sequence[NDArray[np.generic]], ids: NDArray[np.generic] | None) -> FoundMarks:
    if ids is None or len(ids) == 0:
        return FoundMarks(np.zeros(0, np.int64), np.zeros((0, 4, 2)))
    return FoundMarks(np.asarray(ids, np.int64).ravel(), np.asarray(corners, np.float64).reshape(-1, 4, 2))


def find_chessboard(picture: Bytes, columns: int, rows: int) -> Float64s | None:
    """Inner corners of a whole chessboard in a grey picture, row by row in some order, shape (columns * rows, 2)."""
    done, corners = cv2.findChessboardCornersSB(picture, (columns, rows), flags=_PLAIN_CHESSBOARD)
    return np.asarray(corners, np.float64).reshape(-1, 2) if done else None


def chessboard_in_view(picture: Bytes) -> tuple[int, int] | None:
    """Inner corners each way of any chessboard of 3 x 3 or more that the picture shows, or None."""
    flags = _PLAIN_CHESSBOARD | cv2.CALIB_CB_LARGER
    done, _, meta = cv2.findChessboardCornersSBWithMeta(picture, (3, 3), flags)
    return (int(meta.shape[1]), int(meta.shape[0])) if done else None


def refined_corners(picture: Bytes, corners_px: Float64s, half_window_px: int) -> Float64s:
    """Saddle points to a fraction of a pixel, by the gradients around them (Förstner), shape (N, 2)."""
    corners = np.ascontiguousarray(corners_px, np.float32).reshape(-1, 1, 2)
    size = (half_window_px, half_window_px)
    sigma = min(half_window_px * _REFINING_BLUR, 2.0)
    found = cv2.cornerSubPix(cv2.GaussianBlur(picture, (0, 0), sigma), corners.copy(), size, (-1, -1), _CORNER_STEPS)
    return np.asarray(found, np.float64).reshape(-1, 2)


def homography(source: Float64s, target: Float64s, threshold: float = 0.0) -> tuple[Float64s, Bools] | None:
    """The homography that takes source to target, by RANSAC where there is a threshold, and who fits; or None."""
    method = cv2.RANSAC if threshold > 0 else 0
    matrix, mask = cv2.findHomography(source, target, method, max(threshold, 1.0))
    if matrix is None or not np.isfinite(matrix).all():
        return None
    return np.asarray(matrix, np.float64), np.asarray(mask).ravel().astype(bool)


def mapped(matrix: Float64s, points: Float64s) -> Float64s:
    """Points through a homography, shape (N, 2)."""
    lifted = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(lifted[:, :2] / lifted[:, 2:])


def sampled(picture: Bytes, points_px: Float64s) -> Float32s:
    """Grey levels at points of any shape (…, 2), linear between pixels."""
    flat = points_px.reshape(-1, 2).astype(np.float32)
    # remap takes maps of up to 32767 rows only: lay the points out as a square.
    side = max(int(np.ceil(np.sqrt(len(flat)))), 1)
    padded = np.zeros((side * side, 2), np.float32)
    padded[: len(flat)] = flat
    maps = padded.reshape(side, side, 2)
    levels = cv2.remap(
        picture.astype(np.float32), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(levels, np.float32).ravel()[: len(flat)].reshape(points_px.shape[:-1])


class Solved(NamedTuple):
    """OpenCV's camera: matrix (3, 3), distortion (K,), and a pose for each view, (V, 3) and (V, 3)."""

    camera_matrix: Float64s
    distortion: Float64s
    rotations: Float64s
    translations: Float64s


def solve_camera(
    points: Sequence[Float64s],
    pixels: Sequence[Float64s],
    size: tuple[int, int],
    flags: int,
    guess: tuple[Float64s, Float64s] | None,
) -> Solved | None:
    """The camera of least reprojection error over all views; points (N, 3) and pixels (N, 2) a view; None: no way."""
    start, lens = (np.eye(3), np.zeros(14)) if guess is None else (guess[0].copy(), guess[1].copy())
    if guess is not None:
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
    objects = [np.ascontiguousarray(one, np.float32).reshape(-1, 1, 3) for one in points]
    images = [np.ascontiguousarray(one, np.float32).reshape(-1, 1, 2) for one in pixels]
    try:
        _, matrix, distortion, rotations, translations = cv2.calibrateCamera(
            objects, images, size, start, lens, flags=flags, criteria=_SOLVE_STEPS
        )
    except cv2.error:
        return None
    solved = Solved(
        np.asarray(matrix, np.float64),
        np.asarray(distortion, np.float64).ravel(),
        np.asarray(rotations, np.float64).reshape(-1, 3),
        np.asarray(translations, np.float64).reshape(-1, 3),
    )
    return solved if all(np.isfinite(part).all() for part in solved) else None


def solve_pose(
    points: Float64s, pixels: Float64s, camera_matrix: Float64s, distortion: Float64s
) -> tuple[Float64s, Float64s]:
    """Rotation vector and translation of a board before a known camera, (3,) and (3,), refined."""
    objects = np.ascontiguousarray(points, np.float64).reshape(-1, 1, 3)
    images = np.ascontiguousarray(pixels, np.float64).reshape(-1, 1, 2)
    _, rotation, translation = cv2.solvePnP(objects, images, camera_matrix, distortion, flags=cv2.SOLVEPNP_IPPE)
    rotation, translation = cv2.solvePnPRefineLM(objects, images, camera_matrix, distortion, rotation, translation)
    return np.asarray(rotation, np.float64).ravel(), np.asarray(translation, np.float64).ravel()


def projection_jacobian(
    points: Float64s, rotation: Float64s, translation: Float64s, camera_matrix: Float64s, distortion: Float64s
) -> tuple[Float64s, Float64s]:
    """Pixels (N, 2) of points (N, 3), and their derivatives (2 N, 10 + K).

    Columns: rotation vector 3, translation 3, fx, fy, cx, cy, then the distortion coefficients.
    """
    objects = np.ascontiguousarray(points, np.float64).reshape(-1, 1, 3)
    pixels, jacobian = cv2.projectPoints(objects, rotation, translation, camera_matrix, distortion)
    return np.asarray(pixels, np.float64).reshape(-1, 2), np.asarray(jacobian, np.float64)


def convex_hull(points: Float64s) -> Float64s:
    """The convex hull of points, shape (M, 2), in order around it."""
    hull = cv2.convexHull(np.ascontiguousarray(points, np.float32))
    return np.asarray(hull, np.float64).reshape(-1, 2)


def inside_ring(ring: Float64s, points: Float64s) -> Bools:
    """True for each point inside a ring or on it, shape (N,)."""
    outline = np.ascontiguousarray(ring, np.float32).reshape(-1, 1, 2)
    return np.array([cv2.pointPolygonTest(outline, (float(x), float(y)), False) >= 0 for x, y in points], np.bool_)
