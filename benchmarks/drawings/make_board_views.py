"""Writes rendered views of a calibration board, as a person would take them, to try `combtrace calibrate`.

    python -m benchmarks.drawings.make_board_views FOLDER [--board chessboard] [--count 14] [--tilt 20]

The first, flat.png, shows the board flat on the table.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np

from contour.camera_calibration.board import Board
from contour.synthetic import Sensor, camera_above
from contour.synthetic.board_poses import board_poses
from contour.synthetic.board_view import board_camera, render_board

BOARDS = {
    "charuco": Board("charuco", 11, 8, 30.0, 21.0, "DICT_5X5_250"),
    "chessboard": Board("chessboard", 11, 8, 30.0),
}


def main() -> None:
    """Render and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--board", choices=tuple(BOARDS), default="charuco")
    parser.add_argument("--count", type=int, default=14)
    parser.add_argument("--tilt", type=float, default=20.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(args.seed)
    camera = camera_above(
        1600, 1200, 0.375, plane_mm=0.0, tilt_deg=(1.5, -2.0), roll_deg=1.0, distortion=(-0.12, 0.0, 0.0, 0.0, 0.0)
    )
    board = BOARDS[args.board]
    whole = args.board == "chessboard"  # it is not found unless all of it is seen
    for number, pose in enumerate(board_poses(board, camera, args.count, rng, tilt_deg=args.tilt, whole=whole)):
        picture = render_board(board, board_camera(camera, *pose), sensor=Sensor(), seed=args.seed * 1000 + number)
        name = "flat.png" if number == 0 else f"view-{number:02d}.png"
        cv2.imwrite(str(args.folder / name), picture)
        print(args.folder / name)


if __name__ == "__main__":
    main()
