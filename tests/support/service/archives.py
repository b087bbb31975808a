"""An archive of small rendered blocks, as a daemon leaves one, and what can have happened to it since."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path

import numpy as np

from contour.geometry.rings import Contour
from contour.synthetic import CellGeometry, Scene, camera_above, disc_ring, rectangle, render
from drivers.camera import Frame
from service.config.recipes import Recipe
from service.link.contour_message import Envelope, contour_pages
from service.measuring.calibration_file import record_of
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer
from service.reasons import Outcome
from service.records.archive import Archive, ArchiveLimits, document_of, folder_of
from service.records.evidence import FRAME, Evidence, document, document_bytes, frame_bytes
from service.records.job import Job, TriggerStamp

FIRST_SEED = 1_050_001
SCENES = 4
ROUND = 1  # the scene whose outline a tolerance changes: job 2, 7, 12
EMPTY_EVERY = 5  # a job of them sees the table alone, and is refused
BEGUN = datetime(2026, 1, 31, 22, tzinfo=UTC)
MM_PER_PX = 0.5


@cache
def measured_scenes(width: int, height: int) -> list[Evidence]:
    """Blocks measured once, of which jobs are made; the last is a picture without one."""
    recipe = Recipe(number=1, name="core", thickness_mm=20.0, tolerance_mm=0.1)
    guard = _guard(width, height)
    measurer = Measurer(guard.record.calibration, guard=guard)
    found = []
    for number in range(SCENES + 1):
        middle = (width * MM_PER_PX / 2, height * MM_PER_PX / 2)
        size = width * MM_PER_PX * (0.55 + 0.02 * number), height * MM_PER_PX * 0.55
        turned = rectangle(middle, *size, 7 * number + 4)
        outline = Contour(disc_ring(middle, 0.45 * height * MM_PER_PX)) if number == ROUND else turned
        scene = Scene(
            outline,
            camera_above(width, height, MM_PER_PX),
            CellGeometry(pitch_mm=8, wall_mm=1.0),
            seed=FIRST_SEED + number,
        )
        pixels = render(scene).picture
        if number == SCENES:
            pixels = np.random.default_rng(FIRST_SEED).integers(60, 80, (height, width), dtype=np.uint8)
        frame = Frame(pixels, 0.0, True, f"{number}.png", number, "cam0")
        seen = measurer.measure(pixels, recipe, 20.0, "cam0")
        found.append(Evidence(_job(1, 0, recipe), measurer, recipe, 20.0, frame, seen))
    return found


def write_archive(path: Path, jobs: int, first: int = 1, *, width: int = 320, height: int = 240) -> None:
    """That many jobs, numbered from `first` on, a few hours apart."""
    archive = Archive(path, ArchiveLimits(10**12))
    archive.open()
    frames = [frame_bytes(one.frame) for one in measured_scenes(width, height) if one.frame is not None]
    for place in range(jobs):
        scene = SCENES if place % EMPTY_EVERY == EMPTY_EVERY - 1 else place % SCENES
        known = measured_scenes(width, height)[scene]
        assert known.measurement is not None
        assert known.recipe is not None
        refused = bool(known.measurement.reasons)
        job = _job(first + place, place, known.recipe)
        outcome = Outcome.REFUSED if refused else Outcome.ACCEPTED
        job = replace(job, outcome=outcome, reason=known.measurement.reasons[0] if refused else None)
        evidence = replace(known, job=job)
        if not refused:
            envelope = Envelope(job.job_id, 1, 60_000, 30_000, 9, 5, True)
            evidence = replace(evidence, envelope=envelope, pages=contour_pages(known.measurement, envelope))
        archive.store(job.job_id, outcome, {FRAME: frames[scene]}, document_bytes(document(evidence, None)))


def _guard(width: int, height: int) -> CalibrationGuard:
    content = {
        "version": 1,
        "kind": "simple",
        "image_width": width,
        "image_height": height,
        "mm_per_pixel": MM_PER_PX,
        "plane_height_mm": 20,
        "origin_px": [0, height],
        "rotation_deg": 0,
    }
    return CalibrationGuard(record_of(content, "calibration.yaml"), GuardLimits())


def _job(job_id: int, place: int, recipe: Recipe) -> Job:
    taken = BEGUN + timedelta(hours=5 * place)
    return Job(job_id, taken.isoformat(timespec="milliseconds"), TriggerStamp("interval"))


def frame_of(archive: Path, job_id: int) -> Path:
    """The job's frame."""
    return folder_of(archive, job_id) / f"{job_id}-{FRAME}"


def changed_document(archive: Path, job_id: int, **changes: object) -> None:
    """Write the job's document with these of its fields otherwise."""
    path = document_of(archive, job_id)
    assert path is not None
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
