"""From a trigger to the controller's acceptance with a 12 MP frame, without the time of decoding and tracing.

The daemon's parts run in this process, so that a trigger by hand and its end are on one clock; the simulated controller
is a process on loopback. The archive is on: a job waits for its draft, and the rest begins when it has ended.
"""

from __future__ import annotations

import asyncio
import logging
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import cv2
import numpy as np

from service.config.config_file import load_config
from service.daemon.daemon import Daemon, Parts
from service.reasons import Outcome
from service.records.archive import document_of
from service.records.job import Job, TriggerStamp
from service.state import State
from service.wiring.daemon import build
from tests.support.processes.cell import SAMPLES
from tests.support.processes.processes import Process, free_port

WIDTH, HEIGHT = 4000, 3000
JOBS = 15
BOUND_S = 60.0
CONFIG = """\
camera: {{kind: files, path: frame.png}}
calibration: {{file: calibration.yaml}}
controller: {{kind: modbus-tcp, port: {port}}}
service: {{state_dir: state}}
journal: {{path: journal.sqlite}}
archive: {{path: archive, min_free_bytes: 0}}
recipes: [{{number: 1, name: bench, thickness_tolerance_mm: 0.5}}]
"""
CALIBRATION = f"""\
{{version: 1, kind: simple, image_width: {WIDTH}, image_height: {HEIGHT}, mm_per_pixel: 0.15, plane_height_mm: 20,
 origin_px: [0, {HEIGHT}], rotation_deg: 0}}
"""


@dataclass(frozen=True)
class JobTimes:
    """Milliseconds: the whole, from the trigger to the acceptance in the journal; of it decoding, and tracing; and from
    the acceptance until its evidence is durable."""

    whole: float
    decoding: float
    tracing: float
    archiving: float

    @property
    def rest(self) -> float:
        """What the service adds: journal, controller, pages, threads."""
        return self.whole - self.decoding - self.tracing


def prepare(folder: Path) -> Path:
    """A folder with the frame, its calibration and the configuration; the configuration's path."""
    folder.mkdir(exist_ok=True)
    picture = cv2.imread(str(SAMPLES / "2-l-shape.jpg"), cv2.IMREAD_GRAYSCALE)
    large = cv2.resize(np.asarray(picture), (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    cv2.imwrite(str(folder / "frame.png"), large)
    (folder / "calibration.yaml").write_text(CALIBRATION)
    return folder / "config.yaml"


async def until(condition: Callable[[], object]) -> None:
    """Wait for it."""
    async with asyncio.timeout(BOUND_S):
        while not condition():
            await asyncio.sleep(0.002)


async def one(parts: Parts, archive: Path) -> JobTimes:
    """One job by hand, and its evidence."""
    await until(lambda: parts.health.state is State.READY)
    await asyncio.sleep(0.3)  # so that nothing of the job before is going on
    begun = time.perf_counter()
    ticket = await parts.executor.submit(TriggerStamp("serial"))
    job: Job = await ticket.settled
    ended = time.perf_counter()
    assert job.outcome is Outcome.ACCEPTED, job
    assert document_of(archive, job.job_id) is None, "archived before the job had ended"
    await until(lambda: document_of(archive, job.job_id))
    times = 1000 * (ended - begun), job.report["frame_ms"], job.report["timings_ms"]["total"]
    return JobTimes(*times, 1000 * (time.perf_counter() - ended))


async def in_turn(folder: Path, jobs: int) -> list[JobTimes]:
    """So many jobs of a daemon that has just begun, one after another."""
    logging.getLogger("combtrace").setLevel(logging.ERROR)
    path, port = prepare(folder), free_port()
    path.write_text(CONFIG.format(port=port))
    controller = Process(folder / "controller.log", "simulate-controller", "--tcp", f"127.0.0.1:{port}")
    try:
        parts = build(load_config(path))
        daemon = Daemon(parts)
        task = asyncio.ensure_future(daemon.run())
        try:
            return [await one(parts, folder / "archive") for _ in range(jobs)]
        finally:
            daemon.stop()
            await asyncio.wait([task])
    finally:
        controller.stop()


def median_job(found: Sequence[JobTimes]) -> JobTimes:
    """Each figure for itself."""
    # The rest is taken of each job: medians of its parts would not add up.
    rest = median(job.rest for job in found)
    decoding, tracing = median(job.decoding for job in found), median(job.tracing for job in found)
    return JobTimes(rest + decoding + tracing, decoding, tracing, median(job.archiving for job in found))


def job_times(folder: Path, jobs: int = JOBS) -> JobTimes:
    """The median job but for a first one, which warms up; the folder is left empty."""
    try:
        return median_job(asyncio.run(in_turn(folder, jobs + 1))[1:])
    finally:
        shutil.rmtree(folder, ignore_errors=True)
