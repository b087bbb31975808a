"""A picture becomes a board view: which inner corners were seen, and where, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_sharpness import edge_sigma_px
from contour.errors import BoardNotSeen
from contour.geometry.arrays import Bools, Bytes, Float64s, Int64s
from contour.image import opencv_boards as cv
from contour.image.opencv import grey, shrunk

FEWEST_CORNERS = 12
"""A pose takes 6 numbers of these 24; with fewer corners a wrong one is not told from a right one."""

_LAYOUT_PX = 3.0
_LAYOUT_SHARE = 0.1
"""Markers lie on their plane to 3 px or a tenth of their side: lenses bend a board by less, another board by more."""

_MARKER_RATIO, _MARKER_BLUR_PX = 0.03, 1.0
"""A marker's corners are found to about half a pixel, inwards: more is another board, or a wrong --marker-mm."""

_SPACING_TO_HALVE_PX = 60.0
"""Squares wider than 30 px are still 15 px wide at half the size, where a second board is searched in a quarter."""


@dataclass(frozen=True, eq=False)
class BoardView:
    """What one picture shows of the board: corner numbers (N,), their pixels (N, 2), and how sharp it is.

    `edge_sigma_px` is the spread of its edges, as of a Gaussian blur.
    """

    name: str
    ids: Int64s
    pixels: Float64s
    edge_sigma_px: float

    def corners_mm(self, board: Board) -> Float64s:
        """The corners in the board frame, z = 0, shape (N, 3)."""
        return np.column_stack([board.corners_mm()[self.ids], np.zeros(len(self.ids))])


def find_board(picture: Bytes, board: Board, name: str = "") -> BoardView:
    """The view of the board in a picture, (H, W) grey or (H, W, 3) BGR; raise BoardNotSeen with the reason."""
    levels = grey(picture)
    ids, rough = _charuco(levels, board) if board.kind == "charuco" else _chessboard(levels, board)
    pixels = cv.refined_corners(levels, rough, _window_px(board, ids, rough))
    ids, pixels = _steady(ids, rough, pixels)
    _check_count(board, len(ids))
    return BoardView(name, ids, pixels, edge_sigma_px(levels, board, ids, pixels))


def _check_count(board: Board, seen: int) -> None:
    total = board.columns * board.rows
    least = min(FEWEST_CORNERS, total)
    if seen < least:
        raise BoardNotSeen(
            f"only {seen} of the board's {total} inner corners are seen, expected {least} or more: show more of the "
            "board, check its size, focus and light"
        )


# --- ChArUco ----------------------------------------------------------------------------------------------------------


