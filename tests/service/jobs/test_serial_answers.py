"""Who got an ACK on a serial line hears how the job ended: across restarts, and when the line was away."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from drivers.trigger import TriggerUnavailable
from service.jobs.executor import Executor, Intake
from service.jobs.health import Health
from service.jobs.kept_port import KeptPort
from service.jobs.trigger_queue import TriggerQueue
from service.jobs.triggers import MOST_OWED, SerialTrigger
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, TriggerStamp
from service.records.journal import Journal
from service.records.journal_recovery import open_journal
from service.state import StateMachine
from tests.support.service.journal_files import changed
from tests.support.service.waiting import until

LINE = "/dev/ttyPanel"


class Panel:
    """The port, and the panel at its other end; `plugged` says whether its cable is in."""

    def __init__(self) -> None:
        self.heard: list[str] = []
        self.plugged = True
        self._typed: list[bytes] = []
        self._open = False

    def type(self, text: str) -> None:
        self._typed.append(text.encode())

    def open(self) -> None:
        self._open = self._plugged()

    def read_line(self, timeout_s: float) -> bytes | None:
        self._plugged()
        return self._typed.pop(0) if self._typed else None

    def write_line(self, text: str) -> None:
        self._plugged()
        if not self._open:
            raise TriggerUnavailable("not open")
        self.heard.append(text)

    def close(self) -> None:
        self._open = False

    def _plugged(self) -> bool:
        if not self.plugged:
            raise TriggerUnavailable("no such port")
        return True


class SlowPanel(Panel):
    """A port that takes an end only once it may be written."""

    def __init__(self) -> None:
        super().__init__()
        self.writing = ""
        self.may_write = threading.Event()

    def write_line(self, text: str) -> None:
        self.writing = text
        if text.startswith("DONE"):
            assert self.may_write.wait(30)
        super().write_line(text)


class Runner:
    """Ends jobs as soon as it is let to."""

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.go = asyncio.Event()
        self.go.set()

    async def run(self, job: Job) -> Job:
        await self.go.wait()
        measured = Progress(report={"vertices": 4, "area_mm2": 5000.0})
        return self.journal.settle(job.job_id, Outcome.ACCEPTED, None, None, measured)

    def hindrance(self, _job: Job) -> str | None:
        return None

    async def resume(self, job: Job) -> Job:
        await self.go.wait()
        return self.journal.settle(job.job_id, Outcome.FAILED, Reason.SERVICE_RESTARTED, "nothing of it was sent")


class Served:
    """A serial line with executor and journal, as one process of the service has them."""

    line: SerialTrigger

    def __init__(self, folder: Path, panel: Panel, *, depth: int = 0) -> None:
        self.panel = panel
        self.journal = Journal(folder / "journal.sqlite")
        self.health = Health(StateMachine())
        self.runner = Runner(self.journal)
        queue = TriggerQueue(depth, 60.0)
        self.executor = Executor(self.journal, self.runner, self.health, None, Intake(queue=queue))


@asynccontextmanager
async def served(folder: Path, panel: Panel, *, depth: int = 0, ready: bool = True) -> AsyncIterator[Served]:
    """The line served until the process ends, at which nothing is tidied up."""
    built = Served(folder, panel, depth=depth)
    built.health.start()
    with ThreadPoolExecutor(1) as pool:
        port = KeptPort(panel, LINE, built.health, pool)
        built.line = SerialTrigger(panel, port, built.executor, built.journal, lambda: "STAT")
        built.executor.on_settled.append(built.line.job_ended)
        tasks = [asyncio.ensure_future(built.line.run())]
        if ready:
            tasks.append(asyncio.ensure_future(built.executor.run()))
        try:
            yield built
        finally:
            for task in tasks:
                task.cancel()
            with suppress(asyncio.CancelledError):
                await asyncio.gather(*tasks)
    built.journal.close()


async def heard(panel: Panel, *lines: str) -> None:
    with suppress(AssertionError):
        await until(lambda: len(panel.heard) >= len(lines))
    assert panel.heard == list(lines)


async def test_a_job_is_acknowledged_told_its_end_and_owed_no_more(tmp_path: Path) -> None:
    panel = Panel()
    async with served(tmp_path, panel) as built:
        panel.type("TRIG")
        await heard(panel, "ACK 1", "DONE 1 4 5000")
        await until(lambda: not built.journal.owed(LINE))
    async with served(tmp_path, panel) as built:
        panel.type("TRIG")
        await heard(panel, "ACK 1", "DONE 1 4 5000", "ACK 2", "DONE 2 4 5000")


async def test_a_job_that_was_in_flight_at_a_kill_is_told_its_end_after_the_restart(tmp_path: Path) -> None:
    panel = Panel()
    async with served(tmp_path, panel) as built:
        built.runner.go.clear()
        panel.type("TRIG")
        await heard(panel, "ACK 1")
    async with served(tmp_path, panel):
        await heard(panel, "ACK 1", "FAIL 1 154 service_restarted")


async def test_a_job_that_had_ended_but_was_not_told_is_told_after_the_restart(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    job = journal.take(TriggerStamp("serial", line=LINE))
    journal.settle(job.job_id, Outcome.REFUSED, Reason.NO_BLOCK_FOUND, "empty")
    other = journal.take(TriggerStamp("serial", line="/dev/ttyOther"))
    journal.settle(other.job_id, Outcome.ACCEPTED, None, None)
    journal.settle(journal.take(TriggerStamp("manual")).job_id, Outcome.ACCEPTED, None, None)
    journal.close()
    panel = Panel()
    async with served(tmp_path, panel) as built:
        await heard(panel, "FAIL 1 110 no_block_found")
        await until(lambda: not built.journal.owed(LINE))
        assert [owed.job_id for owed in built.journal.owed("/dev/ttyOther")] == [2], "that line's own"


async def test_what_ended_while_the_line_was_away_is_told_when_it_is_back(tmp_path: Path) -> None:
    panel = Panel()
    async with served(tmp_path, panel) as built:
        built.runner.go.clear()
        panel.type("TRIG")
        await heard(panel, "ACK 1")
        panel.plugged = False
        await until(lambda: built.health.fault(f"serial {LINE}"))
        built.runner.go.set()
        await until(lambda: built.journal.owed(LINE))
        panel.plugged = True
        await heard(panel, "ACK 1", "DONE 1 4 5000")


async def test_of_very_many_ends_only_the_newest_are_told_and_the_log_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    for _ in range(MOST_OWED + 3):
        journal.settle(journal.take(TriggerStamp("serial", line=LINE)).job_id, Outcome.ACCEPTED, None, None)
    journal.close()
    panel = Panel()
    async with served(tmp_path, panel) as built:
        await until(lambda: len(panel.heard) == MOST_OWED and not built.journal.owed(LINE))
    assert panel.heard[0] == "DONE 4 0 0"
    assert "3 ends are not told any more, of jobs 1 to 3" in caplog.text


async def test_a_trigger_that_waited_hears_its_acknowledgement_before_its_end(tmp_path: Path) -> None:
    panel = Panel()
    async with served(tmp_path, panel, depth=2) as built:
        built.runner.go.clear()
        for _ in range(3):
            panel.type("TRIG")
        await heard(panel, "ACK 1", "WAIT 1", "WAIT 2")
        built.runner.go.set()
        await until(lambda: len(panel.heard) == 8)
        for job in (1, 2, 3):
            assert panel.heard.index(f"ACK {job}") < panel.heard.index(f"DONE {job} 4 5000")


async def test_the_end_never_comes_before_the_acknowledgement(tmp_path: Path) -> None:
    """The line is slow to take the ACK, and the job is over at once."""
    panel, over = Panel(), threading.Event()
    write = panel.write_line

    def slow(text: str) -> None:
        if text.startswith("ACK"):
            assert over.wait(60)
            time.sleep(0.1)
        write(text)

    panel.write_line = slow  # type: ignore[method-assign]
    async with served(tmp_path, panel) as built:
        built.executor.on_settled.append(lambda _job: over.set())
        panel.type("TRIG")
        await heard(panel, "ACK 1", "DONE 1 4 5000")


async def test_jobs_of_a_damaged_journal_are_owed_to_their_line_still(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    journal.take(TriggerStamp("serial", line=LINE))
    journal.close()
    changed(path, "UPDATE meta SET value = 'none' WHERE key = 'owner'")
    open_journal(path, tmp_path / "archive", ran_before=True).close()
    panel = Panel()
    async with served(tmp_path, panel):
        await heard(panel, "FAIL 1 154 service_restarted")


async def test_an_end_that_is_being_told_is_known_to_be(tmp_path: Path) -> None:
    panel = SlowPanel()
    async with served(tmp_path, panel) as built:
        panel.type("TRIG")
        await until(lambda: panel.writing == "DONE 1 4 5000")
        assert built.health.job is None
        assert built.line.telling
        panel.may_write.set()
        await until(lambda: not built.line.telling)
        assert panel.heard == ["ACK 1", "DONE 1 4 5000"]


async def test_a_line_that_is_away_is_not_waited_for(tmp_path: Path) -> None:
    panel = Panel()
    async with served(tmp_path, panel) as built:
        built.runner.go.clear()
        panel.type("TRIG")
        await heard(panel, "ACK 1")
        panel.plugged = False
        built.runner.go.set()
        await until(lambda: built.journal.owed(LINE) and not built.line.telling)
