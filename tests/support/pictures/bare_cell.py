"""A cell that is being set up: one camera before which a person lays a board, nothing, and a block."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from contour.synthetic import CellGeometry, Scene, camera_above, rectangle, render, render_empty_table
from contour.synthetic.board_poses import board_poses
from tests.support.pictures.board_scenes import CHARUCO, picture
from tests.support.pictures.fixed_mark_scenes import SIDE_MM, marked

CAMERA = camera_above(
    960, 720, 0.5, plane_mm=0.0, tilt_deg=(1.0, -2.0), roll_deg=2.0, distortion=(-0.1, 0.0, 0.0, 0.0, 0.0)
)
BLOCK = Scene(
    rectangle((240, 180), 190, 130, 12), CAMERA, CellGeometry(pitch_mm=10, wall_mm=1.0, ribbon_deg=17), seed=31
)


MARKS_MM = {3: (40.0, 40.0), 4: (420.0, 300.0)}


def with_marks(pixels: np.ndarray) -> np.ndarray:
    """The picture with two sheets on the table that have a mark each."""
    seen, marks = pixels.copy(), marked(CAMERA, places=MARKS_MM)
    for x, y in MARKS_MM.values():
        sheet = np.array([[x - 4, y - 4], [x + SIDE_MM + 4, y + SIDE_MM + 4]])
        (left, top), (right, bottom) = np.sort(CAMERA.project(sheet, 0.0), axis=0).round().astype(int)
        seen[top:bottom, left:right] = marks[top:bottom, left:right]
    return seen


@dataclass(frozen=True)
class BareCell:
    """A folder that the configured camera takes its one picture from."""

    folder: Path

    def lies(self, pixels: np.ndarray) -> None:
        """From now on this is what the camera sees; never half of it."""
        self.folder.mkdir(exist_ok=True)
        beside = self.folder.with_suffix(".png")
        cv2.imwrite(str(beside), pixels)
        os.replace(beside, self.folder / "seen.png")

    def boards(self, count: int, seed: int = 5) -> Iterator[np.ndarray]:
        """The board as a person holds it: flat on the table first."""
        for number, pose in enumerate(board_poses(CHARUCO, CAMERA, count, np.random.default_rng(seed))):
            yield picture(CHARUCO, CAMERA, pose, number)

    def block(self) -> np.ndarray:
        """A block on the table, between the marks."""
        return with_marks(render(BLOCK).picture)

    def table(self) -> np.ndarray:
        """The table without it."""
        return with_marks(render_empty_table(BLOCK, 1)[0])
