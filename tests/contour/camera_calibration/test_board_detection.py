"""Corners to a few hundredths of a pixel, and for each picture that does not serve the reason why."""

import cv2
import numpy as np
import pytest

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import find_board
from contour.errors import BoardNotSeen
from contour.synthetic import camera_above
from contour.synthetic.board_poses import BoardPose
from contour.synthetic.board_view import board_camera, board_sheet, render_flat
from tests.support.pictures.board_scenes import CAMERA, CHARUCO, CHESSBOARD, FLAT, SMALL, picture, true_corners

UPSIDE_DOWN = BoardPose(np.diag([-1.0, -1.0, 1.0]), np.array([400.0, 300.0, 0.0]))


@pytest.mark.parametrize("board", [CHARUCO, CHESSBOARD], ids=lambda board: board.kind)
@pytest.mark.parametrize("pose", [FLAT, UPSIDE_DOWN], ids=["upright", "upside down"])
def test_each_corner_is_found_under_its_own_number_to_a_twentieth_of_a_pixel(board: Board, pose: BoardPose) -> None:
    view = find_board(picture(board, CAMERA, pose), board)
    error = np.linalg.norm(view.pixels - true_corners(board, CAMERA, pose)[view.ids], axis=1)
    assert len(view.ids) == 70
    assert np.sqrt((error**2).mean()) < 0.025
    assert error.max() < 0.05
    assert 0.5 < view.edge_sigma_px < 1.2


def test_the_edges_of_a_blurred_view_are_wide() -> None:
    sharp = picture(CHARUCO)
    blurred = cv2.GaussianBlur(sharp, (0, 0), 2.0)
    assert find_board(sharp, CHARUCO).edge_sigma_px < 1.2
    assert find_board(blurred, CHARUCO).edge_sigma_px > 1.8


def test_part_of_a_charuco_board_gives_the_corners_in_view() -> None:
    part = picture(CHARUCO)[:, :420].copy()
    view = find_board(part, CHARUCO)
    error = view.pixels - true_corners(CHARUCO, SMALL, FLAT)[view.ids]
    assert 12 <= len(view.ids) < 60
    assert np.linalg.norm(error, axis=1).max() < 0.1


def two_boards(board: Board, scale_px: float = 0.75) -> np.ndarray:
    """Two of the same board side by side."""
    camera = camera_above(1100, 520, scale_px, plane_mm=0.0)
    return render_flat(
        board_camera(camera, *FLAT), [board_sheet(board, (-20.0, 0.0)), board_sheet(board, (350.0, 0.0))]
    )


def refused(levels: np.ndarray, board: Board) -> str:
    with pytest.raises(BoardNotSeen) as error:
        find_board(levels, board)
    return str(error.value)


OTHER = Board("charuco", 9, 6, 30.0, 21.0, "DICT_5X5_250")
LARGER = Board("charuco", 12, 9, 30.0, 21.0, "DICT_5X5_250")


def test_charuco_pictures_that_do_not_serve_are_refused_with_their_reason() -> None:
    seen = picture(CHARUCO)
    assert "the picture is mirrored" in refused(np.ascontiguousarray(seen[:, ::-1]), CHARUCO)
    assert "two boards are in view" in refused(two_boards(CHARUCO), CHARUCO)
    assert "of the board's" in refused(seen[:, :300].copy(), CHARUCO)
    assert "do not lie as on a 11x8 board" in refused(picture(OTHER), CHARUCO)
    assert "is not of a 11x8 board" in refused(picture(LARGER), CHARUCO)
    assert "no marker of DICT_5X5_250 is seen" in refused(np.full((720, 960), 90, np.uint8), CHARUCO)
    wrong = Board("charuco", 11, 8, 30.0, 24.0, "DICT_5X5_250")
    assert "a marker's side is 0." in refused(seen, wrong)


def test_chessboard_pictures_that_do_not_serve_are_refused_with_their_reason() -> None:
    seen = picture(CHESSBOARD)
    assert "two chessboards are in view" in refused(two_boards(CHESSBOARD), CHESSBOARD)
    assert "no chessboard is seen" in refused(np.full((720, 960), 90, np.uint8), CHESSBOARD)
    assert "squares of a chessboard are seen, expected 11x8" in refused(seen[:, :420].copy(), CHESSBOARD)
    assert "expected 9x6" in refused(seen, Board("chessboard", 9, 6, 30.0))
    assert "no chessboard is seen" in refused(cv2.GaussianBlur(seen, (0, 0), 25.0), CHESSBOARD)