def _charuco(levels: Bytes, board: Board) -> tuple[Int64s, Float64s]:
    squares = (board.squares_x, board.squares_y)
    found = cv.find_charuco(levels, squares, board.square_mm, board.marker_mm, board.dictionary)
    marks = found.marks
    if len(marks.ids) == 0:
        raise BoardNotSeen(_why_no_mark(levels, board))
    numbers, counts = np.unique(marks.ids, return_counts=True)
    if (counts > 1).any():
        twice = ", ".join(str(number) for number in numbers[counts > 1][:5])
        raise BoardNotSeen(f"marker {twice} is seen more than once: two boards are in view, expected one")
    own = marks.ids < board.marker_count
    if np.count_nonzero(~own) > max(1, len(own) // 10):
        alien = ", ".join(str(number) for number in marks.ids[~own][:5])
        raise BoardNotSeen(
            f"marker {alien} is not of a {board.name_of_size} board, which has 0 to {board.marker_count - 1}: it is "
            "another board, or --squares is wrong"
        )
    flat = _marker_plane(board, marks.ids[own], marks.corners_px[own])
    _check_count(board, len(found.ids))
    expected = cv.mapped(flat, board.corners_mm()[found.ids])
    side_px = np.linalg.norm(marks.corners_px[:, 0] - marks.corners_px[:, 1], axis=1).mean()
    bound = max(_LAYOUT_PX, 0.25 * float(side_px))
    near = np.linalg.norm(expected - found.corners_px, axis=1) <= bound
    ids, corners = found.ids[near], found.corners_px[near]
    _check_count(board, len(ids))
    _check_marker_ratio(board, ids, corners, marks, own)
    return ids, corners


def _why_no_mark(levels: Bytes, board: Board) -> str:
    mirrored = cv.find_marks(np.ascontiguousarray(levels[:, ::-1]), board.dictionary)
    if len(mirrored.ids) >= 3:
        return (
            "the picture is mirrored: its markers are found only when it is flipped. Switch the camera's mirror or "
            "flip off, or remove the mirror from the light path"
        )
    return (
        f"no marker of {board.dictionary} is seen: no board in view, another dictionary, or too dark, too small or "
        "blurred"
    )


def _marker_plane(board: Board, ids: Int64s, corners_px: Float64s) -> Float64s:
    """The homography from board millimetres to pixels by the markers; raise where they do not lie as on the board."""
    if len(ids) < 4:
        raise BoardNotSeen(f"only {len(ids)} of the board's {board.marker_count} markers are seen, expected 4 or more")
    places = board.marker_corners_mm()[ids].mean(axis=1)  # middles: a wrong marker size is told apart later
    side_px = float(np.linalg.norm(corners_px[:, 0] - corners_px[:, 1], axis=1).mean())
    fitted = cv.homography(places, corners_px.mean(axis=1), max(_LAYOUT_PX, _LAYOUT_SHARE * side_px))
    if fitted is None or fitted[1].mean() < 0.75:
        share = 0 if fitted is None else 100 * fitted[1].mean()
        raise BoardNotSeen(
            f"the markers do not lie as on a {board.name_of_size} board ({share:.0f} % fit): another board, --squares "
            "is wrong, or the board was drawn in OpenCV's pattern of before 4.6. Draw one with `combtrace board`"
        )
    return fitted[0]


def _check_marker_ratio(board: Board, ids: Int64s, corners_px: Float64s, marks: cv.FoundMarks, own: Bools) -> None:
    """Raise where markers are larger or smaller, against the squares, than the board's."""
    fitted = cv.homography(corners_px, board.corners_mm()[ids])
    if fitted is None:
        raise BoardNotSeen("the corners lie on one line: show more of the board")
    corners_mm = cv.mapped(fitted[0], marks.corners_px[own].reshape(-1, 2)).reshape(-1, 4, 2)
    sides = np.linalg.norm(corners_mm - np.roll(corners_mm, 1, axis=1), axis=2)
    seen = float(np.median(sides)) / board.square_mm
    stated = board.marker_mm / board.square_mm
    side_px = float(np.linalg.norm(marks.corners_px[:, 0] - marks.corners_px[:, 1], axis=1).mean())
    if abs(seen / stated - 1) > _MARKER_RATIO + _MARKER_BLUR_PX / side_px:
        raise BoardNotSeen(
            f"a marker's side is {seen:.3f} of a square's, --marker-mm {board.marker_mm:g} with --square-mm "
            f"{board.square_mm:g} say {stated:.3f}: one of the two is wrong, or it is another board"
        )


# --- chessboard -------------------------------------------------------------------------------------------------------


def _chessboard(levels: Bytes, board: Board) -> tuple[Int64s, Float64s]:
    corners = cv.find_chessboard(levels, board.columns, board.rows)
    if corners is None:
        raise BoardNotSeen(_why_no_chessboard(levels, board))
    corners = _oriented(levels, board, corners)
    _refuse_second(levels, board, corners)
    return np.arange(len(corners)), corners


def _why_no_chessboard(levels: Bytes, board: Board) -> str:
    seen = cv.chessboard_in_view(levels)
    if seen is None:
        return "no chessboard is seen: none in view, only part of it, or too dark, too small, blurred"
    columns, rows = seen[0] + 1, seen[1] + 1
    return (
        f"about {columns} x {rows} squares of a chessboard are seen, expected {board.name_of_size}: it is not "
        "wholly in view, or --squares (squares, not inner corners) is wrong"
    )


def _oriented(levels: Bytes, board: Board, corners: Float64s) -> Float64s:
    """The corners in the board's order: not mirrored, and the right way up by the squares' colours."""
    grid = corners.reshape(board.rows, board.columns, 2)
    orders = [grid, grid[::-1, ::-1]]
    if _turns_left(grid):  # seen from behind: the finder ran along the rows the other way
        orders = [grid[:, ::-1], grid[::-1]]
    contrasts = [_contrast(levels, board, order.reshape(-1, 2)) for order in orders]
    best = int(np.argmax(contrasts))
    if contrasts[best] <= 0 or min(contrasts) >= 0:
        raise BoardNotSeen("the colours of the squares do not tell which way up the chessboard lies: check the light")
    return orders[best].reshape(-1, 2)


def _turns_left(grid: Float64s) -> bool:
    """True where columns to the right and rows downwards make a left turn in the picture, whose y runs down."""
    right, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return bool(right[0] * down[1] - right[1] * down[0] < 0)


def _contrast(levels: Bytes, board: Board, corners: Float64s) -> float:
    """Mean level of the white squares less that of the black ones, were the corners in the board's order."""
    grid = corners.reshape(board.rows, board.columns, 2)
    middles = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    seen = cv.sampled(levels, middles)
    rows, columns = np.indices(seen.shape)
    black = (rows + columns) % 2 == 0  # square (1, 1) of the board, whose corner square (0, 0) is black
    return float(seen[~black].mean() - seen[black].mean())


def _refuse_second(levels: Bytes, board: Board, corners: Float64s) -> None:
    """Raise where another chessboard is in view beside the one that was found."""
    grid = corners.reshape(board.rows, board.columns, 2)
    outline = np.concatenate([grid[0], grid[1:, -1], grid[-1, ::-1], grid[::-1, 0]])
    low, high = outline.min(axis=0), outline.max(axis=0)
    margin = 2.0 * float(np.linalg.norm(grid[0, 1] - grid[0, 0]))
    left, top = np.maximum(low - margin, 0).astype(int)
    right, bottom = (high + margin).astype(int)
    covered = levels.copy()
    covered[top:bottom, left:right] = int(np.median(levels))
    if (
        cv.find_chessboard(shrunk(covered, 2 if margin > _SPACING_TO_HALVE_PX else 1), board.columns, board.rows)
        is not None
    ):
        raise BoardNotSeen("two chessboards are in view, expected one")


# --- sub-pixel --------------------------------------------------------------------------------------------------------


def _window_px(board: Board, ids: Int64s, corners: Float64s) -> int:
    """Half the window that refines a corner: all of it white and black squares, no marker, no other corner."""
    spacing = _spacing_px(board, ids, corners)
    margin = 0.5 * (1 - board.marker_mm / board.square_mm) if board.kind == "charuco" else 0.4
    return int(np.clip(0.85 * margin * spacing, 2, 15))


def _spacing_px(board: Board, ids: Int64s, corners: Float64s) -> float:
    """Least distance between neighbouring corners, from the plane through all of them."""
    fitted = cv.homography(board.corners_mm()[ids], corners)
    if fitted is None:
        raise BoardNotSeen("the corners lie on one line: show more of the board")
    places = board.corners_mm()[ids]
    steps = [
        np.linalg.norm(cv.mapped(fitted[0], places + step) - cv.mapped(fitted[0], places), axis=1).min()
        for step in (np.array([board.square_mm, 0.0]), np.array([0.0, board.square_mm]))
    ]
    return float(min(steps))


def _steady(ids: Int64s, rough: Float64s, fine: Float64s) -> tuple[Int64s, Float64s]:
    """The corners that refining moved by 2 px at most: others ran off to an edge nearby."""
    kept = np.linalg.norm(fine - rough, axis=1) <= 2.0
    return ids[kept], fine[kept]
