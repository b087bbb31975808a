from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from drivers.camera import CameraUnavailable
from service.jobs.camera_watch import CHECK_S, RETRY_S, CameraWatch
from service.jobs.health import Fault, Health
from service.reasons import Reason
from service.state import State, StateMachine


class PluggedCamera:
    """A camera that is there while it is plugged in."""

    def __init__(self):
        self.plugged = True
        self.is_open = False
        self.opened_times = 0

    def open(self):
        if not self.plugged:
            raise CameraUnavailable("cam0: no such device")
        self.is_open = True
        self.opened_times += 1

    def check(self):
        if not (self.plugged and self.is_open):
            raise CameraUnavailable("cam0: has gone")

    def close(self):
        self.is_open = False


class Bench:
    """A watch over such a camera, on a clock that the test turns."""

    def __init__(self, **options):
        self.now_s = 50.0
        self.camera = PluggedCamera()
        self.health = Health(StateMachine(lambda _state, _reason: None))
        self.pool = ThreadPoolExecutor(1)
        self.watch = CameraWatch(self.camera, self.pool, self.health, now=lambda: self.now_s, **options)
        self.watch.start()
        self.health.start()

    async def run(self, seconds, step=0.1):
        """Look as the daemon would for some time."""
        for _ in range(round(seconds / step)):
            await self.watch.look()
            self.now_s += step
        return self.health.state


@pytest.fixture
def bench(request):
    made = Bench(**getattr(request, "param", {}))
    yield made
    made.pool.shutdown()


async def test_a_camera_is_opened_at_the_start_and_the_service_is_ready(bench):
    assert bench.health.state is State.INITIALIZED
    assert await bench.run(0.1) is State.READY


async def test_an_idle_camera_that_is_unplugged_leads_to_error_and_back_to_ready(bench):
    await bench.run(1.0)
    bench.camera.plugged = False
    assert await bench.run(CHECK_S + 0.2) is State.ERROR
    assert bench.health.fault("camera").reason is Reason.NO_FRAME
    await bench.run(10.0)
    bench.camera.plugged = True
    assert await bench.run(RETRY_S + 0.2) is State.READY
    assert bench.camera.is_open


async def test_a_fault_that_a_job_found_is_followed_by_opening_anew(bench):
    await bench.run(1.0)
    bench.health.report("camera", Fault(Reason.NO_FRAME, "cam0: silent"))
    before = bench.camera.opened_times
    assert await bench.run(RETRY_S + 0.2) is State.READY
    assert bench.camera.opened_times == before + 1


async def test_nothing_is_asked_of_the_camera_while_a_job_has_it(bench):
    await bench.run(1.0)
    bench.health.executing(7)
    bench.camera.plugged = False
    await bench.run(10.0)
    assert bench.health.fault("camera") is None


@pytest.mark.parametrize("bench", [{"warm_up_s": 60.0}], indirect=True)
async def test_a_cold_camera_warms_up_before_the_service_is_ready(bench):
    assert await bench.run(59.0) is State.INITIALIZED
    assert bench.health.first().text == "the camera warms up for 60 s"
    assert await bench.run(1.5) is State.READY


@pytest.mark.parametrize("bench", [{"warm_up_s": 60.0}], indirect=True)
async def test_a_camera_that_was_away_shortly_warms_up_shortly(bench):
    await bench.run(61.0)
    bench.camera.plugged = False
    await bench.run(10.0)
    bench.camera.plugged = True
    assert await bench.run(5.0) is not State.READY
    assert await bench.run(7.0) is State.READY


@pytest.mark.parametrize("bench", [{"warm_up_s": 60.0}], indirect=True)
async def test_a_camera_that_goes_while_it_warms_up_is_an_error_and_is_opened_again(bench):
    await bench.run(10.0)
    bench.camera.plugged = False
    assert await bench.run(CHECK_S + 0.2) is State.ERROR
    bench.camera.plugged = True
    await bench.run(1.0)
    assert bench.camera.is_open


async def test_what_is_done_once_it_is_open_is_not_done_again_when_it_comes_back():
    opened_times = []
    bench = Bench(once_open=lambda: opened_times.append(bench.camera.opened_times))
    await bench.run(2)
    bench.camera.plugged = False
    await bench.run(2)
    bench.camera.plugged = True
    await bench.run(2)
    bench.pool.shutdown()
    assert (opened_times, bench.camera.opened_times) == ([1], 2)
