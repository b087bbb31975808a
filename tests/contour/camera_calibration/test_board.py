"""The board's pattern is OpenCV's own, and a board that could not be told apart is refused."""

import cv2
import numpy as np
import pytest

from contour.camera_calibration.board import Board
from contour.errors import ParameterError
from contour.synthetic import Sensor, camera_above
from contour.synthetic.board_view import render_board
from tests.support.pictures.board_scenes import CHARUCO, CHESSBOARD


@pytest.mark.parametrize("size", [(11, 8), (8, 11), (7, 5), (6, 6)])
def test_a_rendered_charuco_board_is_what_opencv_draws(size: tuple[int, int]) -> None:
    """10 px a square: each black and white pixel, seen straight from above without blur."""
    board = Board("charuco", *size, 40.0, 28.0, "DICT_5X5_250")
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    drawn = cv2.aruco.CharucoBoard(size, 40.0, 28.0, dictionary).generateImage((40 * size[0], 40 * size[1]))
    camera = camera_above(40 * size[0], 40 * size[1], 1.0, plane_mm=0.0, target_mm=(20.0 * size[0], 20.0 * size[1]))
    seen = render_board(board, camera, sensor=Sensor(blur_px=0.0, shot_noise=0.0, read_noise=0.0))
    inner = np.abs(cv2.Laplacian(drawn, cv2.CV_32F)) == 0
    np.testing.assert_array_equal((seen > 110)[inner], (drawn > 127)[inner])
    own = cv2.aruco.CharucoBoard(size, 40.0, 28.0, dictionary).getChessboardCorners()[:, :2]
    np.testing.assert_allclose(board.corners_mm(), np.array([0, 40.0 * size[1]]) + own * [1, -1], atol=1e-4)


def test_a_chessboard_is_the_charuco_board_without_markers() -> None:
    np.testing.assert_array_equal(CHESSBOARD.black_boxes(), CHARUCO.black_boxes()[: 11 * 8 // 2])
    assert CHESSBOARD.is_black(0, 0)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("chessboard", 10, 8, 30.0), "ambiguous: both counts are even"),
        (("chessboard", 11, 7, 30.0), "ambiguous: both counts are odd"),
        (("chessboard", 11, 8, 30.0, 21.0, ""), "belong to a ChArUco board"),
        (("circles", 11, 8, 30.0), "expected charuco or chessboard"),
        (("charuco", 2, 8, 30.0, 21.0, "DICT_5X5_250"), "Count squares, not inner corners"),
        (("charuco", 11, 8, float("nan"), 21.0, "DICT_5X5_250"), "square_mm is nan"),
        (("charuco", 11, 8, 30.0, 30.0, "DICT_5X5_250"), "marker_mm is 30"),
        (("charuco", 11, 8, 30.0, 21.0, "DICT_9X9"), "expected one of DICT_4X4_100"),
        (("charuco", 40, 40, 30.0, 21.0, "DICT_5X5_250"), "needs 800 markers, DICT_5X5_250 has 250"),
    ],
)
def test_a_board_that_cannot_serve_is_refused(arguments: tuple, expected: str) -> None:
    with pytest.raises(ParameterError, match=expected):
        Board(*arguments)
