"""How a person holds a board under a camera: flat on the table once, then tilted and turned all over the view."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.board import Board
from contour.synthetic.camera import CameraModel

Floats = NDArray[np.float64]


class BoardPose(NamedTuple):
    """Takes board points to the table's frame: rotation (3, 3) and translation (3,), mm."""

    rotation: Floats
    translation_mm: Floats


def board_poses(
    board: Board, camera: CameraModel, count: int, rng: np.random.Generator, *, tilt_deg: float = 20.0
) -> list[BoardPose]:
    """Poses of `count` views; in the first the board lies flat, its frame's axes along the table's.

    The others lie up to `tilt_deg` from flat, at any turn, their middles spread over the view.
    """
    corners = np.array([[0.0, 0.0], [camera.width - 1.0, camera.height - 1.0]])
    low, high = np.sort(camera.back_project(corners, 0.0), axis=0)
    half = np.array([*board.size_mm, 0.0]) / 2
    poses = [BoardPose(np.eye(3), np.array([*((low + high) / 2), 0.0]) - half)]
    cells = _spread(count - 1, rng)
    for place in cells:
        direction, tilt = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(0.4, 1.0) * tilt_deg)
        lean = cv2.Rodrigues(tilt * np.array([np.cos(direction), np.sin(direction), 0.0]))[0]
        turn = cv2.Rodrigues(np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)]))[0]
        rotation = np.asarray(lean @ turn, np.float64)
        middle = np.array([*(low + (high - low) * (0.18 + 0.64 * place)), rng.uniform(20.0, 80.0)])
        poses.append(BoardPose(rotation, middle - rotation @ half))
    return poses


def _spread(count: int, rng: np.random.Generator) -> Floats:
    """Points of the unit square, one in each cell of a lattice of about `count` cells, in random order, (count, 2)."""
    columns = int(np.ceil(np.sqrt(count)))
    rows = int(np.ceil(count / columns))
    cells = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    chosen = rng.permutation(cells)[:count]
    return np.asarray((chosen + rng.uniform(0.0, 1.0, chosen.shape)) / np.array([columns, rows]))
