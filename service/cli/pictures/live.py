"""`combtrace live`: the outline in what the camera sees now, over and over, and why a job would refuse it."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError
from service.cli.file_names import output_path
from service.cli.options.camera import add_device_arguments, opened_camera
from service.cli.options.tracing import Tracing, add_tracing_arguments
from service.cli.pictures.trace_record import record_of, sentence

if TYPE_CHECKING:
    from drivers.camera import Camera
    from service.jobs.live_view import Look

HELP = "show the outline live, frame after frame, and why a job would refuse it"
DESCRIPTION = """\
Look at frame after frame as a job would: a line each with the outline's size, how sure it
is, or why it is refused, and sharpness and exposure of the picture. What the camera sends
meanwhile is dropped. The camera is the configuration's, which no daemon may hold then, a
device, or pictures over and over. Ctrl-C ends it and tells how many there were.

Exit status: 0 ended, 1 no frame, 2 bad configuration or usage."""

OVERLAY_PERIOD_S = 0.25  # an overlay takes a good part of what a look takes
OVERLAY_NAME = "live.jpg"
MOST_HZ = 60.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where frames come from, how they are traced, how often, and where to tell of it."""
    source = parser.add_mutually_exclusive_group()
    source.add_argument("--pictures", type=Path, metavar="PATH", help="a picture, or a folder, over and over")
    source.add_argument("--simulated", action="store_true", help="a drawn block that moves, to try it out")
    add_device_arguments(parser, source)
    parser.add_argument(
        "--rate", dest="most_hz", type=_rate, default=MOST_HZ, metavar="HZ", help="looks a second at most; default 60"
    )
    parser.add_argument("--frames", type=int, default=0, metavar="N", help="end after N frames; default 0: never")
    parser.add_argument(
        "--overlay",
        type=output_path,
        metavar="FILE",
        help=f"the newest picture with its contour, up to four times a second; in a folder: {OVERLAY_NAME}",
    )
    parser.add_argument("--json", action="store_true", help="an object a line instead of text")
    parser.add_argument("--language", choices=("en", "ru"), default="en", help="of the reasons")
    add_tracing_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Show line upon line, or one line anew on a terminal, until Ctrl-C."""
    from contour.errors import ParameterError
    from service.jobs.live_view import LiveView, Sight
    from service.worker import WorkerEnded

    if args.config is None and args.device is None and not args.simulated and args.pictures is None:
        args.config = Path("config.yaml")
    tracing = Tracing.of(args)
    shown = _Shown(args)
    try:
        sight = Sight(tracing.measurer, tracing.recipe, tracing.thickness_mm)
        with _camera(args) as camera, LiveView(sight) as view:
            for look in view.looks(camera, args.timeout_s, args.most_hz):
                shown.show(look)
                if shown.count == args.frames:
                    break
    except KeyboardInterrupt:
        pass
    except ParameterError as error:
        raise UserError(str(error)) from error
    except WorkerEnded as error:
        raise UserError(str(error), EXIT_FAILED) from error
    finally:
        shown.end()
    return EXIT_OK


class _Shown:
    """What was shown until now."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.count = 0
        self._outlines = 0
        self._began_s: float | None = None
        self._args = args
        self._anew = sys.stdout.isatty() and not args.json
        overlay: Path | None = args.overlay
        self._overlay = overlay / OVERLAY_NAME if overlay is not None and overlay.is_dir() else overlay
        self._drawn_s = -OVERLAY_PERIOD_S

    def show(self, look: Look) -> None:
        """Tell of one look."""
        now_s = time.monotonic()
        if self._began_s is None:
            self._began_s = now_s
        self.count += 1
        self._outlines += look.measurement.pixels is not None
        if self._args.json:
            print(json.dumps(live_record(look), ensure_ascii=False), flush=True)
        else:
            line = live_line(look, self._args.language)
            print(("\r\x1b[K" if self._anew else "") + line, end="" if self._anew else "\n", flush=True)
        if self._overlay is not None and look.frame is not None and now_s - self._drawn_s >= OVERLAY_PERIOD_S:
            self._drawn_s = now_s
            _draw(self._overlay, look)

    def end(self) -> None:
        """Tell how many there were."""
        took_s = 0.0 if self._began_s is None else time.monotonic() - self._began_s
        rate = f", {(self.count - 1) / took_s:.1f} frames a second" if self.count > 1 and took_s > 0 else ""
        if self._anew:
            print()
        print(
            f"{self._outlines} outlines in {self.count} frames{rate}",
            file=sys.stderr if self._args.json else sys.stdout,
        )


def live_line(look: Look, language: str) -> str:
    """One look in one line: what a job would say, and the picture's figures."""
    told = sentence(look.measurement, language)
    return told if look.figures is None else f"{told}; {look.figures}"


def live_record(look: Look) -> dict[str, Any]:
    """One look as an object: what `combtrace trace --json` tells of a picture, its size and its figures."""
    frame, figures, size = look.frame, look.figures, look.measurement.size_mm
    record = record_of(Path("" if frame is None else frame.source), look.measurement)
    del record["image"]
    return {
        "source": None if frame is None else frame.source,
        "sequence": None if frame is None else frame.sequence,
        **record,
        "size_mm": None if size is None else list(size),
        "sharpness": None if figures is None else figures.sharpness,
        "mean_grey": None if figures is None else figures.mean,
        "black_share": None if figures is None else figures.dark_share,
        "white_share": None if figures is None else figures.bright_share,
    }


def _draw(path: Path, look: Look) -> None:
    """Put the newest picture in the file's place in one step: whoever shows it never reads half of one."""
    from service.records.pictures import PictureFileError, write_overlay

    assert look.frame is not None
    beside = path.with_name(f".new-{path.name}")
    try:
        write_overlay(beside, look.frame.pixels, look.measurement)
        beside.replace(path)
    except PictureFileError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(f"--overlay {path}: cannot be written: {error.strerror}. Name another file") from error


@contextmanager
def _camera(args: argparse.Namespace) -> Iterator[Camera]:
    """The camera that the arguments name, open; raise UserError."""
    from drivers.camera.files.camera import FileCamera
    from drivers.camera.simulated import SimulatedCamera

    given: Camera | None = None
    if args.pictures is not None:
        given = FileCamera(args.pictures, loop=True)
    elif args.simulated:
        given = SimulatedCamera(_moving_block())
    with opened_camera(args, given) as camera:
        yield camera


def _moving_block() -> Any:
    """Pictures of a block that goes round slowly, by their numbers."""
    import cv2
    import numpy as np

    from drivers.camera.files.decode import read_picture

    block = read_picture(Path(__file__).parents[2] / "samples" / "1-rectangle.jpg")
    height, width = block.shape[:2]

    def picture(sequence: int) -> Any:
        move = np.array([[1.0, 0.0, 12 * np.cos(sequence / 20)], [0.0, 1.0, 12 * np.sin(sequence / 20)]])
        return cv2.warpAffine(block, move, (width, height), borderMode=cv2.BORDER_REPLICATE)

    return picture


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not 0.01 <= rate <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number of looks a second, 0.01 to 1000")
    return rate
