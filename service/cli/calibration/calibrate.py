"""`combtrace calibrate`: pictures of a board, points, or a scale become a calibration file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.length import (
    accept_share,
    add_length_arguments,
    compare_span,
    known_length,
    made_of_lengths,
    pixel_pair,
    tell_lengths,
)
from service.cli.pictures.given_pictures import add_pictures_argument, pictures_of

if TYPE_CHECKING:
    from contour.calibration.calibration import Calibration
    from contour.calibration.fixed_marks import Sentinels
    from contour.calibration.position_uncertainty import PositionUncertainty
    from contour.camera_calibration.board import Board
    from contour.camera_calibration.calibrate import CameraResult
    from service.measuring.board_pictures import Gathered

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
A report with pictures is written beside the file. docs/calibrating.md goes step by step.

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


def add_board_arguments(parser: argparse._ArgumentGroup | argparse.ArgumentParser, *, required: bool) -> None:
    """What describes a board, for all commands that need one."""
    parser.add_argument("--board", choices=("charuco", "chessboard"), required=required)
    parser.add_argument("--squares", type=_squares, required=required, metavar="WxH", help="squares, not inner corners")
    parser.add_argument("--square-mm", type=float, required=required, metavar="S", help="side of a square, measured")
    parser.add_argument("--marker-mm", type=float, metavar="M", help="side of a marker; default 0.7 squares")
    parser.add_argument("--dictionary", metavar="NAME", help="ArUco dictionary; default DICT_5X5_250")


def board_of(args: argparse.Namespace) -> Board:
    """The board that the arguments describe; raise UserError."""
    from contour.camera_calibration.board import DEFAULT_DICTIONARY, DEFAULT_MARKER_SHARE, Board
    from contour.errors import ParameterError

    marker_mm, dictionary = args.marker_mm, args.dictionary
    if args.board == "charuco":
        dictionary = DEFAULT_DICTIONARY if dictionary is None else dictionary
        marker_mm = round(DEFAULT_MARKER_SHARE * args.square_mm, 3) if marker_mm is None else marker_mm
    try:
        return Board(args.board, args.squares[0], args.squares[1], args.square_mm, marker_mm or 0.0, dictionary or "")
    except ParameterError as error:
        raise UserError(str(error)) from error


def run(args: argparse.Namespace) -> int:
    """Calibrate in the way that was asked for."""
    ways = [name for name in ("board", "points", "scale") if getattr(args, name) is not None]
    if len(ways) != 1:
        raise UserError(f"expected one of --board, --points and --scale, seen {' and '.join(ways) or 'none'}")
    for name in ("accept_mm", "block_mm", "camera_height_mm"):
        value = getattr(args, name)
        if value is not None and not 0 < value < 1e5:
            raise UserError(f"--{name.replace('_', '-')} {value:g}: expected a number above 0")
    if not 0 <= args.board_thickness_mm <= 500:
        raise UserError(f"--board-thickness-mm {args.board_thickness_mm:g}: expected 0 to 500")
    _check_outputs(args)
    if ways[0] == "board":
        return _from_board(args)
    if args.images or args.plane is not None:
        raise UserError(f"--{ways[0]} takes no pictures of a board; leave them and --plane out")
    if args.camera_height_mm is not None:
        raise UserError(f"--{ways[0]} knows no camera to compare --camera-height-mm with; give --known-length-mm")
    if args.area_px is not None or args.accept_uncovered:
        raise UserError(f"--{ways[0]} has no views that cover an area; leave --area-px and --accept-uncovered out")
    if args.size is None:
        raise UserError(f"--{ways[0]} needs --size WxH, the size of the camera's pictures in pixels")
    if ways[0] == "points":
        calibration, cause = _from_points(args), "Check the points' millimetres: all times {factor} would agree"
    else:
        calibration, cause = _from_scale(args), "Check --scale: {factor} times as much would agree"
    made = made_of_lengths(compare_span(args, calibration, cause))
    _write(args, calibration, _sentinels(args, None), {"made_from": ways[0], **made})
    return EXIT_OK


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


def report_path(args: argparse.Namespace) -> Path:
    """Where the report goes."""
    path: Path = args.report or args.output.with_suffix(".html")
    return path


# --- a board ----------------------------------------------------------------------------------------------------------


def _from_board(args: argparse.Namespace) -> int:
    from contour.camera_calibration.calibrate import Setup, calibrate_camera
    from contour.errors import CalibrationFailed
    from service.measuring.board_pictures import PlaneViewError, gather_views

    missing = [
        f"--{name.replace('_', '-')}" for name in ("squares", "square_mm", "plane") if getattr(args, name) is None
    ]
    if missing:
        raise UserError(f"--board needs {' and '.join(missing)}")
    board = board_of(args)
    setup = Setup(
        plane=str(args.plane),
        board_thickness_mm=args.board_thickness_mm,
        block_mm=args.block_mm,
        accept_mm=0.1 if args.accept_mm is None else args.accept_mm,
        camera_height_mm=args.camera_height_mm,
        known_length=known_length(args),
        accept_apart=accept_share(args),
        area_px=args.area_px,
        accept_uncovered=args.accept_uncovered,
        camera_name=args.camera_name,
    )
    try:
        gathered = gather_views(args.plane, pictures_of(args.images), board, _progress)
        sentinels = _sentinels(args, gathered)
        result = calibrate_camera(gathered.views, board, gathered.size, setup, _progress)
    except (PlaneViewError, CalibrationFailed) as error:
        raise UserError(str(error)) from error
    _tell(result, gathered, setup.accept_apart)
    made = made_of(result, board, setup.block_mm)
    _report(args, result, gathered, board, setup, sentinels)
    if not result.verdict.good:
        options = " ".join(result.verdict.overrides)
        print(f"{args.output}: not written. To take it nevertheless: {options}", file=sys.stderr)
        return EXIT_REFUSED
    _write(args, result.calibration, sentinels, made)
    return EXIT_OK


def made_of(result: CameraResult, board: Board, block_mm: float) -> dict[str, str | float | None]:
    """What the calibration file keeps of how it was made."""
    verdict, sure = result.verdict, result.verdict.uncertainty
    return {
        "made_from": f"{board.kind} {board.name_of_size}",
        "square_mm": float(board.square_mm),
        "lens_model": result.model.name,
        "views": len(result.views),
        "corner_noise_px": round(result.noise_px, 4),
        "turn_deg": round(result.turn_deg, 1),
        "covered_share": round(verdict.zones.covered_share, 3),
        "table_95_mm": round(sure.figure_mm(0.0), 4),
        "block_mm": float(block_mm),
        "block_95_mm": round(sure.figure_mm(block_mm), 4),
        "halves_apart_mm": round(float(verdict.halves_mm[0].mean()), 4),
        "inflation": round(verdict.inflation, 2),
        **made_of_lengths(result.lengths),
        "verdict": verdict.sentence,
    }


def _tell(result: CameraResult, gathered: Gathered, share: float) -> None:
    for one in (*gathered.dropped, *result.dropped):
        print(f"not used  {one.name}: {one.reason}")
    verdict = result.verdict
    position = result.calibration.camera_position
    print(
        f"views     {len(result.views)} used, boards turned against each other by up to {result.turn_deg:.0f} degrees"
    )
    print(f"lens      {result.model.name}, corners within {result.noise_px:.3f} px (one standard deviation)")
    print(f"camera    {position[2]:.0f} mm above the table, {verdict.mm_per_px:.4f} mm a pixel in the middle")
    tell_lengths(result.lengths, share)
    print(f"coverage  corners enclose {verdict.zones.text}{_told_use(verdict.uncertainty)}")
    print(f"halves    two independent halves differ by {verdict.halves_mm[0].mean():.3f} mm on the table (mean)")
    print(f"verdict   {verdict.sentence}")


def _told_use(sure: PositionUncertainty) -> str:
    if sure.covered_px is None:
        return "; contours outside of it are taken, too"
    return "; a block that leaves that part is refused (115 outside_work_area)"


def _report(
    args: argparse.Namespace,
    result: CameraResult,
    gathered: Gathered,
    board: Board,
    setup: object,
    sentinels: Sentinels | None,
) -> None:
    from service.measuring.calibration_report import write_report

    path = report_path(args)
    try:
        write_report(path, result, gathered, board, setup, sentinels)  # type: ignore[arg-type]
    except OSError as error:
        raise UserError(f"--report {path}: cannot be written: {error.strerror}. Name another file") from error
    print(f"report    {path}")


# --- no board ---------------------------------------------------------------------------------------------------------


def _from_points(args: argparse.Namespace) -> Calibration:
    from contour.camera_calibration.length_check import rounded_up
    from contour.camera_calibration.point_calibration import calibrate_points
    from contour.errors import CalibrationFailed
    from service.measuring.points_file import PointsFileError, read_points

    accept_mm = 1.0 if args.accept_mm is None else args.accept_mm
    try:
        _, table = read_points(args.points, [("x_px", "y_px", "x_mm", "y_mm")])
        result = calibrate_points(table[:, :2], table[:, 2:], args.size, args.plane_height_mm)
    except (PointsFileError, CalibrationFailed) as error:
        text = str(error)
        raise UserError(text if text.startswith(str(args.points)) else f"{args.points}: {text}") from error
    for number, miss in enumerate(result.residuals_mm, 1):
        print(f"point {number}: off by {miss:.3f} mm")
    worst = float(result.residuals_mm.max())
    if worst > accept_mm:
        number = int(result.residuals_mm.argmax()) + 1
        raise UserError(
            f"{args.points}: point {number} lies {worst:.3f} mm from the map through all points, {accept_mm:g} mm are "
            "allowed. Measure it again; if all are off, the lens bends lines: calibrate with a board. To take it "
            f"nevertheless: --accept-mm {rounded_up(worst, 0.001):.9g}",
            EXIT_REFUSED,
        )
    sure = result.calibration.uncertainty
    if sure is None:
        print("4 points leave nothing to check by: how sure the map is, is not known. Measure more points")
    else:
        print(f"95 % of positions are within {sure.figures_mm[0]:.3f} mm between the points")
    return result.calibration


def _from_scale(args: argparse.Namespace) -> Calibration:
    from contour.calibration.calibration import SimpleCalibration
    from contour.errors import CalibrationError

    width, height = args.size
    origin = (0.0, height - 1.0) if args.origin_px is None else args.origin_px
    try:
        return SimpleCalibration(width, height, args.scale, origin, args.plane_height_mm)
    except CalibrationError as error:
        raise UserError(str(error)) from error


# --- what all share ---------------------------------------------------------------------------------------------------


def _sentinels(args: argparse.Namespace, gathered: Gathered | None) -> Sentinels | None:
    """The fixed marks in view, where they were asked for; raise UserError where there are none."""
    from contour.calibration.fixed_marks import see_sentinels
    from contour.errors import ContourError
    from drivers.camera import CameraError
    from drivers.camera.files.decode import read_picture

    if args.sentinels is None:
        return None
    if args.sentinel_image is None and gathered is None:
        raise UserError("--sentinels needs --sentinel-image, a picture of the marks")
    own = range(0)
    if gathered is not None and args.sentinels == (args.dictionary or "DICT_5X5_250"):
        own = range(board_of(args).marker_count)
    try:
        if args.sentinel_image is not None:
            picture = read_picture(args.sentinel_image)
        else:
            assert gathered is not None
            picture = gathered.plane_picture
        size = gathered.size if gathered is not None else args.size
        if (picture.shape[1], picture.shape[0]) != size:
            raise UserError(
                f"--sentinel-image {args.sentinel_image}: {picture.shape[1]} x {picture.shape[0]} px, the calibration "
                f"is for {size[0]} x {size[1]}. Take it with the same camera at the same size"
            )
        found = see_sentinels(picture, args.sentinels, without=own)
    except (CameraError, ContourError) as error:
        raise UserError(f"--sentinels: {error}") from error
    if found is None:
        raise UserError(
            f"--sentinels {args.sentinels}: no such mark is seen. Check name and light, or leave --sentinels out"
        )
    print(f"sentinels {', '.join(str(mark.id) for mark in found.marks)}")
    return found


def _write(
    args: argparse.Namespace,
    calibration: Calibration,
    sentinels: Sentinels | None,
    made: dict[str, str | float | None],
) -> None:
    from datetime import UTC, datetime

    from service.measuring.calibration_file import CalibrationFileError, CalibrationRecord, load_record, save_record

    aligned = False
    if args.output.exists():
        try:
            aligned = load_record(args.output).calibration.aligned
        except CalibrationFileError:
            aligned = False  # what stood there is no calibration that could be lost
    record = CalibrationRecord(calibration, args.camera_name, datetime.now(UTC), sentinels, made)
    try:
        save_record(args.output, record)
    except CalibrationFileError as error:
        raise UserError(str(error)) from error
    print(f"written   {args.output}")
    if aligned:
        print("          the alignment of the file that stood there is gone: run `combtrace align` again")


def _progress(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)


def _squares(text: str) -> tuple[int, int]:
    return _two_numbers(text, "squares such as 11x8")


def picture_size(text: str) -> tuple[int, int]:
    """Width and height of `1600x1200`."""
    return _two_numbers(text, "a size such as 1600x1200")


def _two_numbers(text: str, expected: str) -> tuple[int, int]:
    parts = text.lower().replace("×", "x").split("x")
    if len(parts) != 2 or not all(part.strip().isdecimal() and 0 < int(part) <= 100_000 for part in parts):
        raise argparse.ArgumentTypeError(f"{text!r}: expected {expected}")
    return int(parts[0]), int(parts[1])


def _box(text: str) -> tuple[float, float, float, float]:
    try:
        left, top, right, bottom = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected four numbers such as 200,150,1400,1050") from None
    if not (0 <= left < right and 0 <= top < bottom):
        raise argparse.ArgumentTypeError(f"{text!r}: expected left < right and top < bottom, from 0 on")
    return left, top, right, bottom
