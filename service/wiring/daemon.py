"""A configuration becomes the daemon's parts; where one cannot be had, those before it are closed again."""

from __future__ import annotations

import logging
import secrets
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from drivers.camera import Camera
from drivers.controller import Controller
from service.config.config import Config
from service.config.controllers import NoController
from service.config.triggers import ControllerTrigger
from service.daemon.daemon import Parts
from service.daemon.lock import LockError
from service.daemon.missed_watch import MissedWatch
from service.daemon.opening import DiskRefuses, Opening, stand_in
from service.daemon.reload import Reloader
from service.daemon.storage_watch import StorageLimits, StorageWatch
from service.daemon.systemd import Notifier, Watchdog
from service.export.recipe_exports import trial
from service.jobs.cycle import Cycle
from service.jobs.cycle_terms import Devices, Observation, Records
from service.jobs.executor import Executor, Intake
from service.jobs.health import Fault, Health, journal_fault
from service.jobs.rehearsal import rehearse
from service.jobs.trigger_queue import TriggerQueue
from service.link.link import Link, LinkSettings
from service.link.transfer_terms import TransferCounter
from service.measuring.measure import Measurer
from service.records.archive import Archive, ArchiveLimits
from service.records.archive_writer import ArchiveWriter
from service.records.evidence import KeepsNothing
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.state import State, StateMachine
from service.wiring.bounds import cycle_settings
from service.wiring.devices import controller_names, make_camera, make_controller
from service.wiring.errors import WiringError
from service.wiring.plan import make_plan, plan_of, sound_plan
from service.wiring.remnants import remnants_keeper
from service.wiring.servers import add_metrics, add_opcua, add_page, add_telemetry
from service.wiring.triggers import add_triggers

log = logging.getLogger("combtrace.daemon")


@dataclass(frozen=True)
class StandIns:
    """What stands in the place of camera and tracing, and who is told of all that the controller is told."""

    camera: Camera
    measurer: Measurer
    listen: Callable[[Controller], Controller] = lambda controller: controller


def build(
    config: Config,
    *,
    path: Path | None = None,
    observe: Callable[[Observation], None] = lambda _observation: None,
    stand_ins: StandIns | None = None,
    opening: Opening | None = None,
) -> Parts:
    """The daemon's parts; raise WiringError, with nothing left open. Must be called in the event loop's thread.

    path: the configuration's file, to be read again when asked; None = never.
    opening: of this configuration; while its disk refuses writes the parts are those of a service that only tells so,
    and ends once they can be built anew. None = that is an error.
    """
    if stand_ins is None:
        (plan, calibration_fault), camera = make_plan(config), make_camera(config)
    else:
        plan, calibration_fault, camera = plan_of(stand_ins.measurer, config), None, stand_ins.camera
    listen = stand_ins.listen if stand_ins else lambda controller: controller
    with ExitStack() as opened:
        held, journal, refused = _make_journal(config, opening, opened)
        notifier = Notifier()
        watchdog = Watchdog(notifier)
        link = None if refused else _make_link(config, listen, partial(watchdog.feed, "link"))
        health = Health(StateMachine(_publisher(link)))
        health.report("calibration", calibration_fault)
        health.report("journal", refused.fault if refused else _not_written(journal))
        pool = ThreadPoolExecutor(1, "camera")
        opened.callback(pool.shutdown)
        archive = _make_archive(config, journal, opened)
        _tell_exports(config)
        devices = Devices(camera, pool, link, TransferCounter(secrets.randbelow(0xFFFF) + 1))
        records = Records(journal, health, archive or KeepsNothing(), observe)
        cycle = Cycle(devices, records, plan, cycle_settings(config), feed_watchdog=partial(watchdog.feed, "jobs"))
        executor = _make_executor(config, records, cycle, link, watchdog)
        parts = Parts(camera, journal, health, executor, link, pool, held, notifier=notifier, watchdog=watchdog)
        parts.opening = held if refused else None
        parts.state_dir = config.service.state_dir
        parts.archive = archive
        limits = StorageLimits(config.journal.min_free_bytes, config.journal.max_jobs)
        parts.storage = StorageWatch(journal, config.journal.path, health, archive, limits)
        parts.missed = None if refused else MissedWatch(journal, executor.counts)
        parts.warm_up_s = getattr(config.camera, "warm_up_s", 0.0)
        if stand_ins is None:
            parts.rehearse = rehearse
        if path is not None:
            parts.reloader = Reloader(path, config, health, sound_plan, cycle)
        add_triggers(config, parts, opened)
        add_metrics(config, parts, cycle, opened)
        add_telemetry(config, parts, cycle, opened)
        add_opcua(config, parts, cycle, opened)
        add_page(config, parts, cycle)
        opened.pop_all()
    return parts


