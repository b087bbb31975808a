"""One random cell: tested with a gauge as it is, and with each of the faults that a certificate must not pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
import yaml

from contour.calibration.calibration import Calibration
from contour.calibration.fixed_marks import Sentinels
from contour.errors import CalibrationError
from contour.geometry.arrays import Bytes, Float64s
from contour.length_test.verdict import Limit
from service.certifying.certificate import Certificate, Circumstances
from service.certifying.gauge_file import Gauge, read_gauge
from service.certifying.sight import Eye
from service.certifying.trial import NotCertified, certified, check_able, default_limit
from service.config.recipes import Recipe
from service.measuring.calibration_file import CalibrationRecord
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from tests.support.scenes.gauge_pictures import block_file, block_picture, plate_board, plate_file, plate_picture
from tests.support.scenes.gauge_scenes import SIZE, Bend, Cell, places, random_cell, shifted, turned

PLATE_PLACES, BLOCK_PLACES = 6, 9
GOOD, SQUARE, TABLE, CAMERA, HEIGHT = "good", "wrong square size", "bent table", "moved camera", "wrong height"
UNMARKED = "moved camera, without fixed marks"
BLOCK_GOOD, BLOCK_HEIGHT = "good, block", "wrong height, block"
PAIRS = 4000


@dataclass(frozen=True)
class Outcome:
    """One certificate: what it decided, its largest error and uncertainty, and the true largest error of the cell.

    `by_lengths`: what it would decide without fixed marks. `plane_share`: how far the plate's plane was from its mean
    height, of what is allowed; NaN of a block. `true_mm`: over pairs of places anywhere in the field, as far apart as
    the gauge's lengths; NaN where not asked for.
    """

    arm: str
    decision: str
    by_lengths: str
    largest_mm: float
    form_mm: float
    plane_share: float
    uncertainty_mm: float
    limit_mm: float
    true_mm: float
    said: str


@dataclass(frozen=True, eq=False)
class _Test:
    """A calibrated cell with a gauge of a height, and the seed of its pictures."""

    cell: Cell
    calibration: Calibration
    height_mm: float
    seed: int


def cell_trial(seed: int, block: bool) -> list[Outcome]:
    """A random camera with its calibration, thickness and gauge, in all states; `block`: with a milled block, too."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(seed)
    cell = random_cell(rng)
    test = _Test(cell, cell.calibrated().calibration, float(rng.uniform(6.0, 60.0)), seed)
    return [*_plate_trials(test, rng), *(_block_trials(test, rng) if block else [])]


def _plate_trials(test: _Test, rng: np.random.Generator) -> list[Outcome]:
    cell, high = test.cell, test.height_mm
    board = plate_board(cell)
    told = plate_file(board, high, rng)
    spots = places(cell, board.size_mm, high, rng, PLATE_PLACES)
    warmer = float(rng.uniform(-5.0, 5.0))

    def pictures(arm: int, **changes: Any) -> list[Bytes]:
        seeds = (1000 * test.seed + 100 * arm + number for number in range(PLATE_PLACES))
        changes = {"warmer_k": warmer, **changes}
        return [plate_picture(cell, board, spot, high, seed=s, **changes) for spot, s in zip(spots, seeds, strict=True)]

    still = pictures(0)
    wrong = 1 + float(rng.choice([-1, 1]) * rng.uniform(0.001, 0.01))
    bend = Bend(float(rng.choice([-1.0, 1.0])), bool(rng.integers(2)), float(rng.uniform(0, 180)))
    knocked = turned(cell.camera, rng, 0.3) if rng.integers(2) else shifted(cell.camera, rng, _px_mm(cell, 2.0))
    moved = pictures(2, camera=knocked)
    off = float(rng.choice([-1, 1]) * rng.uniform(1.0, 5.0))
    scaled = cell.calibrated(cell.board.square_mm * wrong).calibration
    longest = max(float(length["length_mm"]) for length in told["lengths"])
    true = true_largest_mm(cell, test.calibration, high, longest, np.random.default_rng(test.seed))
    knock = _tried(CAMERA, test.calibration, cell.marks, told, moved)
    return [
        _tried(GOOD, test.calibration, cell.marks, told, still, true),
        _tried(SQUARE, scaled, cell.marks, told, still),
        _tried(TABLE, test.calibration, cell.marks, told, pictures(1, bend=bend)),
        knock,
        replace(knock, arm=UNMARKED, decision=knock.by_lengths),
        _tried(HEIGHT, test.calibration, cell.marks, {**told, "height_mm": high + off}, still),
    ]


