"""Calibrated cameras above a table."""

from __future__ import annotations

import cv2
import numpy as np

from contour.calibration.calibration import Alignment, CameraCalibration

LOOKING_DOWN = np.array([np.pi, 0.0, 0.0])
"""Camera x along work x, camera y against work y, camera z down."""


def camera(
    tilt: tuple[float, float] = (0.0, 0.0),
    roll: float = 0.0,
    distortion: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0),
    alignment: Alignment | None = None,
    distance: float = 1000.0,
) -> CameraCalibration:
    """A camera of 1600 x 1200 px that sees the work point (300, 200, 0) in its middle, tilted by degrees."""
    down = cv2.Rodrigues(LOOKING_DOWN)[0]
    turn = cv2.Rodrigues(np.radians([tilt[0], tilt[1], 0.0]))[0] @ cv2.Rodrigues(np.radians([0.0, 0.0, roll]))[0]
    rotation = turn @ down
    return CameraCalibration(
        1600,
        1200,
        camera_matrix=np.array([[1800.0, 0, 799.5], [0, 1810.0, 599.5], [0, 0, 1]]),
        distortion_coefficients=np.array(distortion),
        rotation_vector=cv2.Rodrigues(rotation)[0].ravel(),
        translation_mm=np.array([0.0, 0, distance]) - rotation @ np.array([300.0, 200.0, 0.0]),
        alignment=alignment,
    )
