"""Drawn combs on a dark table: pictures so small that a service is done with each in a moment, and their scale."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

SIZES = [(10, 8), (12, 9), (8, 10)]  # columns and rows of cells


def comb(columns: int, rows: int) -> np.ndarray:
    """320 x 240, uint8."""
    picture = np.full((240, 320), 25, np.uint8)
    side = 8.0
    for row in range(rows):
        for column in range(columns):
            centre = (60 + (column + row % 2 / 2) * side * np.sqrt(3), 50 + row * side * 1.5)
            angles = np.arange(6) * np.pi / 3
            corners = np.stack([centre[0] + side * np.sin(angles), centre[1] + side * np.cos(angles)], axis=1)
            cv2.polylines(picture, [np.round(corners * 16).astype(np.int32)], True, 220, 2, cv2.LINE_AA, shift=4)
    return picture


def write_combs(folder: Path) -> Path:
    """Make the folder, with a picture of each size; their calibration lies beside it, under its name and `.yaml`."""
    folder.mkdir()
    for number, (columns, rows) in enumerate(SIZES):
        cv2.imwrite(str(folder / f"{number}.png"), comb(columns, rows))
    folder.with_suffix(".yaml").write_text(
        "version: 1\nkind: simple\nimage_width: 320\nimage_height: 240\nmm_per_pixel: 0.5\nplane_height_mm: 20\n"
        "origin_px: [0, 0]\nrotation_deg: 0\n"
    )
    return folder
