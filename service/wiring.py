"""A configuration becomes parts: with the device commands, the only place that names concrete drivers."""

from __future__ import annotations

import importlib.metadata
import logging
import secrets
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contour.calibration.calibration import Calibration
from drivers.camera import Camera
from drivers.camera.averaging import AveragingCamera
from drivers.camera.files.camera import FileCamera
from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from drivers.controller import Controller
from drivers.controller.mailbox.mailbox import MailboxLayout
from drivers.controller.modbus import client as modbus
from drivers.trigger import LineTrigger, PulseTrigger
from drivers.trigger.pulses import SerialBytes, SerialSignal
from drivers.trigger.serial import SerialLineTrigger
from service.config.config import (
    Config,
    ControllerTrigger,
    FilesCamera,
    IntervalTrigger,
    ModbusRtu,
    ModbusRtuOverTcp,
    ModbusTcp,
    NoController,
)
from service.config.config import Metrics as MetricsSettings
from service.config.config import Page as PageSettings
from service.config.config import SerialTrigger as SerialTriggerSettings
from service.daemon.daemon import Parts
from service.daemon.lock import LockError, network_names, serial_name
from service.daemon.opening import DiskRefuses, Opening, stand_in
from service.daemon.reload import BadPlan, Reloader
from service.daemon.storage_watch import StorageLimits, StorageWatch
from service.daemon.systemd import Notifier, Watchdog
from service.export.recipe_exports import trial
from service.jobs.cycle import Cycle, CycleSettings, MailboxFormat, Observation, Plan
from service.jobs.executor import Executor
from service.jobs.health import Fault, Health, journal_fault
from service.jobs.status import status_line
from service.jobs.trigger_queue import TriggerQueue
from service.jobs.triggers import SerialPulses, SerialTrigger, interval_trigger
from service.link.link import Link, LinkSettings
from service.link.transfer import TransferCounter, TransferSettings
from service.measuring.calibration_file import CalibrationChanged, CalibrationFileError, load_record
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer
from service.measuring.table_file import TableFileError, TableRecord, load_table
from service.reasons import Reason
from service.records.archive import Archive, ArchiveLimits
from service.records.archive_writer import ArchiveWriter
from service.records.journal import Journal, JournalError, TriggerStamp
from service.state import State, StateMachine

log = logging.getLogger("combtrace.daemon")

TARGET_KEYS = {
    *("kind", "host", "port", "device_id", "word_order", "handshake", "mode"),
    *("link_address", "service_address", "contour_address", "payload_capacity"),
}
BURST_SILENCE_S = 0.2
LEVEL_HOLDS_S = 0.05


class WiringError(Exception):
    """The configuration names what cannot be had: seen, expected, next step."""


@dataclass(frozen=True)
class Instead:
    """What stands in the place of camera and tracing, and who is told of all that the controller is told."""

    camera: Camera
    measurer: Measurer
    listen: Callable[[Controller], Controller] = lambda controller: controller


def build(
    config: Config,
    *,
    path: Path | None = None,
    observe: Callable[[Observation], None] = lambda _observation: None,
    instead: Instead | None = None,
    opening: Opening | None = None,
) -> Parts:
    """The daemon's parts; raise WiringError. Must be called in the event loop's thread.

    path: the configuration's file, to be read again when asked; None = never.
    opening: of this configuration; while its disk refuses writes the parts are those of a service that only tells so,
    and ends once they can be built anew. None = that is an error.
    """
    if instead is None:
        (plan, calibration_fault), camera = _make_plan(config), make_camera(config)
    else:
        plan, calibration_fault = _plan_of(instead.measurer, config), None
        camera = instead.camera
    lock, journal, refused = _make_journal(config, opening)
    notifier = Notifier()
    watchdog = Watchdog(notifier)
    listen = instead.listen if instead else lambda controller: controller
    link = None if refused else _make_link(config, listen, partial(watchdog.beat, "link"))
    health = Health(StateMachine(_publisher(link)))
    health.report("calibration", calibration_fault)
    health.report("journal", refused.fault if refused else _not_written(journal))
    pool = ThreadPoolExecutor(1, "camera")
    archive = _make_archive(config, journal)
    _tell_exports(config)
    cycle = Cycle(
        camera,
        plan.measurer,
        plan.recipes,
        journal,
        health,
        link,
        TransferCounter(secrets.randbelow(0xFFFF) + 1),
        cycle_settings(config),
        pool,
        observe=observe,
        keeper=archive,
        beat=partial(watchdog.beat, "jobs"),
    )
    kinds = {type(trigger) for trigger in config.triggers}
    try:
        executor = Executor(
            journal,
            cycle,
            health,
            link,
            controller_triggers=ControllerTrigger in kinds,
            queue=TriggerQueue(config.service.queue_depth, cycle_settings(config).lifetime_s),
            beat=partial(watchdog.beat, "jobs"),
        )
    except JournalError as error:
        raise WiringError(str(error)) from error
    parts = Parts(camera, journal, health, executor, link, pool, lock, notifier=notifier, watchdog=watchdog)
    parts.opening = lock if refused else None
    parts.state_dir = config.service.state_dir
    parts.archive = archive
    parts.storage = StorageWatch(
        journal,
        config.journal.path,
        health,
        archive,
        StorageLimits(config.journal.min_free_bytes, config.journal.max_jobs),
    )
    parts.warm_up_s = getattr(config.camera, "warm_up_s", 0.0)
    if path is not None:
        parts.reloader = Reloader(path, config, health, sound_plan, cycle.use)
    _add_triggers(config, parts)
    if config.metrics is not None:
        _add_metrics(config.metrics, parts, cycle)
    if config.page is not None:
        _add_page(config, config.page, parts, cycle)
    return parts


