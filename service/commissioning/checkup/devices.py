"""Camera, controller and serial ports: each opened and looked at, unless a running service has it."""

from __future__ import annotations

import asyncio
import grp
import os
import pwd
import time
from collections.abc import Iterator
from pathlib import Path

from contour.errors import CalibrationError
from drivers.camera import CameraError, Frame
from drivers.camera.files.folder import list_versions
from drivers.controller import ControllerError
from drivers.trigger import TriggerUnavailable
from service.check_result import CheckResult, fault, ok, warning
from service.commissioning.checkup.running import other_user_of_controller
from service.config.cameras import FilesCamera, GenicamCamera, V4l2Camera
from service.config.config import Config
from service.config.controllers import ModbusRtu
from service.config.triggers import SerialTrigger
from service.link.link import Link, LinkSettings
from service.wiring.devices import make_camera, make_controller, make_serial_port
from service.wiring.errors import WiringError
from service.wiring.plan import find_guard

CONTROLLER_BOUND_S = 5.0
CAMERA_BOUND_S = 5.0


def check_devices(config: Config, running: int | None) -> Iterator[CheckResult]:
    """Every device that the configuration names. running: the process of the service that has them."""
    yield from check_permissions(config)
    if running is not None:
        for part in ("camera", "controller", *("serial" for _ in _serial_triggers(config))):
            yield ok(part, f"in use by the running service (process {running}); its log says how it is")
        return
    if isinstance(config.camera, GenicamCamera):
        yield from _network()
    yield _camera(config)
    yield _controller(config)
    for trigger in _serial_triggers(config):
        yield _serial(trigger)


def _serial_triggers(config: Config) -> list[SerialTrigger]:
    return [trigger for trigger in config.triggers if isinstance(trigger, SerialTrigger)]


def check_permissions(config: Config) -> Iterator[CheckResult]:
    """Device files that this user may not use: which group may."""
    devices = [trigger.port for trigger in _serial_triggers(config) if "://" not in trigger.port]
    if isinstance(config.controller, ModbusRtu):
        devices.append(config.controller.port)
    if isinstance(config.camera, V4l2Camera):
        devices.append(str(config.camera.device))
    user = _name(pwd.getpwuid, os.getuid())
    for device in map(Path, devices):
        if not os.path.exists(device) or os.access(device, os.R_OK | os.W_OK):
            continue
        group = _name(grp.getgrgid, device.stat().st_gid)
        yield fault(
            "permissions",
            f"{device}: user {user} may not read and write it, group {group} may",
            f"Run `usermod -aG {group} {user}` as root (serial ports: dialout, cameras: video), then log in again",
        )


def _name(look_up: object, number: int) -> str:
    """Name of a user or group, or its number where it has none."""
    assert callable(look_up)
    try:
        return str(look_up(number)[0])
    except KeyError:
        return str(number)


# --- camera -----------------------------------------------------------------------------------------------------------


def _network() -> Iterator[CheckResult]:
    """What of the kernel's settings loses a GigE Vision camera's packets."""
    from drivers.camera.genicam.stream import small_sockets

    if (trouble := small_sockets()) is not None:
        seen, _, next_step = trouble.partition(". ")
        yield warning("network", seen, next_step)


def _camera(config: Config) -> CheckResult:
    settings = config.camera
    if isinstance(settings, FilesCamera) and (settings.watch or settings.move_to is not None):
        return _waiting_folder(settings)
    try:
        camera = make_camera(config)
    except WiringError as error:
        return fault("camera", str(error))
    try:
        camera.open()
        frame = camera.grab(time.monotonic(), CAMERA_BOUND_S)
    except CameraError as error:
        return fault("camera", str(error))
    finally:
        camera.close()
    return _frame(config, frame)


def _waiting_folder(settings: FilesCamera) -> CheckResult:
    """A folder whose files are the service's to take: none is taken here, and none has to be there yet."""
    target = settings.move_to
    try:
        waiting = len(list_versions(settings.path))
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        return fault("camera", f"{settings.path}: cannot be read: {why}", "Make the folder, or correct camera.path")
    if target is not None and os.path.exists(target) and not os.access(target, os.W_OK | os.X_OK):
        return fault("camera", f"{target}: files cannot be moved there", "Give the folder to the service's user")
    seen = f"{waiting} picture{'s' * (waiting != 1)} waiting" if waiting else "no picture yet, which is no fault"
    return ok("camera", f"{settings.path}: {seen}; none is taken by this check")


def _frame(config: Config, frame: Frame) -> CheckResult:
    height, width = frame.pixels.shape[:2]
    text = f"{frame.source}: {width} x {height} px" + (f", camera_name {frame.camera!r}" if frame.camera else "")
    guard, _ = find_guard(config)
    if guard is None:
        return ok("camera", text)
    try:
        guard.record.calibration.check_fits(width, height)
    except CalibrationError as error:
        return fault("camera", str(error))
    against = guard.findings(frame.pixels, frame.camera)
    if against:
        return fault("camera", f"{text}; " + "; ".join(reason for _, reason in against))
    marks = guard.sentinels(frame.pixels)
    return ok("camera", text if marks is None else f"{text}; fixed marks: {marks}")


# --- controller and serial --------------------------------------------------------------------------------------------


def _controller(config: Config) -> CheckResult:
    """The controller's answer. A second master would disturb its one client, so not where another service has it."""
    held = other_user_of_controller(config)
    if held is not None:
        next_step = "Stop that service, or check its own configuration"
        return warning("controller", f"{held}: in use by another combtrace on this machine, not looked at", next_step)
    return asyncio.run(_answer(config))


async def _answer(config: Config) -> CheckResult:
    controller = make_controller(config)
    if controller is None:
        return ok("controller", "none: contours are traced and not sent")
    link = Link(controller, LinkSettings())
    try:
        async with asyncio.timeout(CONTROLLER_BOUND_S):
            await controller.connect()
            block = await link.look()
    except (ControllerError, TimeoutError) as error:
        text = str(error) or f"no answer within {CONTROLLER_BOUND_S:g} s"
        return fault("controller", text)
    finally:
        await controller.close()
    if getattr(config.controller, "handshake", "full") == "full" and block.session == 0:
        return fault(
            "controller",
            "it answers, but its session is 0: its program does not run, or link_address is another's",
            "Start the controller's program; compare link_address with docs/reference/register-map.md",
        )
    return ok("controller", f"it answers: session {block.session}, controller_state {block.controller_state}")


def _serial(trigger: SerialTrigger) -> CheckResult:
    port = make_serial_port(trigger)
    try:
        port.open()
    except TriggerUnavailable as error:
        return fault("serial", str(error))
    finally:
        port.close()
    return ok("serial", f"{trigger.port} at {trigger.baudrate} baud, mode {trigger.mode}")
