"""A calibration from pictures of a board: what its file is to hold, with all that speaks for it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from contour.calibration.fixed_marks import Sentinels
from contour.camera_calibration.board import Board
from contour.camera_calibration.calibrate import CameraResult, Setup, calibrate_camera
from contour.camera_calibration.length_check import LengthCheck
from service.measuring.board_pictures import Gathered, Progress, gather_views
from service.measuring.calibration_file import CalibrationRecord
from service.measuring.calibration_report import write_report


@dataclass(frozen=True, eq=False)
class BoardCalibration:
    """What was made of pictures of a board. The record may be written where the result's verdict is good."""

    gathered: Gathered
    board: Board
    setup: Setup
    result: CameraResult
    record: CalibrationRecord

    def report(self, path: Path) -> None:
        """Write the report; raise OSError."""
        write_report(path, self.result, self.gathered, self.board, self.setup, self.record.sentinels)


def calibrate_board(
    plane: Path,
    images: Sequence[Path],
    board: Board,
    setup: Setup,
    see_marks: Callable[[Gathered], Sentinels | None],
    now: Callable[[], datetime],
    on_progress: Progress,
) -> BoardCalibration:
    """Raise PlaneViewError, CalibrationFailed, and what `see_marks` raises."""
    gathered = gather_views(plane, images, board, on_progress)
    sentinels = see_marks(gathered)
    result = calibrate_camera(gathered.views, board, gathered.size, setup, on_progress)
    made = _made_of(result, board, setup.block_mm)
    record = CalibrationRecord(result.calibration, setup.camera_name, now(), sentinels, made)
    return BoardCalibration(gathered, board, setup, result, record)


def _made_of(result: CameraResult, board: Board, block_mm: float) -> dict[str, str | float | None]:
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


def made_of_lengths(lengths: Sequence[LengthCheck]) -> dict[str, str | float | None]:
    """What the calibration file keeps of the comparisons."""
    told = "; ".join(f"{check.what}: {check.solved_mm:.1f} mm, measured {check.measured_mm:g}" for check in lengths)
    return {"compared_lengths": told} if told else {}
