"""Which camera a command opens: that of the configuration, or one named on the command line."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, UserError

if TYPE_CHECKING:
    from drivers.camera import Camera


def add_camera_arguments(parser: argparse.ArgumentParser) -> None:
    """A configuration, or a device with size, format and rate."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    add_device_arguments(parser)
    parser.add_argument("--rate", type=float, metavar="HZ", help="with --device: frames a second; default the driver's")


def add_device_arguments(
    parser: argparse.ArgumentParser, sources: argparse._MutuallyExclusiveGroup | None = None
) -> None:
    """A device with size and format; `sources`: of which one may be named."""
    (sources or parser).add_argument(
        "--device", metavar="FILE", help="a V4L2 device instead of the configuration's camera"
    )
    parser.add_argument("--size", metavar="WxH", help="with --device: size of the picture, such as 1280x720")
    parser.add_argument("--format", metavar="CODE", help="with --device: pixel format; default YUYV")
    parser.add_argument("--timeout-s", type=float, default=5.0, metavar="S", help="longest wait for a frame; default 5")


@contextmanager
def opened_camera(args: argparse.Namespace, given: Camera | None = None) -> Iterator[Camera]:
    """The camera that the arguments name, or the one that is given, open; raise UserError."""
    from drivers.camera import CameraError

    camera = given or _camera(args)
    try:
        camera.open()
        yield camera
    except CameraError as error:
        raise UserError(str(error), EXIT_FAILED) from error
    finally:
        camera.close()


def _camera(args: argparse.Namespace) -> Camera:
    from service.config.config_file import ConfigError, load_config
    from service.wiring.devices import make_camera
    from service.wiring.errors import WiringError

    if args.device is not None:
        return _named(args)
    for name in ("size", "format", "rate"):
        if getattr(args, name, None) is not None:
            raise UserError(
                f"--{name} goes with --device, and none is given: the camera is that of {args.config}. "
                "Name the device too, or set it in the configuration"
            )
    try:
        return make_camera(load_config(args.config))
    except (ConfigError, WiringError) as error:
        raise UserError(str(error)) from error


def _named(args: argparse.Namespace) -> Camera:
    from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings

    width, _, height = (args.size or "").lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        seen = "no --size" if args.size is None else f"--size {args.size}"
        raise UserError(f"{seen}, expected one with --device, such as 1280x720; `combtrace cameras` lists sizes")
    rate = getattr(args, "rate", None)
    return V4l2Camera(V4l2Settings(args.device, int(width), int(height), args.format or "YUYV", frame_rate=rate))
