"""A plate before a known camera: its lengths, how straight its rows are, and how high it lies."""

from __future__ import annotations

import numpy as np
import pytest

from contour.calibration.calibration import CameraCalibration, SimpleCalibration
from contour.camera_calibration.board import Board
from contour.errors import GaugeNotSeen
from contour.length_test.plate import CornerPair, SeenCorners, seen_plate
from contour.synthetic import CameraModel, camera_above
from contour.synthetic.board_poses import BoardPose
from contour.synthetic.board_view import board_camera

BOARD = Board("charuco", 9, 7, 25.0, 17.0, "DICT_6X6_250")
PAIRS = (CornerPair("bottom", (1, 1), (8, 1)), CornerPair("rising", (1, 1), (8, 6)))
CAMERA = camera_above(1280, 960, 0.45, plane_mm=0.0, tilt_deg=(2.0, -1.5), distortion=(-0.1, 0.01, 2e-4, 1e-4, 0.0))


def calibration(camera: CameraModel = CAMERA) -> CameraCalibration:
    return CameraCalibration(
        image_width=camera.width,
        image_height=camera.height,
        camera_matrix=camera.matrix,
        distortion_coefficients=np.array(camera.distortion),
        rotation_vector=np.array(camera.rotation_vector),
        translation_mm=np.array(camera.translation_mm),
    )


def corners(height_mm: float, turn_deg: float = 0.0, without: tuple[int, ...] = (), noise: float = 0.0) -> SeenCorners:
    """The plate's corners as the camera sees them, the board's middle near the field's."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    pose = BoardPose(turn, np.array([280.0, 210.0, height_mm]) - turn @ np.array([112.5, 87.5, 0.0]))
    ids = np.array([number for number in range(BOARD.columns * BOARD.rows) if number not in without])
    flat = BOARD.corners_mm()[ids]
    pixels = board_camera(CAMERA, *pose).project(flat, 0.0)
    pixels = pixels + np.random.default_rng(5).normal(0.0, noise, pixels.shape)
    return SeenCorners(ids, pixels, flat, BOARD.columns, BOARD.rows)


@pytest.mark.parametrize("turn_deg", [0.0, 33.0, 90.0, 180.0, -120.0])
def test_lengths_turn_and_height_are_those_of_the_plate(turn_deg: float) -> None:
    seen = seen_plate(corners(30.0, turn_deg), PAIRS, calibration(), 30.0)
    assert [one.measured_mm for one in seen.lengths] == pytest.approx([175.0, np.hypot(175.0, 125.0)], abs=1e-6)
    assert (seen.turn_deg - turn_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-6)
    assert (seen.lengths[0].direction_deg - turn_deg + 90.0) % 180.0 - 90.0 == pytest.approx(0.0, abs=1e-6)
    assert seen.heights_mm == pytest.approx([30.0] * 4, abs=1e-3)
    assert max(line.form_mm for line in seen.lines) < 1e-6


def test_a_plane_taken_to_be_higher_makes_lengths_shorter_as_it_says() -> None:
    told = seen_plate(corners(30.0), PAIRS, calibration(), 30.0).lengths[0]
    higher = seen_plate(corners(30.0), PAIRS, calibration(), 33.0).lengths[0]
    assert told.per_height < -0.1
    assert higher.measured_mm - told.measured_mm == pytest.approx(3 * told.per_height, rel=1e-2)


def test_noise_bends_rows_and_a_row_of_few_corners_is_not_judged() -> None:
    hidden = tuple(range(4, BOARD.columns))  # of the top row four are left
    seen = seen_plate(corners(20.0, without=hidden, noise=0.1), PAIRS[:1], calibration(), 20.0)
    names = [line.name for line in seen.lines]
    assert "row 6" not in names
    assert {"row 1", "column 1"} < set(names)
    assert min(line.form_mm for line in seen.lines) > 0.01


def test_a_hidden_end_is_named() -> None:
    with pytest.raises(GaugeNotSeen, match=r"not whole: corner \[8, 6\], an end of length rising"):
        seen_plate(corners(20.0, without=(7,)), PAIRS, calibration(), 20.0)


def test_without_a_camera_model_no_height_is_told() -> None:
    flat = BOARD.corners_mm() * [2.0, -2.0] + [100.0, 600.0]
    simple = SimpleCalibration(1280, 960, 0.5, (0.0, 960.0))
    seen = seen_plate(SeenCorners(np.arange(len(flat)), flat, BOARD.corners_mm(), 8, 6), PAIRS, simple, 0.0)
    assert seen.heights_mm is None
    assert seen.lengths[0].measured_mm == pytest.approx(175.0)
    assert seen.lengths[0].per_height == 0.0


def test_the_same_place_is_known_again_and_half_a_turn_is_another() -> None:
    first = seen_plate(corners(20.0, 175.0), PAIRS, calibration(), 20.0)
    assert first.same_place(seen_plate(corners(20.0, -179.0), PAIRS, calibration(), 20.0))
    assert not first.same_place(seen_plate(corners(20.0, -5.0), PAIRS, calibration(), 20.0))
    assert not first.same_place(seen_plate(corners(20.0, 160.0), PAIRS, calibration(), 20.0))


def test_a_plate_of_which_no_line_is_left_is_not_whole() -> None:
    left = {0, 7, 40, 47}
    hidden = tuple(number for number in range(48) if number not in left)
    with pytest.raises(GaugeNotSeen, match="no row or column of 5 corners"):
        seen_plate(corners(20.0, without=hidden), PAIRS, calibration(), 20.0)
