"""How a person holds a board under a camera: flat on the table once, then tilted and turned all over the view."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from contour.camera_calibration.board import Board
from contour.geometry.arrays import Float64s
from contour.synthetic.board_view import board_camera
from contour.synthetic.camera import CameraModel

_STEPS_INWARDS = 40


class BoardPose(NamedTuple):
    """Takes board points to the table's frame: rotation (3, 3) and translation (3,), mm."""

    rotation: Float64s
    translation_mm: Float64s


def board_poses(
    board: Board,
    camera: CameraModel,
    count: int,
    rng: np.random.Generator,
    *,
    tilt_deg: float = 20.0,
    whole: bool = False,
) -> list[BoardPose]:
    """Poses of `count` views; in the first the board lies flat, its frame's axes along the table's.

    The others lie up to `tilt_deg` from flat, at any turn, their middles spread over the view; with `whole` so far only
    that all of the board stays in the picture.
    """
    corners = np.array([[0.0, 0.0], [camera.width - 1.0, camera.height - 1.0]])
    low, high = np.sort(camera.back_project(corners, 0.0), axis=0)
    half = np.array([*board.size_mm, 0.0]) / 2
    poses = [BoardPose(np.eye(3), np.array([*((low + high) / 2), 0.0]) - half)]
    cells = _spread(count - 1, rng)
    for place in cells:
        direction, tilt = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(0.4, 1.0) * tilt_deg)
        lean = cv2.Rodrigues(tilt * np.array([np.cos(direction), np.sin(direction), 0.0]))[0]
        angle = rng.uniform(-np.pi, np.pi)
        # A board that must be wholly seen lies along the picture, one way up or the other.
        angle = np.pi * np.round(angle / np.pi) + 0.08 * angle if whole else angle
        turn = cv2.Rodrigues(np.array([0.0, 0.0, angle]))[0]
        rotation = np.asarray(lean @ turn, np.float64)
        middle = np.array([*(low + (high - low) * (0.18 + 0.64 * place)), rng.uniform(20.0, 80.0)])
        pose = BoardPose(rotation, middle - rotation @ half)
        centre = np.array([*((low + high) / 2), middle[2]])
        for _ in range(_STEPS_INWARDS if whole else 0):
            if _in_view(board, camera, pose):
                break
            middle = middle + 0.1 * (centre - middle)
            pose = BoardPose(rotation, middle - rotation @ half)
        poses.append(pose)
    return poses


def _spread(count: int, rng: np.random.Generator) -> Float64s:
    """Points of the unit square, one in each cell of a lattice of about `count` cells, in random order, (count, 2)."""
    columns = int(np.ceil(np.sqrt(count)))
    rows = int(np.ceil(count / columns))
    cells = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    chosen = rng.permutation(cells)[:count]
    return np.asarray((chosen + rng.uniform(0.0, 1.0, chosen.shape)) / np.array([columns, rows]))


def _in_view(board: Board, camera: CameraModel, pose: BoardPose) -> bool:
    """True where the sheet, a margin of half a square around the board, lies in the picture."""
    width, height = board.size_mm
    margin = 0.5 * board.square_mm
    x = np.linspace(-margin, width + margin, 5)
    y = np.linspace(-margin, height + margin, 5)
    sheet = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    seen = board_camera(camera, *pose).project(sheet, 0.0)
    return bool(((seen >= 0) & (seen <= [camera.width - 1, camera.height - 1])).all())
