"""`combtrace grab`: one frame from the camera, as a job would get it, with what is to know of it."""

from __future__ import annotations

import argparse
import time
from datetime import datetime
from pathlib import Path

from service.cli.errors import EXIT_OK, UserError
from service.cli.options.camera import add_camera_arguments, opened_camera

HELP = "grab one frame and store it"
DESCRIPTION = """\
Open the camera, trigger once, store the frame, and say how it came: format, time from
trigger to frame, sharpness, exposure. The picture is stored as the tracing would see it.

Exit status: 0 stored, 1 no frame, 2 bad configuration or usage."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the frame goes, and the camera."""
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="picture to write, such as x.png")
    add_camera_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Grab and store."""
    from contour.image.picture_figures import picture_figures
    from service.records.pictures import PictureFileError, write_picture

    with opened_camera(args) as camera:
        asked_at_s, clock = time.monotonic(), datetime.now().astimezone()
        frame = camera.grab(asked_at_s, args.timeout_s)
        took_ms = (time.monotonic() - asked_at_s) * 1000
        opened = getattr(camera, "opened", None)
    try:
        deep = args.output.suffix.lower() in ("", ".png", ".tif", ".tiff")
        write_picture(args.output, frame.samples if deep else frame.pixels)
    except PictureFileError as error:
        raise UserError(str(error)) from error
    height, width = frame.pixels.shape[:2]
    kind = "grey" if frame.pixels.ndim == 2 else "colour"
    print(f"{args.output}: {width} x {height} px, {kind}, from {frame.source}")
    if opened is not None:
        print(f"camera    {opened}")
    exposed_ms = (frame.exposed_at_s - asked_at_s) * 1000
    print(f"time      {took_ms:.0f} ms from trigger to frame; exposed {exposed_ms:.0f} ms after the trigger or later")
    told = f"{clock:%H:%M:%S.%f}"[:-3]
    print(f"trigger   at {told} by this machine's clock; a clock in the picture must not show less")
    print(f"picture   {picture_figures(frame.pixels)}")
    return EXIT_OK