def opening_of(config: Config) -> Opening:
    """What takes the configuration's locks and opens its journal."""
    names = partial(controller_names, config)
    return Opening(config.service.state_dir, config.journal.path, config.archive.path, names)


def _make_journal(
    config: Config, opening: Opening | None, opened: ExitStack
) -> tuple[Opening, Journal, DiskRefuses | None]:
    """The locks and the journal, or one that stands in for it while a disk refuses writes, and what it refused."""
    held = opening or opening_of(config)
    opened.callback(held.release)
    try:
        return held, held.journal(), None
    except DiskRefuses as refused:
        if opening is None:
            raise WiringError(str(refused)) from refused
        journal = stand_in()
        opened.callback(journal.close)
        return held, journal, refused
    except (LockError, JournalError) as error:
        raise WiringError(str(error)) from error


def _make_executor(config: Config, records: Records, cycle: Cycle, link: Link | None, watchdog: Watchdog) -> Executor:
    queue = TriggerQueue(config.service.queue_depth, cycle_settings(config).lifetime_s)
    intake = Intake(any(isinstance(trigger, ControllerTrigger) for trigger in config.triggers), queue)
    try:
        return Executor(
            records.journal, cycle, records.health, link, intake, feed_watchdog=partial(watchdog.feed, "jobs")
        )
    except JournalError as error:
        raise WiringError(str(error)) from error


def _tell_exports(config: Config) -> None:
    """Warn at the start of exports that every job would miss; that keeps no job from being done."""
    for recipe in config.recipes:
        if recipe.exports:
            for text in trial(recipe):
                log.warning("recipe %d will not be exported: %s", recipe.number, text)


def _make_archive(config: Config, journal: Journal, opened: ExitStack) -> ArchiveWriter | None:
    settings = config.archive
    if not settings.max_bytes:
        return None
    limits = ArchiveLimits(settings.max_bytes, settings.min_free_bytes)
    in_flight = [job.job_id for job in journal.unsettled()]
    last = journal.last_taken()
    archive = ArchiveWriter(Archive(settings.path, limits), journal.find, in_flight, last.job_id if last else 0)
    opened.callback(archive.close)
    if config.remnants is not None:
        archive.keep_remnants = remnants_keeper(config.remnants)
    return archive


def _not_written(journal: Journal) -> Fault | None:
    """The fault of a journal that can be read and, as on a full disk, not be written."""
    try:
        journal.probe()
    except JournalError as error:
        return journal_fault(error)
    return None


def _make_link(
    config: Config, listen: Callable[[Controller], Controller], feed_watchdog: Callable[[], None]
) -> Link | None:
    controller = make_controller(config)
    if controller is None or isinstance(config.controller, NoController):
        return None
    settings = config.controller
    return Link(
        listen(controller),
        LinkSettings(
            settings.handshake == "full",
            settings.poll_period_s,
            settings.heartbeat_timeout_s,
            observe=settings.mode == "observe",
        ),
        feed_watchdog=feed_watchdog,
    )


def _publisher(link: Link | None) -> Callable[[State, str | None], None]:
    def publish(state: State, _reason: str | None) -> None:
        if link is not None:
            link.publish(service_state=int(state))

    return publish
