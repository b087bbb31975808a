"""`combtrace calibrate`: pictures of a board, points, or a scale become a calibration file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.calibration.from_board import from_board, report_path
from service.cli.calibration.without_board import without_board
from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.board import add_board_arguments, picture_size
from service.cli.options.length import add_length_arguments, pixel_pair
from service.cli.pictures.given_pictures import add_pictures_argument

if TYPE_CHECKING:
    from service.measuring.calibration_file import CalibrationRecord

HELP = "make the calibration file: pixels to millimetres"
DESCRIPTION = """\
Three ways:

  from pictures of a board   --board charuco|chessboard --squares 11x8 --square-mm S
                             [--marker-mm M --dictionary D] --plane IMAGE IMAGE…
  from measured points       --points FILE --size WxH     (x_px,y_px,x_mm,y_mm; 4 or more)
  from a scale alone         --scale MM_PER_PX --size WxH [--origin-px X,Y]

With a board, --plane is the picture in which it lies flat on the table. Its lower-left
square's outer corner becomes the origin, x runs along its lower edge, y up. Take 12 to 20
pictures, the board tilted by about 20 degrees to all sides, in all parts of the view.
A report with pictures is written beside the file. docs/how-to/calibrating.md goes step by step.

Pictures of a board do not tell its size. --camera-height-mm and --known-length-mm, measured
by hand, are told beside what the calibration says: from 3 % apart with a warning, from
8 % apart (--accept-apart-percent) nothing is written.

Exit status: 0 written, 3 the verdict is not good: nothing written but the report,
2 unusable input or usage."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The three ways, and what they share."""
    add_pictures_argument(parser, what="pictures of the board", needed=False)
    parser.add_argument("--output", type=Path, required=True, metavar="FILE", help="calibration file to write")
    board = parser.add_argument_group("from a board")
    add_board_arguments(board, required=False)
    board.add_argument("--plane", type=Path, metavar="IMAGE", help="the picture in which the board lies on the table")
    board.add_argument("--board-thickness-mm", type=float, default=0.0, metavar="T", help="pattern above the table")
    board.add_argument("--camera-height-mm", type=float, metavar="H", help="table to lens by tape, to compare")
    board.add_argument(
        "--area-px",
        type=_box,
        metavar="L,T,R,B",
        help="where blocks will lie (left, top, right, bottom): to be covered",
    )
    board.add_argument(
        "--accept-uncovered", action="store_true", help="let contours lie where no corner of the board was seen, too"
    )
    board.add_argument("--report", type=Path, metavar="FILE", help="default: the output's name with .html")
    other = parser.add_argument_group("without a board")
    other.add_argument("--points", type=Path, metavar="FILE", help="CSV: x_px,y_px,x_mm,y_mm")
    other.add_argument("--scale", type=float, metavar="MM", help="millimetres a pixel")
    other.add_argument("--size", type=picture_size, metavar="WxH", help="size of the camera's pictures, px")
    other.add_argument(
        "--origin-px", type=pixel_pair, metavar="X,Y", help="with --scale; default: the lower-left pixel"
    )
    other.add_argument("--plane-height-mm", type=float, default=0.0, metavar="H", help="height of points or scale")
    both = parser.add_argument_group("for all")
    both.add_argument("--block-mm", type=float, default=60.0, metavar="H", help="height judged besides the table")
    both.add_argument("--accept-mm", type=float, metavar="MM", help="largest 95 %% figure that is good; default 0.1")
    add_length_arguments(both)
    both.add_argument("--camera-name", default="", metavar="NAME", help="as `combtrace check` prints it")
    both.add_argument("--sentinels", metavar="DICTIONARY", help="dictionary of fixed marks beside the table")
    both.add_argument("--sentinel-image", type=Path, metavar="IMAGE", help="picture of the marks; default --plane")


def run(args: argparse.Namespace) -> int:
    """Calibrate in the way that was asked for."""
    ways = [name for name in ("board", "points", "scale") if getattr(args, name) is not None]
    if len(ways) != 1:
        raise UserError(f"expected one of --board, --points and --scale, seen {' and '.join(ways) or 'none'}")
    _check_numbers(args)
    _check_outputs(args)
    if ways == ["board"]:
        record = from_board(args)
        if record is None:
            return EXIT_REFUSED
    else:
        _check_boardless(args, ways[0])
        record = without_board(args, ways[0])
    _write(args.output, record)
    return EXIT_OK


def _check_numbers(args: argparse.Namespace) -> None:
    for name in ("accept_mm", "block_mm", "camera_height_mm"):
        value = getattr(args, name)
        if value is not None and not 0 < value < 1e5:
            raise UserError(f"--{name.replace('_', '-')} {value:g}: expected a number above 0")
    if not 0 <= args.board_thickness_mm <= 500:
        raise UserError(f"--board-thickness-mm {args.board_thickness_mm:g}: expected 0 to 500")


def _check_boardless(args: argparse.Namespace, way: str) -> None:
    """Raise UserError where something is given that only pictures of a board can use, or the size is not."""
    if args.images or args.plane is not None:
        raise UserError(f"--{way} takes no pictures of a board; leave them and --plane out")
    if args.camera_height_mm is not None:
        raise UserError(f"--{way} knows no camera to compare --camera-height-mm with; give --known-length-mm")
    if args.area_px is not None or args.accept_uncovered:
        raise UserError(f"--{way} has no views that cover an area; leave --area-px and --accept-uncovered out")
    if args.size is None:
        raise UserError(f"--{way} needs --size WxH, the size of the camera's pictures in pixels")


def _check_outputs(args: argparse.Namespace) -> None:
    """Raise UserError where the results could not be written: minutes of work would be lost."""
    report = report_path(args)
    if report == args.output:
        raise UserError(f"--output {args.output}: the report would overwrite it. End it in .yaml, or name --report")
    for option, path in (("--output", args.output), ("--report", report)):
        if not path.parent.is_dir():
            raise UserError(f"{option} {path}: there is no folder {path.parent}. Make it, or name another")
        if path.is_dir():
            raise UserError(f"{option} {path}: is a folder. Name a file")


def _write(path: Path, record: CalibrationRecord) -> None:
    from service.measuring.calibration_file import CalibrationFileError, load_record, save_record

    aligned = False
    if path.exists():
        try:
            aligned = load_record(path).calibration.aligned
        except CalibrationFileError:
            aligned = False  # what stood there is no calibration that could be lost
    try:
        save_record(path, record)
    except CalibrationFileError as error:
        raise UserError(str(error)) from error
    print(f"written   {path}")
    if aligned:
        print("          the alignment of the file that stood there is gone: run `combtrace align` again")


def _box(text: str) -> tuple[float, float, float, float]:
    try:
        left, top, right, bottom = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected four numbers such as 200,150,1400,1050") from None
    if not (0 <= left < right and 0 <= top < bottom):
        raise argparse.ArgumentTypeError(f"{text!r}: expected left < right and top < bottom, from 0 on")
    return left, top, right, bottom
