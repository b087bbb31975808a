"""The triggers that the configuration names, as parts that run for ever."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

from drivers.trigger.serial import SerialLineTrigger
from service.config.config import Config
from service.config.triggers import IntervalTrigger
from service.config.triggers import SerialTrigger as SerialTriggerSettings
from service.daemon.daemon import Parts
from service.jobs.executor import Executor
from service.jobs.kept_port import KeptPort
from service.jobs.status import status_line
from service.jobs.triggers import SerialPulses, SerialTrigger, interval_trigger
from service.records.job import TriggerStamp
from service.wiring.devices import make_serial_port


def add_triggers(config: Config, parts: Parts, opened: ExitStack) -> None:
    """Serve the triggers that are not the controller's own."""
    ports = sum(isinstance(trigger, SerialTriggerSettings) for trigger in config.triggers)
    if ports:
        parts.serial_pool = ThreadPoolExecutor(ports, "serial")
        opened.callback(parts.serial_pool.shutdown)
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
    driver = make_serial_port(trigger)
    feed = partial(parts.watchdog.feed, f"serial {trigger.port}")
    port = KeptPort(driver, trigger.port, parts.health, parts.serial_pool, feed_watchdog=feed)
    parts.ports.append(trigger.port)
    if not isinstance(driver, SerialLineTrigger):
        return SerialPulses(driver, port, TriggerStamp(trigger.mode), parts.executor).run
    line = SerialTrigger(
        driver,
        port,
        parts.executor,
        parts.journal,
        lambda: status_line(parts.health, parts.executor.settled_job, parts.executor.missed),
    )
    parts.executor.on_settled.append(line.job_ended)
    parts.lines.append(line)
    return line.run