def _make_plan(config: Config) -> tuple[Plan, Fault | None]:
    """What jobs are measured by, and the fault of the calibration; raise WiringError."""
    guard, fault = find_guard(config)
    measurer = Measurer(
        guard.record.calibration if guard else None,
        guard=guard,
        work_area_mm=work_area(config),
        table=find_table(config),
    )
    return _plan_of(measurer, config), fault


def _plan_of(measurer: Measurer, config: Config) -> Plan:
    return Plan(measurer, {recipe.number: recipe for recipe in config.recipes}, config.default_recipe)


def sound_plan(config: Config) -> Plan:
    """What jobs are measured by; raise BadPlan where the calibration or the table cannot be used."""
    try:
        plan, fault = _make_plan(config)
    except WiringError as error:
        raise BadPlan(str(error)) from error
    if fault is not None:
        raise BadPlan(fault.text)
    return plan


def _add_metrics(settings: MetricsSettings, parts: Parts, cycle: Cycle) -> None:
    try:
        from service.daemon.metrics import MetricsError, Sources, serve
    except ImportError as error:
        parts.journal.close()
        parts.lock.release()
        raise WiringError(
            f"metrics: {error.name} is not installed. Install combtrace[metrics], or remove metrics"
        ) from error
    sources = Sources(
        importlib.metadata.version("combtrace"),
        parts.health,
        parts.executor,
        parts.link,
        parts.archive,
        parts.storage,
        lambda: cycle.measurer.guard,
    )
    try:
        metrics, parts.metrics = serve(settings, sources)
    except MetricsError as error:
        parts.journal.close()
        parts.lock.release()
        raise WiringError(str(error)) from error
    parts.executor.on_settled.append(metrics.job_ended)


def _add_page(config: Config, settings: PageSettings, parts: Parts, cycle: Cycle) -> None:
    """Serve the operator's page, which only then has to be installed."""
    try:
        from service.web.daemon_access import Sources
        from service.web.server import PageError, make_page
    except ModuleNotFoundError as error:
        parts.journal.close()
        parts.lock.release()
        raise WiringError(f"page: {error.name} is not installed. Install combtrace[page], or remove page") from error
    sources = Sources(
        parts.health,
        parts.executor,
        parts.journal,
        config.journal.path,
        config.archive.path,
        config.archive.max_bytes,
        lambda: tuple((number, recipe.name) for number, recipe in sorted(cycle.recipes.items())),
        lambda: cycle.measurer.guard,
        camera=config.camera.kind,
        controller=controller_words(config),
        link=parts.link,
        archive=parts.archive,
        storage=parts.storage,
    )
    try:
        parts.page = make_page(settings, sources)
    except PageError as error:
        if parts.metrics is not None:
            parts.metrics.close()
        parts.journal.close()
        parts.lock.release()
        raise WiringError(str(error)) from error


def controller_words(config: Config) -> str:
    """What the controller is, for a person: its kind, and where."""
    controller = config.controller
    if isinstance(controller, NoController):
        return controller.kind
    where = f"{controller.host}:{controller.port}" if not isinstance(controller, ModbusRtu) else controller.port
    return f"{controller.kind} {where}"


def _tell_exports(config: Config) -> None:
    """Warn at the start of exports that every job would miss; that keeps no job from being done."""
    for recipe in config.recipes:
        if recipe.exports:
            for text in trial(recipe):
                log.warning("recipe %d will not be exported: %s", recipe.number, text)


def _make_archive(config: Config, journal: Journal) -> ArchiveWriter | None:
    settings = config.archive
    if not settings.max_bytes:
        return None
    limits = ArchiveLimits(settings.max_bytes, settings.min_free_bytes)
    in_flight = [job.job_id for job in journal.unsettled()]
    last = journal.last_taken()
    return ArchiveWriter(Archive(settings.path, limits), journal.find, in_flight, last.job_id if last else 0)


