"""`combtrace check`: the configuration and every device it names, each with what is wrong and what to do."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK, EXIT_UNUSABLE

if TYPE_CHECKING:
    from service.calibration_guard import CalibrationGuard
    from service.config import Config

HELP = "say what is wrong with configuration and devices"
DESCRIPTION = """\
Validate the configuration, then open every device it names and say what is wrong.
The controller's registers are read, none is written.

Exit status: 0 all well, 1 a device does not work, 2 bad configuration."""

CONTROLLER_BOUND_S = 5.0


@dataclass(frozen=True)
class Finding:
    """One checked thing: works or not, and a sentence."""

    part: str
    well: bool
    text: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, and whether devices are opened."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--no-devices", action="store_true", help="check the files only, open no device")


def run(args: argparse.Namespace) -> int:
    """Check, print, and tell by the exit status."""
    from service.config_file import ConfigError, load_config

    try:
        config = load_config(args.config)
    except ConfigError as error:
        _print(Finding("config", False, str(error)))
        return EXIT_UNUSABLE
    _print(Finding("config", True, f"{args.config}: {len(config.recipes)} recipes, {len(config.triggers)} triggers"))
    well = True
    for finding in findings(config, devices=not args.no_devices):
        _print(finding)
        well = well and finding.well
    return EXIT_OK if well else EXIT_FAILED


def findings(config: Config, *, devices: bool) -> Iterator[Finding]:
    """All that can be checked, part by part."""
    yield _calibration(config)
    if devices:
        yield _camera(config)
        yield asyncio.run(_controller(config))
        yield from _serial(config)
    yield _state_dir(config)


def _calibration(config: Config) -> Finding:
    from service.wiring import find_guard

    guard, fault = find_guard(config)
    if fault is not None:
        return Finding("calibration", False, fault.text)
    if guard is None:
        return Finding("calibration", True, "none: contours stay in pixels")
    calibration = guard.record.calibration
    aligned = "aligned to the machine" if calibration.aligned else "not aligned: machine frame = work frame"
    text = f"for pictures of {calibration.image_width} x {calibration.image_height} px, {_age(guard)}, {aligned}"
    sure = calibration.uncertainty
    heights = sorted({0.0, *(recipe.thickness_mm for recipe in config.recipes)})
    told = ", ".join(f"{sure.figure_mm(height):.3f} at {height:g} mm" for height in heights) if sure else "not stated"
    text += f"; 95 % of positions within, mm: {told}"
    if guard.record.sentinels is not None:
        text += f"; {len(guard.record.sentinels.marks)} fixed marks"
    blind = [recipe.name for recipe in config.recipes if not calibration.height_known(recipe.thickness_mm)]
    if blind:
        text += f"; its scale is not known at the thickness of {', '.join(blind)}: use the camera form, or that height"
    expired = guard.expired()
    return Finding("calibration", False, expired[1]) if expired else Finding("calibration", True, text)


def _age(guard: CalibrationGuard) -> str:
    age = guard.age_days
    return "age not stated" if age is None else f"{age:.1f} days old"


def _camera(config: Config) -> Finding:
    import time

    from contour.errors import CalibrationError
    from drivers.camera import CameraError
    from service.wiring import WiringError, find_guard, make_camera

    try:
        camera = make_camera(config)
    except WiringError as error:
        return Finding("camera", False, str(error))
    try:
        camera.open()
        frame = camera.grab(time.monotonic(), 5.0)
        height, width = frame.pixels.shape[:2]
        guard, _ = find_guard(config)
        if guard is not None:
            guard.record.calibration.check_fits(width, height)
    except (CameraError, CalibrationError) as error:
        return Finding("camera", False, str(error))
    finally:
        camera.close()
    text = f"{frame.source}: {width} x {height} px" + (f", camera_name {frame.camera!r}" if frame.camera else "")
    against = guard.findings(frame.pixels, frame.camera) if guard is not None else ()
    if against:
        return Finding("camera", False, f"{text}; " + "; ".join(reason for _, reason in against))
    marks = guard.sentinels(frame.pixels) if guard is not None else None
    return Finding("camera", True, text + (f"; fixed marks: {marks}" if marks is not None else ""))


async def _controller(config: Config) -> Finding:
    from drivers.controller import ControllerError
    from service.link import Link, LinkSettings
    from service.wiring import make_controller

    controller = make_controller(config)
    if controller is None:
        return Finding("controller", True, "none: contours are traced and not sent")
    link = Link(controller, LinkSettings())
    try:
        async with asyncio.timeout(CONTROLLER_BOUND_S):
            await controller.connect()
            block = await link.look()
    except (ControllerError, TimeoutError) as error:
        return Finding("controller", False, str(error) or f"no answer within {CONTROLLER_BOUND_S:g} s")
    finally:
        await controller.close()
    if getattr(config.controller, "handshake", "full") == "full" and block.session == 0:
        text = "it answers, but its session is 0: its program does not run, or link_address is another's"
        return Finding("controller", False, text)
    text = f"it answers: session {block.session}, controller_state {block.controller_state}"
    return Finding("controller", True, text)


def _serial(config: Config) -> Iterator[Finding]:
    from drivers.trigger import TriggerUnavailable
    from service.config import SerialTrigger
    from service.wiring import make_serial_port

    for trigger in config.triggers:
        if not isinstance(trigger, SerialTrigger):
            continue
        port = make_serial_port(trigger)
        try:
            port.open()
        except TriggerUnavailable as error:
            yield Finding("serial", False, str(error))
        else:
            yield Finding("serial", True, f"{trigger.port} at {trigger.baudrate} baud, mode {trigger.mode}")
        finally:
            port.close()


def _state_dir(config: Config) -> Finding:
    from service.journal import Journal, JournalDamaged, JournalError
    from service.lock import Lock, LockError, journal_lock

    path, state_lock = config.journal.path, config.service.state_dir / "combtrace.lock"
    try:
        # What is not there the daemon makes: it tells by it whether it ran here before, and at which number to begin.
        if state_lock.exists():
            Lock(state_lock).release()
        if not path.exists():
            return Finding("journal", True, f"{path}: no job yet")
        journal_lock(path).release()
        journal = Journal(path)
    except LockError as error:
        return Finding("state", False, str(error))
    except JournalDamaged as error:
        return Finding("journal", False, f"{error} The daemon moves it aside at its next start.")
    except JournalError as error:
        return Finding("journal", False, str(error))
    last = journal.last_settled()
    unsettled = len(journal.unsettled())
    journal.close()
    text = f"{path}: last job {last.job_id} {last.outcome}" if last else f"{path}: no job yet"
    return Finding("journal", True, text + (f", {unsettled} in flight" if unsettled else ""))


def _print(finding: Finding) -> None:
    print(f"{'ok   ' if finding.well else 'FAULT'} {finding.part:<12} {finding.text}", flush=True)
