"""The daemon: its parts as tasks, the camera kept open, stopped in order."""

from __future__ import annotations

import asyncio
import logging
import signal
import threading
from collections.abc import Awaitable, Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from drivers.camera import Camera
from service.daemon.control import ControlServer
from service.daemon.control_triggers import ControlTriggers
from service.daemon.lock import Held, LockError
from service.daemon.missed_watch import MissedWatch
from service.daemon.opening import DiskRefuses, Opening
from service.daemon.operations import CONTROL_PART, LINK_PART, Halt, Operations
from service.daemon.reload import Reloader
from service.daemon.storage_watch import StorageWatch
from service.daemon.supervisor import Supervisor
from service.daemon.systemd import Notifier, Watchdog
from service.jobs.camera_watch import CameraWatch, camera_is_being_opened
from service.jobs.executor import Executor
from service.jobs.health import Fault, Health
from service.jobs.trigger_queue import Ticket, TriggerRefused
from service.jobs.triggers import SerialTrigger
from service.link.link import Link
from service.poll_timing import until_beat
from service.reasons import Reason
from service.records.archive_writer import ArchiveWriter
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.state import State

log = logging.getLogger("combtrace.daemon")

JOURNAL_RETRY_S = 1.0
WATCH_PERIOD_S = 0.25
TELL_AFTER_S = 1.0
STOP_BOUND_S = 8.0  # for the running job
THREADS_END_S = 2.0


class Closeable(Protocol):
    """What is let go at the end."""

    def close(self) -> None:
        """Let it go."""


class Telemetry(Closeable, Protocol):
    """What tells a broker; `service.telemetry.sender.Sender`."""

    def start(self) -> None:
        """Begin."""


class Served(Protocol):
    """What is served beside the jobs: the operator's page, OPC UA."""

    async def run(self, operations: Operations) -> None:
        """Serve it for ever."""


@dataclass
class Parts:
    """What wiring built from a configuration."""

    camera: Camera
    journal: Journal
    health: Health
    executor: Executor
    link: Link | None
    pool: ThreadPoolExecutor
    lock: Held
    triggers: list[tuple[str, Callable[[], Awaitable[None]]]] = field(default_factory=list)
    ports: list[str] = field(default_factory=list)
    serial_pool: ThreadPoolExecutor | None = None
    lines: list[SerialTrigger] = field(default_factory=list)
    warm_up_s: float = 0.0
    rehearse: Callable[[], None] = lambda: None  # before the first job, beside the start
    notifier: Notifier = field(default_factory=Notifier)
    watchdog: Watchdog = field(default_factory=lambda: Watchdog(Notifier({})))
    archive: ArchiveWriter | None = None
    storage: StorageWatch | None = None
    missed: MissedWatch | None = None
    reloader: Reloader | None = None
    metrics: Closeable | None = None
    telemetry: Telemetry | None = None
    page: Served | None = None
    opcua: Served | None = None
    state_dir: Path | None = None
    opening: Opening | None = None  # a disk refuses writes: all that is to be done is to wait until this succeeds
    begin_anew: bool = False  # it did: the parts have ended, to be built as they should be


