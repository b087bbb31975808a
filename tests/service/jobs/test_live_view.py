"""Each look is what a job would see in its frame, and what cannot be looked at is told and goes no further."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Iterator
from itertools import islice
from multiprocessing import active_children
from threading import Timer

import numpy as np
import pytest

from contour.image.picture_figures import picture_figures
from drivers.camera import CameraUnavailable, FrameUnusable, SceneMoved
from drivers.camera.simulated import SimulatedCamera
from service.config.plain_recipe import PlainRecipe
from service.jobs.live_view import LiveView, Sight
from service.jobs.rehearsal import drawn_comb
from service.measuring.measure import Measurer
from service.reasons import Reason
from service.worker import WorkerEnded

EMPTY = np.full((120, 150), 25, np.uint8)
FAST_HZ = 1000.0


@pytest.fixture(scope="module")
def view() -> Iterator[LiveView]:
    with LiveView(Sight(Measurer(None), PlainRecipe(), 0.0), processes=2) as view:
        next(view.looks(opened(moved), 1.0, FAST_HZ))  # threads and processes begin with the first look
        yield view


def moved(sequence: int) -> np.ndarray:
    return np.roll(drawn_comb(), sequence, axis=1)


def opened(make_picture) -> SimulatedCamera:
    camera = SimulatedCamera(make_picture)
    camera.open()
    return camera


def test_looks_come_in_the_order_of_their_frames_each_as_a_fresh_trace_of_its_own(view: LiveView) -> None:
    looks = list(islice(view.looks(opened(moved), 1.0, FAST_HZ), 5))
    assert [look.frame.sequence for look in looks] == [1, 2, 3, 4, 5]
    for look in looks:
        fresh = Measurer(None).measure(moved(look.frame.sequence), PlainRecipe(), 0.0)
        np.testing.assert_array_equal(look.measurement.pixels.exterior, fresh.pixels.exterior)
        assert look.measurement.uncertainty_px == fresh.uncertainty_px
        assert look.figures == picture_figures(look.frame.pixels)


def test_no_more_frames_are_taken_than_can_be_looked_at(view: LiveView) -> None:
    taken: list[int] = []
    camera = opened(lambda sequence: taken.append(sequence) or moved(sequence))
    for shown, look in enumerate(islice(view.looks(camera, 1.0, FAST_HZ), 8), 1):
        assert look.frame.sequence == shown
        assert len(taken) - shown <= view.processes  # those that are being measured, and the one that is grabbed


def test_why_a_job_would_refuse_it_is_told_and_the_next_look_goes_on(view: LiveView) -> None:
    pictures = {1: moved(1), 2: EMPTY, 3: np.zeros((4, 4), np.uint8), 4: moved(4)}
    looks = list(islice(view.looks(opened(lambda sequence: pictures.get(sequence, EMPTY)), 1.0, FAST_HZ), 4))
    assert [look.measurement.reasons for look in looks] == [(), (Reason.NO_BLOCK_FOUND,), (Reason.NO_FRAME,), ()]


@pytest.mark.parametrize(("error", "reason"), [(FrameUnusable, Reason.NO_FRAME), (SceneMoved, Reason.SCENE_MOVED)])
def test_a_frame_that_is_no_picture_is_a_look_without_one(view: LiveView, error, reason: Reason) -> None:
    def torn(sequence: int) -> np.ndarray:
        if sequence > 1:
            return moved(sequence)
        camera._sequence += 1
        raise error("torn frame")

    camera = opened(torn)
    first, second = islice(view.looks(camera, 1.0, FAST_HZ), 2)
    assert (first.frame, first.figures, first.measurement.findings) == (None, None, ((reason, "torn frame"),))
    assert second.measurement.pixels is not None


def test_a_camera_that_has_gone_ends_it(view: LiveView) -> None:
    camera = opened(moved)
    looks = view.looks(camera, 1.0, FAST_HZ)
    next(looks)
    camera.close()
    with pytest.raises(CameraUnavailable, match="not open"):
        list(looks)


def test_a_process_that_is_killed_while_it_reads_a_frame_is_told_and_not_waited_for() -> None:
    before = set(active_children())
    with LiveView(Sight(Measurer(None), PlainRecipe(), 0.0), processes=1) as view:
        looks = view.looks(opened(lambda _: np.full((1200, 1600), 25, np.uint8)), 1.0, FAST_HZ)
        next(looks)
        (measures,) = set(active_children()) - before
        os.kill(measures.pid, signal.SIGSTOP)
        Timer(1.0, os.kill, (measures.pid, signal.SIGKILL)).start()  # by then more was sent than a pipe holds
        with pytest.raises(WorkerEnded):
            deque(looks, maxlen=0)
