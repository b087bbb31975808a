"""Writes a rendered cell to try `combtrace accept` on: calibration, a plate's file, pictures of the plate.

    python -m benchmarks.drawings.make_gauge_pictures FOLDER [--seed 1] [--places 7] [--higher-mm 0]

`--higher-mm`: how much higher the plate lies than its file says.
"""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np
import yaml

from service.measuring.calibration_file import CalibrationRecord, save_record
from tests.support.scenes.gauge_pictures import plate_board, plate_file, plate_picture
from tests.support.scenes.gauge_scenes import places, random_cell


def main() -> None:
    """Render and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--places", type=int, default=7)
    parser.add_argument("--higher-mm", type=float, default=0.0)
    args = parser.parse_args()
    pictures = args.folder / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(args.seed)
    cell = random_cell(rng)
    record = CalibrationRecord(cell.calibrated().calibration, "rendered camera", datetime.now(UTC), cell.marks)
    save_record(args.folder / "calibration.yaml", record)
    board, height_mm = plate_board(cell), 20.0
    told = yaml.safe_dump(plate_file(board, height_mm, rng), sort_keys=False)
    (args.folder / "plate.yaml").write_text(told, encoding="utf-8")
    for number, place in enumerate(places(cell, board.size_mm, height_mm, rng, args.places), 1):
        picture = plate_picture(cell, board, place, height_mm + args.higher_mm, seed=1000 * args.seed + number)
        cv2.imwrite(str(pictures / f"place-{number:02d}.png"), picture)
    print(args.folder)


if __name__ == "__main__":
    main()