class Daemon:
    """Runs the parts until it is stopped, or, with `once`, until one manual trigger has come to its end."""

    def __init__(self, parts: Parts, *, on_stop: Callable[[], None] = lambda: None) -> None:
        """on_stop: called when the end is asked for."""
        self._parts = parts
        self._on_stop = on_stop
        self._stop = asyncio.Event()
        self._asked_to_stop = False
        self.supervisor = Supervisor(parts.health, feed_watchdog=parts.watchdog.feed)
        self.abandoned = False  # a call that hangs was left behind: the process must not wait for its thread

    def stop(self) -> None:
        """Ask for the end: no new trigger, the running job gets a bounded time."""
        if not self._asked_to_stop:
            self._on_stop()
        self._asked_to_stop = True
        self._stop.set()

    async def run(self, *, on_signals: Iterable[signal.Signals] = ()) -> None:
        """Run until `stop` or a signal; SIGHUP has the configuration read again."""
        reloader = self._parts.reloader
        if reloader is not None:
            asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, reloader.ask)
        for number in on_signals:
            asyncio.get_running_loop().add_signal_handler(number, self.stop)
        self._ports_are_being_opened()
        self._add_control()
        notifier = self._parts.notifier
        self._parts.health.listen(lambda state, reason: notifier.send(STATUS=_status(state, reason)))
        keeping = self._start(self._parts.triggers, once_open=self._parts.rehearse)
        notifier.send(READY=1, STATUS=_status(self._parts.health.state, self._parts.health.reason))
        try:
            await self._stopped_or_dead(keeping)
            if self._asked_to_stop:
                notifier.send(STOPPING=1)
                await self._let_the_job_end()
        finally:
            await self._end(keeping)

    async def run_once(self, ready_timeout_s: float, *, on_signals: Iterable[signal.Signals] = ()) -> Job:
        """The settled job of one immediate manual trigger; raise TriggerRefused where it is not taken in time."""
        for number in on_signals:
            asyncio.get_running_loop().add_signal_handler(number, self.stop)
        self._parts.executor.ignore_controller()
        keeping = self._start([])
        try:
            ticket = await self._submit_when_ready(ready_timeout_s)
            job = await self._settled_or_dead(ticket, keeping)
            if self._parts.link is not None:
                await self._parts.link.flush(1.0)
            return job
        finally:
            await self._end(keeping)

    def _ports_are_being_opened(self) -> None:
        for port in self._parts.ports:
            opening = Fault(Reason.NOT_READY, f"{port} is being opened", starting=True)
            self._parts.health.report(f"serial {port}", opening)

    def _add_control(self) -> None:
        parts = self._parts
        if parts.state_dir is None:
            return
        operations = Operations(
            parts.health, parts.executor, self.supervisor, Halt(parts.state_dir), self._before_reset
        )
        triggers = ControlTriggers(parts.executor, parts.journal)
        server = ControlServer(parts.state_dir, operations.commands(), triggers.streams())
        self.supervisor.add(CONTROL_PART, server.run)
        for name, served in (("page", parts.page), ("opcua", parts.opcua)):
            if served is not None:
                self.supervisor.add(name, partial(served.run, operations))

    def _before_reset(self) -> None:
        self._ports_are_being_opened()
        camera_is_being_opened(self._parts.health)

    # --- parts --------------------------------------------------------------------------------------------------

    def _start(
        self,
        triggers: Iterable[tuple[str, Callable[[], Awaitable[None]]]],
        *,
        once_open: Callable[[], None] = lambda: None,
    ) -> asyncio.Task[None]:
        parts = self._parts
        watch = CameraWatch(
            parts.camera,
            parts.pool,
            parts.health,
            warm_up_s=parts.warm_up_s,
            feed_watchdog=partial(parts.watchdog.feed, "camera"),
            once_open=once_open,
        )
        watch.start()
        add = self.supervisor.add
        add("camera", watch.run)
        add("journal", self._watch_journal)
        add("jobs", parts.executor.run)
        watched = ["camera", "jobs"]
        for name, run in triggers:
            add(name, run)
            watched += [name] if name.startswith("serial") else []
        if parts.storage is not None:
            add("storage", parts.storage.run)
        if parts.missed is not None:
            add("missed triggers", parts.missed.run)
        if parts.reloader is not None:
            add("reload", parts.reloader.run)
        if parts.archive is not None:
            parts.archive.start()
        if parts.telemetry is not None:
            parts.telemetry.start()
        if parts.link is not None:
            add(LINK_PART, parts.link.run)
            add("link watch", partial(self._watch_link, parts.link))
            watched.append("link")
            self._report_link(parts.link)
        parts.watchdog.watch(watched)
        halted = Halt(parts.state_dir).reason() if parts.state_dir is not None else None
        parts.health.start()
        if halted is not None:
            parts.health.halt(f"halted: {halted}. `combtrace resume` ends it")
        return asyncio.create_task(self.supervisor.run())

    async def _watch_journal(self) -> None:
        """Try the journal again after it could not be written; until then no trigger is taken."""
        parts = self._parts
        if parts.opening is not None:
            await self._wait_for_disk(parts.opening)
        while True:
            if parts.health.fault("journal") is not None and parts.health.job is None:
                try:
                    await asyncio.to_thread(parts.journal.probe)
                except JournalError as error:
                    log.debug("journal: %s", error)
                else:
                    parts.health.report("journal", None)
            await asyncio.sleep(until_beat(asyncio.get_running_loop().time(), JOURNAL_RETRY_S))

    async def _wait_for_disk(self, opening: Opening) -> None:
        """Try until there are locks and a journal; then have the parts end, which did without. Never returns."""
        while not self._stop.is_set():
            await asyncio.sleep(until_beat(asyncio.get_running_loop().time(), JOURNAL_RETRY_S))
            try:
                await asyncio.to_thread(opening.journal)
            except DiskRefuses as refused:
                fault = refused.fault
            except (LockError, JournalError) as error:
                fault = Fault(Reason.INTERNAL_ERROR, str(error))
            else:
                log.info("the disk accepts writes: beginning anew")
                self._stop.set()
                break
            self._parts.health.report("journal", fault)
        await asyncio.Event().wait()

    async def _watch_link(self, link: Link) -> None:
        """Let health follow the link: some faults show by silence, so looking at each reply would not find them."""
        while True:
            self._report_link(link)
            await asyncio.sleep(until_beat(asyncio.get_running_loop().time(), WATCH_PERIOD_S))

    def _report_link(self, link: Link) -> None:
        fault = link.fault()
        found = None if fault is None else Fault(link.fault_reason, fault, starting=link.starting)
        self._parts.health.report("controller", found)
        self._parts.executor.wake()

    # --- ends ---------------------------------------------------------------------------------------------------

    async def _submit_when_ready(self, ready_timeout_s: float) -> Ticket:
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + ready_timeout_s
        told_at = loop.time() + TELL_AFTER_S
        while True:
            why_not = self._parts.link.controller_not_ready() if self._parts.link else None
            ready = self._parts.health.state is State.READY and why_not is None
            if not ready and loop.time() >= told_at:
                fault = self._parts.health.first()
                log.warning("waiting up to %g s to be ready: %s", ready_timeout_s, fault.text if fault else why_not)
                told_at = give_up_at + TELL_AFTER_S
            if ready or loop.time() >= give_up_at or self._parts.health.state is State.HALTED:
                return await self._parts.executor.submit(TriggerStamp("manual"))
            if self._stop.is_set():
                raise TriggerRefused(Reason.ABORTED, "stopped before the service was ready")
            await asyncio.sleep(WATCH_PERIOD_S / 5)

    async def _settled_or_dead(self, ticket: Ticket, keeping: asyncio.Task[None]) -> Job:
        stop = asyncio.ensure_future(self._stop.wait())
        try:
            waiting: list[asyncio.Future[Any]] = [ticket.settled, stop, keeping]
            await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        finally:
            stop.cancel()
        _raise_if_dead(keeping)
        if not ticket.settled.done():
            await self._let_the_job_end()
        if not ticket.settled.done():
            raise TriggerRefused(Reason.ABORTED, f"stopped; job {ticket.job.job_id} is settled by the next start")
        return ticket.settled.result()

    async def _stopped_or_dead(self, keeping: asyncio.Task[None]) -> None:
        stop = asyncio.ensure_future(self._stop.wait())
        try:
            await asyncio.wait([stop, keeping], return_when=asyncio.FIRST_COMPLETED)
        finally:
            stop.cancel()
        _raise_if_dead(keeping)

    async def _let_the_job_end(self) -> None:
        """Give the running job its bounded time; what is sent and not decided by then stays in flight."""
        log.info("stopping")
        self._parts.health.halt("the service is being stopped")
        self._parts.executor.refuse_all_queued(TriggerRefused(Reason.ABORTED, "the service is being stopped"))
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + STOP_BOUND_S
        while self._job_is_running_or_told() and loop.time() < give_up_at:
            await asyncio.sleep(WATCH_PERIOD_S / 5)

    def _job_is_running_or_told(self) -> bool:
        return self._parts.health.job is not None or any(line.telling for line in self._parts.lines)

    async def _end(self, keeping: asyncio.Task[None]) -> None:
        parts = self._parts
        if parts.health.state is not State.HALTED:
            parts.health.halt(
                "the service is being stopped" if parts.opening is None else "its disk is waited for no longer"
            )
        if parts.link is not None and parts.link.fault() is None:
            await parts.link.flush(1.0)
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        if await self._freed(parts.pool, "camera"):
            parts.camera.close()
        if parts.serial_pool is not None:
            await self._freed(parts.serial_pool, "serial port")
        for told in (parts.metrics, parts.telemetry):
            if told is not None:
                await asyncio.to_thread(told.close)
        if parts.archive is not None:
            await self._freed(parts.archive.drafting, "archive's disk")
            await asyncio.to_thread(parts.archive.close)
        parts.journal.close()
        parts.begin_anew = parts.opening is not None and not self._asked_to_stop
        if not parts.begin_anew:
            parts.lock.release()

    async def _freed(self, pool: ThreadPoolExecutor, what: str) -> bool:
        """True once the pool's threads have ended; one that hangs in a call is left behind, and told."""
        ender = threading.Thread(target=pool.shutdown, kwargs={"cancel_futures": True}, daemon=True)
        ender.start()
        loop = asyncio.get_running_loop()
        give_up_at = loop.time() + THREADS_END_S
        while ender.is_alive():
            if loop.time() >= give_up_at:
                log.error("a call to the %s has not returned for %g s; ending without it", what, THREADS_END_S)
                self.abandoned = True
                return False
            await asyncio.sleep(WATCH_PERIOD_S / 25)
        return True


def _status(state: State, reason: str | None) -> str:
    """The state as systemd shows it."""
    return state.label if reason is None else f"{state.label}: {reason}"


def _raise_if_dead(keeping: asyncio.Task[None]) -> None:
    """Raise what ended the supervisor: it outlives every part, so that is a defect of its own."""
    if keeping.done():
        keeping.result()
        raise RuntimeError("the supervisor ended, expected it to run for ever. Report it with the log")
