"""A cell whose calibration is true, and certificates of a plate on its table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from contour.camera_calibration.board import Board
from contour.geometry.arrays import Bytes
from contour.length_test.verdict import Limit
from service.certifying.certificate import Certificate, Circumstances
from service.certifying.gauge_file import read_gauge
from service.certifying.sight import Eye, Sight
from service.certifying.trial import certified
from service.config.recipes import Recipe
from service.measuring.calibration_file import CalibrationRecord, save_record
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from tests.support.scenes.gauge_pictures import plate_board, plate_file, plate_picture
from tests.support.scenes.gauge_scenes import Cell, bare_cell, places

HEIGHT_MM = 20.0
PLACES = 6


@dataclass(frozen=True, eq=False)
class PlateTrial:
    """The cell, what its plate's file says, where it was laid, and the pictures."""

    cell: Cell
    board: Board
    told: dict[str, Any]
    spots: list[tuple[float, float, float]]
    pictures: list[Bytes]

    @property
    def record(self) -> CalibrationRecord:
        """The true calibration, with the cell's fixed marks."""
        return CalibrationRecord(self.cell.known, "rendered", datetime(2026, 11, 2, tzinfo=UTC), self.cell.marks)

    def again(self, **changes: Any) -> list[Bytes]:
        """Pictures of the same places with something changed."""
        return [
            plate_picture(self.cell, self.board, spot, HEIGHT_MM, seed=number, **changes)
            for number, spot in enumerate(self.spots)
        ]


def plate_trial(seed: int) -> PlateTrial:
    """A random cell, and its plate in PLACES places."""
    rng = np.random.default_rng(seed)
    cell = bare_cell(rng)
    board = plate_board(cell)
    told, spots = plate_file(board, HEIGHT_MM, rng), places(cell, board.size_mm, HEIGHT_MM, rng, PLACES)
    trial = PlateTrial(cell, board, told, spots, [])
    return PlateTrial(cell, board, told, spots, trial.again())


def seen(
    told: dict[str, Any], record: CalibrationRecord, pictures: Sequence[Bytes], folder: Path
) -> tuple[Eye, CalibrationGuard, list[Sight]]:
    """What an eye for that gauge sees, p0, p1 and so on."""
    path = folder / "gauge.yaml"
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    guard = CalibrationGuard(record, GuardLimits())
    eye = Eye(read_gauge(path), guard, Recipe(number=1, name="default"))
    return eye, guard, [eye.look(picture, f"p{number}") for number, picture in enumerate(pictures)]


def circumstances(limit_mm: float = 0.1) -> Circumstances:
    """Those of a test by anna."""
    made = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
    return Circumstances(made, "anna", "cell 3", "combtrace accept", "1", "calibration.yaml", "", Limit(limit_mm))


def certificate(
    told: dict[str, Any], record: CalibrationRecord, pictures: Sequence[Bytes], folder: Path
) -> Certificate:
    """The certificate of these pictures; raise NotCertified."""
    eye, guard, sights = seen(told, record, pictures, folder)
    return certified(eye, read_gauge(folder / "gauge.yaml"), guard, circumstances(), sights)


def stored(trial: PlateTrial, folder: Path) -> Path:
    """The folder with calibration, gauge file and pictures, as a person has them."""
    import cv2

    save_record(folder / "calibration.yaml", trial.record)
    (folder / "plate.yaml").write_text(yaml.safe_dump(trial.told), encoding="utf-8")
    (folder / "pictures").mkdir()
    for number, picture in enumerate(trial.pictures):
        cv2.imwrite(str(folder / "pictures" / f"p{number}.png"), picture)
    return folder
