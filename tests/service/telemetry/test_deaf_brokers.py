"""Brokers that are none, or not well: nothing of the cell changes, and the next sound one is told all."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import pytest

from service.state import State
from tests.support.interop.false_broker import NONSENSE, FalseBroker
from tests.support.processes.wired_daemon import wired
from tests.support.service.waiting import until

ROOT = Path(__file__).parents[3]
NO_CONTROLLER = {"kind": "none"}
OFF = """
import asyncio, sys, threading
from pathlib import Path
from tests.support.processes.wired_daemon import wired
async def main():
    async with wired(Path(sys.argv[1]), {"kind": "none"}, triggers=[]) as cell:
        await cell.job()
        print(sorted(name for name in sys.modules if name.startswith(("paho", "service.telemetry."))))
        print([one.name for one in threading.enumerate() if one.name == "telemetry"])
asyncio.run(main())
"""


@pytest.mark.parametrize("said", NONSENSE)
async def test_whatever_a_broker_says_jobs_go_on_and_a_stop_waits_for_nobody(said: str, tmp_path: Path) -> None:
    broker = FalseBroker(*NONSENSE[said])
    try:
        settings = {"triggers": [], "telemetry": {"port": broker.port, "node": "cell-1"}}
        async with wired(tmp_path, NO_CONTROLLER, **settings) as cell:
            await until(lambda: broker.calls > 0)
            jobs = [await cell.job() for _ in range(3)]
            assert [str(job.outcome) for job in jobs] == ["written"] * 3
            assert cell.parts.health.state is State.READY
            assert cell.parts.health.faults() == {}
            assert "telemetry" in [thread.name for thread in threading.enumerate()]
    finally:
        broker.close()


def test_without_telemetry_nothing_of_it_is_loaded_and_no_thread_runs(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", OFF, str(tmp_path)], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.stdout.splitlines() == ["['service.telemetry.sources']", "[]"], done.stderr
