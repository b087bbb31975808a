"""A table with two ArUco marks beside it, and cameras that were knocked."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from contour.camera_calibration.board import mark_boxes
from contour.synthetic import CameraModel, camera_above
from contour.synthetic.board_view import render_flat

CAMERA = camera_above(
    1280, 960, 0.45, plane_mm=0.0, tilt_deg=(2.0, -1.0), roll_deg=4.0, distortion=(-0.12, 0.0, 0.0, 0.0, 0.0)
)
SIDE_MM = 24.0
PLACES_MM = {3: (40.0, 200.0), 4: (510.0, 300.0)}


def marked(camera: CameraModel, seed: int = 1, places: dict[int, tuple[float, float]] | None = None) -> np.ndarray:
    """The picture of the marks, each on a sheet with a white margin."""
    sheets = []
    for number, (x, y) in (PLACES_MM if places is None else places).items():
        paper = np.array([x - 6, y - 6, x + SIDE_MM + 6, y + SIDE_MM + 6])
        sheets.append((paper, mark_boxes("DICT_4X4_50", number, np.array([x, y]), SIDE_MM)))
    return render_flat(camera, sheets, seed=seed)


def bumped(
    camera: CameraModel,
    *,
    roll_deg: float = 0.0,
    pitch_deg: float = 0.0,
    yaw_deg: float = 0.0,
    shift_px: tuple[float, float] = (0.0, 0.0),
) -> CameraModel:
    """The camera turned about its own axes: pitch x, yaw y, roll the optical axis; or its sensor moved."""
    turn = cv2.Rodrigues(np.radians([pitch_deg, yaw_deg, roll_deg]))[0]
    rows = tuple((float(r[0]), float(r[1]), float(r[2])) for r in turn @ np.array(camera.rotation))
    x, y, z = (turn @ np.array(camera.translation_mm)).tolist()
    centre = (camera.centre_px[0] + shift_px[0], camera.centre_px[1] + shift_px[1])
    return replace(camera, rotation=rows, translation_mm=(x, y, z), centre_px=centre)