def _block_trials(test: _Test, rng: np.random.Generator) -> list[Outcome]:
    cell, high = test.cell, test.height_mm
    width = float(np.ptp(cell.field_mm[:, 0]))
    size = (0.42 * width, 0.28 * width)
    told = block_file(size, high, rng)
    spots = places(cell, size, high, rng, BLOCK_PLACES)
    seen = [
        block_picture(cell, size, spot, high, seed=1000 * test.seed + 900 + number) for number, spot in enumerate(spots)
    ]
    off = float(rng.uniform(4.0, 8.0))
    return [
        _tried(BLOCK_GOOD, test.calibration, None, told, seen),
        _tried(BLOCK_HEIGHT, test.calibration, None, {**told, "height_mm": high + off}, seen),
    ]


def _tried(
    arm: str,
    calibration: Calibration,
    marks: Sentinels | None,
    told: dict[str, Any],
    pictures: Sequence[Bytes],
    true_mm: float = float("nan"),
) -> Outcome:
    """The certificate of these pictures, or that there is none."""
    record = CalibrationRecord(calibration, "", datetime.now(UTC), marks)
    guard = CalibrationGuard(record, GuardLimits())
    recipe = Recipe(number=1, name="rendered")
    gauge = _gauge(told)
    limit = Limit(default_limit(gauge, recipe)[0])
    circumstances = Circumstances(datetime.now(UTC), "", "", "", "", "", "", limit)
    eye = Eye(gauge, guard, recipe)
    try:
        check_able(gauge, guard, limit, None)
        sights = [eye.look(picture, f"{number}") for number, picture in enumerate(pictures)]
        return _outcome(arm, certified(eye, gauge, guard, circumstances, sights), true_mm)
    except NotCertified as error:
        none = float("nan")
        return Outcome(arm, "none", "none", none, none, none, none, limit.constant_mm, true_mm, str(error))


def _outcome(arm: str, certificate: Certificate, true_mm: float) -> Outcome:
    plane = certificate.worst_plane
    return Outcome(
        arm,
        certificate.decision.value,
        replace(certificate, findings=()).decision.value,
        max(abs(one.error_mm) for one in certificate.lengths),
        certificate.worst_form.form_mm,
        float("nan") if plane is None else abs(plane.off_mm) / plane.limit_mm,
        certificate.uncertainty_mm,
        certificate.told.limit.constant_mm,
        true_mm,
        "; ".join(text for _, text in certificate.findings),
    )


def _gauge(told: dict[str, Any]) -> Gauge:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "gauge.yaml"
        path.write_text(yaml.safe_dump(told), encoding="utf-8")
        return read_gauge(path)


def _px_mm(cell: Cell, pixels: float) -> float:
    x, y = cell.field_mm.mean(axis=0).tolist()
    return pixels * cell.camera.mm_per_px((x, y), 0.0)


def true_largest_mm(
    cell: Cell, calibration: Calibration, height_mm: float, longest_mm: float, rng: np.random.Generator
) -> float:
    """The largest true error of a length no longer than the gauge's, over PAIRS of places anywhere in the picture."""
    ends: list[Float64s] = [rng.uniform([0, 0], [SIZE[0] - 1, SIZE[1] - 1], (PAIRS, 2)) for _ in range(2)]
    true = [cell.camera.back_project(end, height_mm) for end in ends]
    try:
        found = [calibration.to_work(end, height_mm) for end in ends]
    except CalibrationError:  # it measures nothing there: no limit holds anywhere in the picture
        return float("inf")
    apart = np.linalg.norm(true[1] - true[0], axis=1)
    errors = np.abs(np.linalg.norm(found[1] - found[0], axis=1) - apart)
    return float(errors[apart <= longest_mm].max())
