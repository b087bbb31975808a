"""An executor with a journal, and a controller and a runner that a test moves."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from drivers.controller.mailbox.blocks import LinkBlock, ServiceBlock
from service.jobs.executor import Executor, Intake
from service.jobs.health import Health
from service.link.link import Link, LinkSettings
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, TriggerStamp
from service.records.journal import Journal
from service.state import StateMachine


class HeldRunner:
    """Carries a job out when it is let go."""

    hindered: str | None = None

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.begun: list[int] = []
        self.resumed: list[int] = []
        self.sent: list[int] = []
        self.go = asyncio.Event()
        self.go.set()

    async def run(self, job: Job) -> Job:
        self.begun.append(job.job_id)
        await self.go.wait()
        return self.journal.settle(job.job_id, Outcome.ACCEPTED, None, None, Progress(report={"vertices": 4}))

    def hindrance(self, job: Job) -> str | None:
        return self.hindered

    async def resume(self, job: Job) -> Job:
        self.resumed.append(job.job_id)
        self.sent += [job.job_id] if job.sent else []
        await self.go.wait()
        return self.journal.settle(job.job_id, Outcome.FAILED, Reason.SERVICE_RESTARTED, "sent before")


class DeafController:
    """Stands in where a test sets the link's view itself."""

    connected = True


class Bench:
    """An executor with a real journal and a link whose view the test sets."""

    def __init__(self, folder: Path, *, observe: bool = False) -> None:
        self.journal = Journal(folder / "journal.sqlite")
        self.health = Health(StateMachine())
        self.runner = HeldRunner(self.journal)
        self.link = Link(DeafController(), LinkSettings(observe=observe), now=lambda: 0.0)  # type: ignore[arg-type]
        self.settled: list[Job] = []
        self.executor = Executor(self.journal, self.runner, self.health, self.link, Intake(controller=True))
        self.executor.on_settled.append(self._note)

    def _note(self, job: Job) -> None:
        self.settled.append(job)

    def controller_says(self, **fields: int) -> None:
        values = {"controller_state": 1, "session": 9, "test_echo": 0x01020305, **fields}
        self.link.reading.view = LinkBlock(**values)
        self.link.reading._beat_at_s = 0.0
        self.link.connection._up.set()
        self.link.connection.trouble = None
        self.link.reading.last_job = self.link.reading.view.last_job
        self.link.ownership.saw(ServiceBlock())
        self.link.ownership.wrote()
        self.executor.wake()


@asynccontextmanager
async def running(folder: Path, *, observe: bool = False, counter: int = 0, begun: bool = True) -> AsyncIterator[Bench]:
    """begun: what stands at the controller was seen: nobody has written there."""
    bench = Bench(folder, observe=observe)
    bench.executor._begun = bench.executor._begun or begun
    task = asyncio.ensure_future(bench.executor.run())
    bench.health.start()
    bench.controller_says(trigger_counter=counter)
    await asyncio.sleep(0)
    try:
        yield bench
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        bench.journal.close()


async def by_hand(bench: Bench) -> Job:
    """A job by hand, settled."""
    return await (await bench.executor.submit(TriggerStamp("serial"))).settled


def left_behind(**fields: int) -> ServiceBlock:
    """The service block as a service that ended had left it in session 9."""
    values = {"owner": 4711, "job_id": 70, "settled_job": 70, "trigger_ack": 6, "session_ack": 9, **fields}
    return ServiceBlock(**values)
