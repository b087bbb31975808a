"""Boards before known cameras: rendered pictures, or only their corners with noise, which is much quicker."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import BoardView
from contour.synthetic import CameraModel, camera_above
from contour.synthetic.board_poses import BoardPose, board_poses
from contour.synthetic.board_view import board_camera, render_board

CHARUCO = Board("charuco", 11, 8, 30.0, 21.0, "DICT_5X5_250")
CHESSBOARD = Board("chessboard", 11, 8, 30.0)
LENS = (-0.12, 0.0, 0.0, 0.0, 0.0)
CAMERA = camera_above(1600, 1200, 0.375, plane_mm=0.0, tilt_deg=(1.5, -2.0), roll_deg=3.0, distortion=LENS)
SMALL = camera_above(960, 720, 0.5, plane_mm=0.0, tilt_deg=(3.0, -5.0), roll_deg=8.0, distortion=LENS)
FLAT = BoardPose(np.eye(3), np.array([70.0, 60.0, 0.0]))


def picture(board: Board, camera: CameraModel = SMALL, pose: BoardPose = FLAT, seed: int = 1) -> np.ndarray:
    """A rendered view of the board, in a pose on the table."""
    return render_board(board, board_camera(camera, *pose), seed=seed)


def true_corners(board: Board, camera: CameraModel, pose: BoardPose) -> np.ndarray:
    """Pixels of all inner corners."""
    return board_camera(camera, *pose).project(board.corners_mm(), 0.0)


def noisy_view(name: str, board: Board, camera: CameraModel, pose: BoardPose, rng: np.random.Generator) -> BoardView:
    """What detection would find: corners within the picture, off by 0.02 px."""
    seen = true_corners(board, camera, pose)
    seen = seen + rng.normal(0.0, 0.02, seen.shape)
    inside = ((seen > 8) & (seen < [camera.width - 9, camera.height - 9])).all(axis=1)
    return BoardView(name, np.flatnonzero(inside), seen[inside], 0.8)


def noisy_views(
    board: Board = CHARUCO, camera: CameraModel = CAMERA, *, count: int = 14, tilt_deg: float = 20.0, seed: int = 3
) -> tuple[list[BoardView], list[BoardPose]]:
    """Views named 00, 01, …; the first is flat on the table."""
    rng = np.random.default_rng(seed)
    poses = board_poses(board, camera, count, rng, tilt_deg=tilt_deg)
    return [noisy_view(f"{n:02d}", board, camera, pose, rng) for n, pose in enumerate(poses)], poses


def moved(view: BoardView, shift_px: np.ndarray, name: str = "") -> BoardView:
    """The view with its corners shifted, (2,) or (N, 2) px."""
    return replace(view, pixels=view.pixels + shift_px, name=name or view.name)