def opening_of(config: Config) -> Opening:
    """What takes the configuration's locks and opens its journal."""
    names = partial(controller_names, config)
    return Opening(config.service.state_dir, config.journal.path, config.archive.path, names)


def _make_journal(config: Config, opening: Opening | None) -> tuple[Opening, Journal, DiskRefuses | None]:
    """The locks and the journal, or one that stands in for it while a disk refuses writes, and what it refused."""
    held = opening or opening_of(config)
    try:
        journal = held.journal()
    except DiskRefuses as refused:
        if opening is not None:
            return held, stand_in(), refused
        held.release()
        raise WiringError(str(refused)) from refused
    except (LockError, JournalError) as error:
        held.release()
        raise WiringError(str(error)) from error
    return held, journal, None


def _not_written(journal: Journal) -> Fault | None:
    """The fault of a journal that can be read and, as on a full disk, not be written."""
    try:
        journal.probe()
    except JournalError as error:
        return journal_fault(error)
    return None


def controller_names(config: Config) -> list[str]:
    """What of the controller must be this daemon's alone on this machine; nothing for one that only observes."""
    settings = config.controller
    if isinstance(settings, ModbusRtu):
        return [serial_name(settings.port)]
    if isinstance(settings, NoController) or settings.mode == "observe":
        return []
    unit = settings.device_id if isinstance(settings, ModbusTcp) else None
    return network_names(settings.host, settings.port, unit)


def find_calibration(config: Config) -> tuple[Calibration | None, Fault | None]:
    """The calibration, and the fault where a controller waits for millimetres that cannot be had."""
    guard, fault = find_guard(config)
    return None if guard is None else guard.record.calibration, fault


def find_guard(config: Config) -> tuple[CalibrationGuard | None, Fault | None]:
    """The calibration with its limits, and the fault where a controller waits for millimetres that cannot be had."""
    if config.calibration is None:
        fault = Fault(Reason.CALIBRATION_MISSING, "no calibration file is configured. Set calibration.file")
        return None, None if isinstance(config.controller, NoController) else fault
    settings = config.calibration
    limits = GuardLimits(settings.max_age_days, settings.sentinel_tolerance_px, settings.sentinels_required)
    try:
        return CalibrationGuard(load_record(settings.file), limits), None
    except CalibrationChanged as error:
        return None, Fault(Reason.CALIBRATION_MISMATCH, str(error))
    except CalibrationFileError as error:
        return None, Fault(Reason.CALIBRATION_MISSING, str(error))


def make_camera(config: Config) -> Camera:
    """The camera's driver, not yet opened."""
    camera = _single_frames(config)
    return camera if config.camera.average == 1 else AveragingCamera(camera, config.camera.average)


def _single_frames(config: Config) -> Camera:
    settings = config.camera
    if isinstance(settings, FilesCamera):
        return FileCamera(settings.path, loop=settings.loop, watch=settings.watch, move_to=settings.move_to)
    return V4l2Camera(
        V4l2Settings(
            device=str(settings.device),
            width=settings.width,
            height=settings.height,
            pixel_format=settings.pixel_format,
            frame_rate=settings.frame_rate,
            controls=settings.controls,
            input=settings.input,
            exposure_s=None if settings.exposure_ms is None else settings.exposure_ms / 1000,
            latency_s=settings.latency_ms / 1000,
        )
    )


def make_controller(config: Config) -> modbus.ModbusController | None:
    """The controller's driver, None for `kind: none`."""
    settings = config.controller
    if isinstance(settings, NoController):
        return None
    layout = mailbox_layout(config)
    assert layout is not None
    limits = modbus.RequestLimits(settings.longest_write, settings.longest_read)
    shared = settings.device_id, layout, settings.timeout_s, limits, settings.single_write
    if isinstance(settings, ModbusTcp):
        return modbus.ModbusTcpController(settings.host, settings.port, *shared)
    if isinstance(settings, ModbusRtuOverTcp):
        return modbus.ModbusRtuOverTcpController(settings.host, settings.port, *shared, baudrate=settings.baudrate)
    rs485 = None if settings.rs485 is None else modbus.Rs485(**settings.rs485.model_dump())
    line = modbus.SerialLine(
        settings.port, settings.baudrate, settings.parity, settings.stop_bits, rs485=rs485, echo=settings.echo
    )
    return modbus.ModbusRtuController(line, *shared)


def mailbox_layout(config: Config) -> MailboxLayout | None:
    """Where the mailbox lies in the controller's registers, None for `kind: none`."""
    settings = config.controller
    if isinstance(settings, NoController):
        return None
    return MailboxLayout(
        settings.link_address,
        settings.service_address,
        settings.contour_address,
        settings.payload_capacity,
        settings.word_order,
    )


