"""A calibration from pictures of a board: made, told, reported."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.calibration.fixed_marks import fixed_marks
from service.cli.errors import UserError
from service.cli.options.board import board_of
from service.cli.options.length import accept_share, known_length, tell_lengths
from service.cli.pictures.given_pictures import pictures_of

if TYPE_CHECKING:
    from contour.calibration.position_uncertainty import PositionUncertainty
    from contour.camera_calibration.calibrate import CameraResult
    from service.calibrating.from_board import BoardCalibration
    from service.measuring.board_pictures import Gathered
    from service.measuring.calibration_file import CalibrationRecord


def from_board(args: argparse.Namespace) -> CalibrationRecord | None:
    """What the calibration file is to hold; None where the verdict is not good. Raise UserError."""
    from datetime import UTC, datetime

    from contour.camera_calibration.calibrate import Setup
    from contour.errors import CalibrationFailed
    from service.calibrating.from_board import calibrate_board
    from service.measuring.board_pictures import PlaneViewError

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
        made = calibrate_board(
            args.plane,
            pictures_of(args.images),
            board,
            setup,
            lambda gathered: fixed_marks(args, gathered),
            lambda: datetime.now(UTC),
            _progress,
        )
    except (PlaneViewError, CalibrationFailed) as error:
        raise UserError(str(error)) from error
    _tell(made.result, made.gathered, setup.accept_apart)
    _report(report_path(args), made)
    if not made.result.verdict.good:
        options = " ".join(made.result.verdict.overrides)
        print(f"{args.output}: not written. To take it nevertheless: {options}", file=sys.stderr)
        return None
    return made.record


def report_path(args: argparse.Namespace) -> Path:
    """Where the report goes."""
    path: Path = args.report or args.output.with_suffix(".html")
    return path


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


def _report(path: Path, made: BoardCalibration) -> None:
    try:
        made.report(path)
    except OSError as error:
        raise UserError(f"--report {path}: cannot be written: {error.strerror}. Name another file") from error
    print(f"report    {path}")


def _progress(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)
