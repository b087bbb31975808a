"""`combtrace teach-table`: store a picture of the empty table, by which a block is told from it."""

from __future__ import annotations

import argparse
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from service.config.config import Config

HELP = "store a picture of the empty table, to tell a block from it"
DESCRIPTION = """\
Take several pictures of the empty table, average them, and write them to the file that
`table.file` of the configuration names. Where that file is there, `run` and `trace` look
only at what differs from it, whatever pattern the table has, and refuse when its light
or the camera has changed since (102 image_quality, 103 scene_moved). Teach the table
again after each such change that is meant to stay.

Exit status: 0 written, 3 refused (a block lies on it, or something moved), 2 unusable
input."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, pictures, and the file."""
    add_pictures_argument(parser, what="pictures of the empty table; none = the camera takes them", needed=False)
    parser.add_argument("--config", type=Path, metavar="FILE", help="configuration with the camera and table.file")
    parser.add_argument("--frames", type=int, default=8, metavar="N", help="pictures to take (1 to 100); default 8")
    parser.add_argument("--output", type=Path, metavar="FILE", help="write there instead of table.file")


def run(args: argparse.Namespace) -> int:
    """Take, average, check, write."""
    from service.calibrating.teaching import TableRefused, taught_table
    from service.cli.file_names import check_outputs
    from service.cli.options.measuring import load_config_or_default
    from service.measuring.table_file import TableFileError, TableRecord, save_table

    if not 1 <= args.frames <= 100:
        raise UserError(f"--frames {args.frames}: expected 1 to 100")
    if args.config is None and not (args.images and args.output):
        raise UserError("no configuration: give --config FILE, or pictures and --output FILE")
    args.images = pictures_of(args.images)
    config = load_config_or_default(args.config)
    path = args.output or (config.table.file if config.table is not None else None)
    if path is None:
        raise UserError("the configuration names no table.file: add `table: {file: table.npz}`, or give --output FILE")
    check_outputs(args.images, [("--output" if args.output else "table.file", path)])
    pictures, camera = _read(args.images) if args.images else _taken(config, args.frames)
    try:
        table = taught_table(pictures)
    except TableRefused as error:
        raise UserError(str(error), EXIT_REFUSED) from error
    record = TableRecord(table, camera, len(pictures), datetime.now(UTC).isoformat(timespec="seconds"))
    try:
        save_table(path, record)
    except TableFileError as error:
        raise UserError(str(error)) from error
    height, width = table.picture.shape[:2]
    print(f"{path}: table of {len(pictures)} pictures, {width} x {height} px, noise {table.noise:.1f} grey levels")
    return EXIT_OK


def _read(paths: list[Path]) -> tuple[list[NDArray[np.uint8]], str]:
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture

    try:
        return [read_picture(path) for path in paths], ""
    except CameraError as error:
        raise UserError(str(error)) from error


def _taken(config: Config, count: int) -> tuple[list[NDArray[np.uint8]], str]:
    """Pictures of the configured camera, and the camera's name."""
    from drivers.camera import CameraError
    from service.wiring.devices import make_camera
    from service.wiring.errors import WiringError

    try:
        camera = make_camera(config)
    except WiringError as error:
        raise UserError(str(error)) from error
    try:
        camera.open()
        frames = [camera.grab(time.monotonic(), 10.0) for _ in range(count)]
    except CameraError as error:
        raise UserError(str(error)) from error
    finally:
        camera.close()
    return [frame.pixels for frame in frames], frames[0].camera
