"""A calibration from pictures of a board: made, told, reported."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.calibration.fixed_marks import fixed_marks
from service.cli.errors import UserError
from service.cli.options.board import board_of
from service.cli.options.length import accept_share, known_length, made_of_lengths, tell_lengths
from service.cli.pictures.given_pictures import pictures_of

if TYPE_CHECKING:
    from contour.calibration.fixed_marks import Sentinels
    from contour.calibration.position_uncertainty import PositionUncertainty
    from contour.camera_calibration.board import Board
    from contour.camera_calibration.calibrate import CameraResult
    from service.measuring.board_pictures import Gathered
    from service.measuring.calibration_file import CalibrationRecord


def from_board(args: argparse.Namespace) -> CalibrationRecord | None:
    """What the calibration file is to hold; None where the verdict is not good. Raise UserError."""
    from datetime import UTC, datetime

    from contour.camera_calibration.calibrate import Setup, calibrate_camera
    from contour.errors import CalibrationFailed
    from service.measuring.board_pictures import PlaneViewError, gather_views
    from service.measuring.calibration_file import CalibrationRecord

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
        sentinels = fixed_marks(args, gathered)
        result = calibrate_camera(gathered.views, board, gathered.size, setup, _progress)
    except (PlaneViewError, CalibrationFailed) as error:
        raise UserError(str(error)) from error
    _tell(result, gathered, setup.accept_apart)
    made = made_of(result, board, setup.block_mm)
    _report(args, result, gathered, board, setup, sentinels)
    if not result.verdict.good:
        options = " ".join(result.verdict.overrides)
        print(f"{args.output}: not written. To take it nevertheless: {options}", file=sys.stderr)
        return None
    return CalibrationRecord(result.calibration, args.camera_name, datetime.now(UTC), sentinels, made)


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
    print(f"coverage  corners enclose {verdict.zones.told}{_told_use(verdict.uncertainty)}")
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


def _progress(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)
