"""`combtrace run`: the daemon, or with --once one immediate trigger."""

from __future__ import annotations

import argparse
import asyncio
import faulthandler
import logging
import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK, EXIT_REFUSED, UserError

if TYPE_CHECKING:
    from service.config.config import Config
    from service.daemon.daemon import Daemon, Parts
    from service.records.job import Job

log = logging.getLogger("combtrace.daemon")

FILE_THREADS = 4  # at most: for the journal and other files. They begin as they are needed and stay
LAST_RESORT_S = 15.0  # after a stop was asked for; the parts of a stop have their own bounds, together less

HELP = "run the daemon"
DESCRIPTION = """\
Run until stopped (SIGTERM, SIGINT). SIGHUP has the configuration read again: recipes,
calibration, table and work area are those of the next job; what else changed, or
is wrong, is told, and then all stays as it was. With --once: one immediate manual trigger, then end.
Exit status of --once: 0 accepted or written, 3 refused, 1 failed, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, once, log."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--once", action="store_true", help="one immediate manual trigger, then end")
    parser.add_argument("--verbose", action="store_true", help="log every attempt")


def run(args: argparse.Namespace) -> int:
    """Run."""
    from service.config.config_file import ConfigError, load_config
    from service.logs import start_logging
    from service.malloc import keep_few_arenas

    try:
        config = load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    start_logging(logging.DEBUG if args.verbose else getattr(logging, config.log.level.upper()), config.log.format)
    keep_few_arenas()
    faulthandler.enable()  # systemd ends a process that hangs by SIGABRT: its log then says where
    return asyncio.run(_run(config, args.config, once=args.once))


def version() -> str:
    """`combtrace` and its version."""
    import importlib.metadata

    return f"combtrace {importlib.metadata.version('combtrace')}"


def summary(config: Config) -> str:
    """What the daemon will do, in one line, for the log's beginning."""
    controller = config.controller
    where = f" {getattr(controller, 'host', '')}:{getattr(controller, 'port', '')}".removesuffix(" :")
    triggers = ", ".join(trigger.kind for trigger in config.triggers) or "none"
    return f"camera {config.camera.kind}, controller {controller.kind}{where}, triggers {triggers}"


async def _run(config: Config, config_path: Path, *, once: bool) -> int:
    from service.wiring.daemon import build, opening_of
    from service.wiring.errors import WiringError

    opening = None if once else opening_of(config)
    while True:
        try:
            parts = build(config, path=config_path, opening=opening)
        except WiringError as error:
            raise UserError(str(error)) from error
        log.info("%s, process %d, %s: %s", version(), os.getpid(), config_path, summary(config))
        status = await serve(parts, config.controller.ready_timeout_s, once=once)
        if not parts.begin_anew:
            return status
        assert parts.reloader is not None
        config = parts.reloader.config  # what was read again meanwhile is in force


async def serve(parts: Parts, ready_timeout_s: float, *, once: bool) -> int:
    """Run the parts until a signal, or for one manual trigger; the exit status."""
    from service.daemon.daemon import Daemon
    from service.jobs.trigger_queue import TriggerRefused
    from service.reasons import Outcome

    asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(FILE_THREADS, "file"))
    daemon = Daemon(parts, on_stop=_end_within_bound)
    signals = (signal.SIGTERM, signal.SIGINT)
    if not once:
        await daemon.run(on_signals=signals)
        return _left(daemon, EXIT_OK)
    try:
        job = await daemon.run_once(ready_timeout_s, on_signals=signals)
    except TriggerRefused as refused:
        refusal = refused.reason.outcome is Outcome.REFUSED and not refused.not_ready
        status = EXIT_REFUSED if refusal else EXIT_FAILED
        raise UserError(f"not triggered: {int(refused.reason)} {refused.reason.label}: {refused}", status) from refused
    print(job_line(job), flush=True)
    return _left(daemon, _status(job))


def _status(job: Job) -> int:
    from service.reasons import Outcome

    return {Outcome.REFUSED: EXIT_REFUSED, Outcome.FAILED: EXIT_FAILED}.get(job.outcome or Outcome.FAILED, EXIT_OK)


def _end_within_bound() -> None:
    """See that a process that was told to end is gone in time: a hanging disk can hold up any step of a stop."""
    last = threading.Timer(LAST_RESORT_S, _leave, args=(EXIT_FAILED,))
    last.daemon = True
    last.start()


def _left(daemon: Daemon, status: int) -> int:
    """`status`; does not return where a thread hangs in a call, for which the interpreter's own end would wait."""
    if daemon.abandoned:
        _leave(status)
    return status


def _leave(status: int) -> None:
    logging.shutdown()
    os._exit(status)


def job_line(job: Job) -> str:
    """How a job ended, for a person."""
    text = f"job {job.job_id} {job.outcome}"
    if job.reason is not None:
        return f"{text}: {int(job.reason)} {job.reason.label}: {job.detail}"
    report = job.report
    area = report.get("area_mm2")
    return text + (f": {report.get('vertices', 0)} vertices, {area:.1f} mm²" if area is not None else "")
