"""A look has the camera only while no job wants it, and waits for nobody who has gone."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import pytest

from drivers.camera import CameraTimeout, Frame, FrameUnusable
from drivers.camera.simulated import SimulatedCamera
from service.config.recipes import Recipe
from service.jobs.cycle_terms import Plan
from service.jobs.spare_camera import LookSources, NobodyLooks, SpareCamera
from service.measuring.measure import Measurer

EMPTY = np.full((120, 150), 25, np.uint8)
PLAN = Plan(Measurer(None), {1: Recipe(number=1, name="default")})


@dataclass
class Daemon:
    """What of a daemon a look sees."""

    camera: SimulatedCamera
    pool: ThreadPoolExecutor
    idle: bool = True
    works: bool = True
    wanted: int = 1000  # questions whether anybody looks that are answered by yes
    slept: list[float] = field(default_factory=list)

    def spare(self) -> SpareCamera:
        sources = LookSources(
            self.camera, self.pool, lambda: self.idle, lambda: self.works, lambda: PLAN, timeout_s=1.0, spare=True
        )
        return SpareCamera(sources, self._wanted, sleep=self._sleep)

    def _wanted(self) -> bool:
        self.wanted -= 1
        return self.wanted >= 0

    def _sleep(self, duration_s: float) -> None:
        self.slept.append(duration_s)


@pytest.fixture
def daemon() -> Iterator[Daemon]:
    camera = SimulatedCamera(lambda _sequence: EMPTY)
    camera.open()
    with ThreadPoolExecutor(1) as pool:
        yield Daemon(camera, pool)


def test_between_jobs_it_gives_frames_exposed_after_they_were_asked_for(daemon: Daemon) -> None:
    before = time.monotonic()
    frame = daemon.spare().grab(0.0, 1.0)
    assert frame.exposed_at_s >= before
    assert daemon.slept == []


@pytest.mark.parametrize("hindrance", ["idle", "works"])
def test_while_a_job_runs_or_the_camera_is_away_it_takes_no_frame(daemon: Daemon, hindrance: str) -> None:
    setattr(daemon, hindrance, False)
    daemon.wanted = 5
    with pytest.raises(NobodyLooks):
        daemon.spare().grab(0.0, 1.0)
    assert len(daemon.slept) == 5
    assert daemon.camera.grab(0.0, 1.0).sequence == 1


def test_a_look_that_waits_behind_a_jobs_first_step_gives_up_its_turn(daemon: Daemon) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def first_step() -> None:
        begun.set()
        go_on.wait(60)
        daemon.idle = False

    step = daemon.pool.submit(first_step)
    assert begun.wait(60)
    daemon.wanted = 1
    look: list[type[BaseException]] = []

    def grab() -> None:
        try:
            daemon.spare().grab(0.0, 1.0)
        except NobodyLooks as error:
            look.append(type(error))

    thread = threading.Thread(target=grab)
    thread.start()
    while daemon.pool._work_queue.qsize() == 0:
        time.sleep(0.01)
    go_on.set()
    thread.join(60)
    step.result()
    assert look == [NobodyLooks]
    assert daemon.camera.grab(0.0, 1.0).sequence == 1


def test_a_camera_that_fails_is_asked_again_after_a_pause_and_its_trouble_told_meanwhile(
    daemon: Daemon, monkeypatch: pytest.MonkeyPatch
) -> None:
    spare, plain, told = daemon.spare(), daemon.camera.grab, list[str | None]()

    def failing(exposed_after_s: float, timeout_s: float) -> Frame:
        told.append(spare.trouble)
        if len(told) < 3:
            raise CameraTimeout(f"silent {len(told)}")
        return plain(exposed_after_s, timeout_s)

    monkeypatch.setattr(daemon.camera, "grab", failing)
    assert spare.grab(0.0, 1.0).sequence == 1
    assert told == [None, "silent 1", "silent 2"]
    assert (len(daemon.slept), spare.trouble) == (2, None)


def test_a_frame_that_cannot_be_used_is_a_look_of_its_own(daemon: Daemon, monkeypatch: pytest.MonkeyPatch) -> None:
    def unusable(_exposed_after_s: float, _timeout_s: float) -> Frame:
        raise FrameUnusable("torn")

    monkeypatch.setattr(daemon.camera, "grab", unusable)
    with pytest.raises(FrameUnusable, match="torn"):
        daemon.spare().grab(0.0, 1.0)


def test_with_the_daemon_the_looks_end(daemon: Daemon) -> None:
    daemon.pool.shutdown()
    with pytest.raises(NobodyLooks):
        daemon.spare().grab(0.0, 1.0)
