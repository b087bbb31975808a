"""A homography as a calibration: there and back again, its plane alone, and no mirrored or degenerate one."""

import numpy as np
import pytest

from contour.calibration.calibration import Alignment
from contour.calibration.plane_calibration import PlaneCalibration
from contour.errors import CalibrationError
from contour.synthetic import camera_above

CAMERA = camera_above(1600, 1200, 0.375, tilt_deg=(5.0, -8.0), roll_deg=20.0)


def seen_by(heights_mm: float) -> PlaneCalibration:
    """The homography of a camera without lens distortion."""
    rotation, shift = np.array(CAMERA.rotation), np.array(CAMERA.translation_mm)
    forward = CAMERA.matrix @ np.column_stack([rotation[:, :2], rotation[:, 2] * heights_mm + shift])
    return PlaneCalibration(1600, 1200, np.linalg.inv(forward), heights_mm, Alignment(30.0, (100.0, -50.0)))


def test_it_agrees_with_the_camera_it_stands_for_and_comes_back() -> None:
    calibration = seen_by(20.0)
    pixels = np.array([[0.0, 0.0], [1599.0, 0.0], [800.0, 600.0], [0.0, 1199.0]])
    work = calibration.to_work(pixels, 20.0)
    np.testing.assert_allclose(work, CAMERA.back_project(pixels, 20.0), atol=1e-6)
    np.testing.assert_allclose(calibration.to_pixels(calibration.to_machine(work), 20.0), pixels, atol=1e-6)
    rectifier = calibration.rectifier(20.0)
    np.testing.assert_allclose(rectifier.unrectify(rectifier.rectify(pixels)), pixels, atol=1e-6)


def test_it_knows_its_own_plane_only() -> None:
    calibration = seen_by(20.0)
    assert calibration.height_known(20.4)
    assert not calibration.height_known(0.0)


@pytest.mark.parametrize("matrix", [np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan), np.eye(2)])
def test_a_mirrored_or_degenerate_map_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(CalibrationError):
        PlaneCalibration(1600, 1200, matrix)


def test_pixels_beyond_the_horizon_are_refused() -> None:
    tilted = PlaneCalibration(100, 100, np.array([[1.0, 0, -50], [0, -1, 50], [0, 0.02, 0.2]]))
    with pytest.raises(CalibrationError, match="horizon"):
        tilted.to_work(np.array([[50.0, -40.0]]), 0.0)