def cycle_settings(config: Config) -> CycleSettings:
    """The bounds of a job."""
    settings = config.controller
    if isinstance(settings, NoController):
        return CycleSettings(
            default_recipe=config.default_recipe, camera_timeout_s=config.camera.timeout_s, target=_target(config)
        )
    return CycleSettings(
        camera_timeout_s=config.camera.timeout_s,
        default_recipe=config.default_recipe,
        valid_for_s=settings.valid_for_s,
        job_timeout_s=settings.job_timeout_s,
        observe=settings.mode == "observe",
        mailbox=MailboxFormat(settings.word_order, settings.payload_capacity),
        transfer=TransferSettings(
            handshake=settings.handshake == "full",
            readback=settings.readback,
            ready_timeout_s=settings.ready_timeout_s,
            ack_timeout_s=settings.ack_timeout_s,
            max_repeats=settings.max_repeats,
            poll_period_s=settings.poll_period_s,
        ),
        target=_target(config),
    )


def _target(config: Config) -> dict[str, str | int]:
    """Which controller it is and how it is laid out: the keys that must not change while a job is in flight there."""
    return config.controller.model_dump(mode="json", include=TARGET_KEYS)


def find_table(config: Config) -> TableRecord | None:
    """The taught table, where there is one; raise WiringError where its file cannot be used."""
    if config.table is None:
        return None
    try:
        config.table.file.stat()
    except FileNotFoundError:
        return None
    except OSError as error:  # it may well be there, and what it would refuse must not pass
        text = f"{config.table.file}: cannot be looked at: {error.strerror}. Check its permissions"
        raise WiringError(text) from error
    try:
        return load_table(config.table.file)
    except TableFileError as error:
        raise WiringError(str(error)) from error


def _make_link(config: Config, listen: Callable[[Controller], Controller], beat: Callable[[], None]) -> Link | None:
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
        beat=beat,
    )


def _publisher(link: Link | None) -> Callable[[State, str | None], None]:
    def publish(state: State, _reason: str | None) -> None:
        if link is not None:
            link.publish(service_state=int(state))

    return publish


def work_area(config: Config) -> NDArray[np.float64] | None:
    """The machine's work area, None where it is not checked."""
    return np.array(config.work_area_mm, dtype=np.float64) if config.work_area_mm else None


def _add_triggers(config: Config, parts: Parts) -> None:
    ports = sum(isinstance(trigger, SerialTriggerSettings) for trigger in config.triggers)
    if ports:
        parts.serial_pool = ThreadPoolExecutor(ports, "serial")
    for trigger in config.triggers:
        if isinstance(trigger, IntervalTrigger):
            parts.triggers.append((f"interval {trigger.period_s:g} s", _interval(parts.executor, trigger.period_s)))
        elif isinstance(trigger, SerialTriggerSettings):
            parts.triggers.append((f"serial {trigger.port}", _serial(parts, trigger)))


def _interval(executor: Executor, period_s: float) -> Callable[[], Awaitable[None]]:
    async def run() -> None:
        await interval_trigger(executor, period_s)

    return run


def _serial(parts: Parts, trigger: SerialTriggerSettings) -> Callable[[], Awaitable[None]]:
    assert parts.serial_pool is not None
    beat = partial(parts.watchdog.beat, f"serial {trigger.port}")
    shared = parts.executor, parts.health
    parts.ports.append(trigger.port)
    if trigger.mode == "text":
        line = SerialTrigger(
            SerialLineTrigger(trigger.port, trigger.baudrate),
            trigger.port,
            *shared,
            parts.journal,
            lambda: status_line(parts.health, parts.executor.settled_job, parts.executor.missed),
            parts.serial_pool,
            beat=beat,
        )
        parts.executor.on_settled.append(line.job_ended)
        parts.lines.append(line)
        return line.run
    stamp = TriggerStamp(trigger.mode)
    return SerialPulses(make_pulses(trigger), trigger.port, stamp, *shared, parts.serial_pool, beat=beat).run


def make_serial_port(trigger: SerialTriggerSettings) -> LineTrigger | PulseTrigger:
    """The driver of a serial trigger, whatever its mode, not yet opened."""
    return SerialLineTrigger(trigger.port, trigger.baudrate) if trigger.mode == "text" else make_pulses(trigger)


def make_pulses(trigger: SerialTriggerSettings) -> PulseTrigger:
    """The driver of a serial trigger that is no text."""
    if trigger.mode == "byte":
        return SerialBytes(trigger.port, trigger.baudrate, trigger.debounce_s or BURST_SILENCE_S)
    hold_s = trigger.debounce_s or LEVEL_HOLDS_S
    return SerialSignal(trigger.port, trigger.signal, trigger.edge, hold_s, baudrate=trigger.baudrate)
