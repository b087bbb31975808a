"""The suite itself: it finds a wrong controller wrong, moves nothing unless told, and says what it cannot work with."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import threading
import time
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from drivers.controller.simulated.contour import PageCopy
from drivers.controller.simulated.controller import SimulatedController
from service.commissioning.hil.bench import open_bench
from service.commissioning.hil.presence import HEARTBEAT_S, HilError

SERVICE_HEARTBEAT = 18
SERVICE_OWNER = 27
ROOT = Path(__file__).parents[2]


@contextmanager
def controller() -> Iterator[SimulatedController]:
    """A simulated controller in a thread of its own."""
    made = SimulatedController(scan_s=0.005)
    listening, loop = threading.Event(), asyncio.new_event_loop()

    async def serve() -> None:
        async with made:
            listening.set()
            await asyncio.Event().wait()

    def run() -> None:
        task = loop.create_task(serve())
        made.end = task.cancel  # type: ignore[attr-defined]
        made.loop = loop  # type: ignore[attr-defined]
        with suppress(asyncio.CancelledError):
            loop.run_until_complete(task)
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    assert listening.wait(60)
    try:
        yield made
    finally:
        loop.call_soon_threadsafe(made.end)  # type: ignore[attr-defined]
        thread.join()


def suite(port: int, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "tests/hil/test_controller.py", "-p", "no:cacheprovider"]
    return subprocess.run(
        [*command, f"--hil-controller=tcp://127.0.0.1:{port}", *options],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        timeout=120,
        env={**os.environ, "CI": ""},
    )


def test_a_right_controller_passes_and_takes_no_contour_unless_told() -> None:
    with controller() as right:
        done = suite(right.port)
        assert done.returncode == 0, done.stdout
        assert "3 skipped" in done.stdout
        assert right.verdict.accepted == 0
        moved = suite(right.port, "--hil-move", "-k", "whole or once or two_pages")
        assert moved.returncode == 0, moved.stdout
        assert right.verdict.accepted == 2


def test_a_controller_that_does_not_look_at_the_crc_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PageCopy, "crc_is_right", lambda _copy: True)
    with controller() as careless:
        done = suite(careless.port, "-k", "torn or withdrawal")
        assert done.returncode == 1
        assert "test_a_torn_page_is_answered_2[header]" in done.stdout
        assert "test_a_withdrawal_is_answered_11" not in done.stdout.partition("short test summary")[2]
        assert careless.verdict.accepted == 0


def test_a_second_service_that_lives_is_left_alone() -> None:
    with controller() as shared:
        url = f"tcp://127.0.0.1:{shared.port}"
        with open_bench(url, None) as first, pytest.raises(HilError, match="another service"), open_bench(url, None):
            pytest.fail("two benches on one controller")
        assert shared.verdict.clean or set(shared.verdict.counts) <= {"heartbeat-stalled"}
        assert not first.simulated


def test_jobs_begin_a_thousand_above_all_that_is_found_and_none_is_given_twice() -> None:
    with controller() as used:
        url = f"tcp://127.0.0.1:{used.port}"
        with open_bench(url, None) as first:
            last = first.new_job()
            assert first.withdraw(last).link.last_job == last
            first.publish(job_id=last + 7, settled_job=last)
        with open_bench(url, None) as second:
            assert [second.new_job(), second.new_job()] == [last + 7 + 1001, last + 7 + 1002]


def test_where_another_service_comes_in_between_nothing_is_written_over_it() -> None:
    with controller() as shared, open_bench(f"tcp://127.0.0.1:{shared.port}", None) as bench:
        own = shared.registers(SERVICE_OWNER, 1)[0]
        another = own % 0xFFFF + 1
        shared.write_as_another(another, 1)
        with pytest.raises(HilError, match=f"owner {another}"):
            bench.publish(trigger_ack=1)
        time.sleep(3 * HEARTBEAT_S)
        assert shared.registers(SERVICE_OWNER, 1) == (another,)
        shared.write_as_another(own, 1)  # so that the bench can end as it should
        bench.reconnect()


def test_a_value_that_does_not_fit_is_told_and_the_heartbeat_goes_on_without_it() -> None:
    with open_bench(None, None) as bench:
        with pytest.raises(HilError, match="trigger_ack is 70000, expected 0 to 65535"):
            bench.publish(trigger_ack=70_000)
        bench.publish(trigger_ack=7)


def test_a_controller_that_was_switched_off_and_on_is_taken_up_again_when_asked() -> None:
    with controller() as restarted:
        loop = restarted.loop  # type: ignore[attr-defined]

        def switch(what: Coroutine[Any, Any, None]) -> None:
            asyncio.run_coroutine_threadsafe(what, loop).result(10)

        with open_bench(f"tcp://127.0.0.1:{restarted.port}", None) as bench:
            before = bench.link().session
            job = bench.new_job()
            page = bench.first_of_two(job)
            switch(restarted.switch_off())
            with pytest.raises(HilError, match=r"127\.0\.0\.1"):
                bench.link()
            switch(restarted.switch_on())
            assert bench.reconnect().session not in (0, before)
            assert bench.send(page).result == 8, "of the session before"
            assert bench.withdraw(job).result == 11
            beat = restarted.registers(SERVICE_HEARTBEAT, 1)
            for _ in range(1000):
                if restarted.registers(SERVICE_HEARTBEAT, 1) != beat:
                    break
                time.sleep(0.01)
            else:
                pytest.fail("the heartbeat does not go on")


@pytest.mark.parametrize(
    ("url", "told"),
    [
        ("127.0.0.1:502", "expected tcp://HOST:PORT"),
        ("tcp://127.0.0.1:99999", "out of range"),
        ("tcp://127.0.0.1:502?word_order=middle", "word_order"),
        ("tcp://127.0.0.1:502?speed=9", "speed: unknown key"),
        ("rtu://", "port"),
        ("tcp://127.0.0.1:502?mode=observe", "another process writes there"),
    ],
)
def test_a_controller_that_cannot_be_named_so_is_told(url: str, told: str) -> None:
    with pytest.raises(HilError, match=told):
        open_bench(url, None)


def test_a_controller_that_is_not_there_ends_the_suite_with_status_2() -> None:
    done = suite(1)
    assert done.returncode == 2
    assert "hardware in loop: 127.0.0.1:1: no connection" in done.stdout + done.stderr
