"""Board views become a calibrated camera over its table, with figures that say how sure it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from contour.calibration.calibration import CameraCalibration
from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import BoardView
from contour.camera_calibration.calibration_spread import noise_px
from contour.camera_calibration.calibration_verdict import Solution, Verdict, judge_calibration
from contour.camera_calibration.length_check import (
    REFUSE_SHARE,
    KnownLength,
    LengthCheck,
    board_length_check,
    camera_height_check,
)
from contour.camera_calibration.lens_models import LensModel, Progress, Trial, choose_model, residuals, solve
from contour.camera_calibration.view_selection import (
    Dropped,
    check_count,
    check_turned,
    no_camera,
    observe,
    without_blurred,
    without_duplicates,
    without_outliers,
)
from contour.errors import CalibrationError, CalibrationFailed
from contour.geometry.arrays import Float64s
from contour.image import opencv_boards as cv
from contour.image.opencv import rotation_matrix

FOLDS = 5
WIDEST_VIEW_DEG, NARROWEST_VIEW_DEG = 150.0, 2.0
FARTHEST_MM, NEAREST_MM = 6000.0, 150.0


@dataclass(frozen=True)
class Setup:
    """What a person says of the calibration besides its views.

    `plane` names the view whose board lies flat on the table; the pattern lies `board_thickness_mm` above it.
    `block_mm` is the height for which the verdict is given besides the table; `accept_mm` the largest 95 % figure that
    counts as good. `camera_height_mm` and `known_length`, where they were measured, are compared with what the views
    say; from `accept_apart`, a share, the calibration is not good. `area_px` (left, top, right, bottom) is where blocks
    will lie, and must be covered; with `accept_uncovered` neither that nor half of the picture must be.
    """

    plane: str
    board_thickness_mm: float = 0.0
    block_mm: float = 60.0
    accept_mm: float = 0.1
    camera_height_mm: float | None = None
    known_length: KnownLength | None = None
    accept_apart: float = REFUSE_SHARE
    area_px: tuple[float, float, float, float] | None = None
    accept_uncovered: bool = False
    camera_name: str = ""


@dataclass(frozen=True, eq=False)
class CameraResult:
    """A calibration, what it was made of, and what speaks for it."""

    calibration: CameraCalibration
    model: LensModel
    trials: tuple[Trial, ...]
    views: tuple[BoardView, ...]
    residuals_px: tuple[Float64s, ...]
    """Seen less expected, of each view's corners."""
    dropped: tuple[Dropped, ...]
    noise_px: float
    turn_deg: float
    """The largest angle between two boards."""
    lengths: tuple[LengthCheck, ...]
    verdict: Verdict


def calibrate_camera(
    views: Sequence[BoardView],
    board: Board,
    size: tuple[int, int],
    setup: Setup,
    on_progress: Progress = lambda _text: None,
) -> CameraResult:
    """The calibration of the camera that took views of (width, height) px; raise CalibrationFailed with the reason."""
    if setup.plane not in {view.name for view in views}:
        raise CalibrationFailed(f"{setup.plane}, the --plane view, is not among the usable views. Take it again")
    if setup.known_length is not None:
        setup.known_length.check(size)
    on_progress(f"looking for outliers among {len(views)} views")
    sharp, blurred = without_blurred(views, setup.plane)
    single, twins = without_duplicates(sharp, setup.plane)
    check_count(single, [*blurred, *twins])
    kept, outliers = without_outliers(single, board, size, setup.plane)
    dropped = (*blurred, *twins, *outliers)
    check_count(kept, dropped)
    observed = observe(kept, board)
    model, trials = choose_model(observed, size, FOLDS, on_progress)
    solved = solve(observed, size, model)
    if solved is None:
        raise CalibrationFailed(no_camera(len(kept)))
    turn_deg = check_turned(solved)
    check_plausible(solved, size, board, setup)
    plane = [view.name for view in kept].index(setup.plane)
    calibration = _calibration(solved, plane, size, setup)
    lengths = _lengths(calibration, board, setup)
    verdict = judge_calibration(observed, Solution(size, model, solved, plane), setup, lengths, on_progress)
    calibration = replace(calibration, uncertainty=verdict.uncertainty)
    misses = tuple(residuals(observed, solved))
    noise = noise_px(observed, solved, model)
    return CameraResult(
        calibration, model, tuple(trials), tuple(kept), misses, dropped, noise, turn_deg, lengths, verdict
    )


def _lengths(calibration: CameraCalibration, board: Board, setup: Setup) -> tuple[LengthCheck, ...]:
    found = []
    if setup.camera_height_mm is not None:
        height_mm = float(calibration.camera_position[2])
        found.append(camera_height_check(height_mm, setup.camera_height_mm, board.square_mm, setup.board_thickness_mm))
    if setup.known_length is not None:
        found.append(board_length_check(calibration, setup.known_length, board.square_mm))
    return tuple(found)


def _calibration(solved: cv.Solved, plane: int, size: tuple[int, int], setup: Setup) -> CameraCalibration:
    rotation = solved.rotations[plane]
    try:
        return CameraCalibration(
            image_width=size[0],
            image_height=size[1],
            camera_matrix=solved.camera_matrix,
            distortion_coefficients=solved.distortion,
            rotation_vector=rotation,
            translation_mm=table_translation(rotation, solved.translations[plane], setup.board_thickness_mm),
            camera_name=setup.camera_name,
        )
    except CalibrationError as error:
        raise CalibrationFailed(f"the views give no usable camera: {error}") from error


def table_translation(rotation: Float64s, translation_mm: Float64s, board_thickness_mm: float) -> Float64s:
    """The translation of the table's frame, whose z = 0 lies under a board that thick, shape (3,)."""
    return np.asarray(translation_mm - rotation_matrix(rotation)[:, 2] * board_thickness_mm)


def check_plausible(solved: cv.Solved, size: tuple[int, int], board: Board, setup: Setup) -> None:
    """Raise where lens or distance are none that a camera over a table has.

    A wrong square size leaves the focal length in pixels alone and scales the distance: that is what gives it away.
    """
    focal = float(solved.camera_matrix[1, 1])
    width_deg = float(2 * np.degrees(np.arctan(size[0] / 2 / focal)))
    if not NARROWEST_VIEW_DEG <= width_deg <= WIDEST_VIEW_DEG:
        raise CalibrationFailed(
            f"the focal length is implausible: {focal:.0f} px for a picture {size[0]} px wide, {width_deg:.1f} degrees "
            f"of view, expected {NARROWEST_VIEW_DEG:g} to {WIDEST_VIEW_DEG:g}. Tilt the board more, to all sides"
        )
    distance = float(np.median(np.linalg.norm(solved.translations, axis=1)))
    # A height by tape tells more than these bounds: the verdict compares it.
    if setup.camera_height_mm is None and not NEAREST_MM <= distance <= FARTHEST_MM:
        raise CalibrationFailed(
            f"focal length and square size are implausible together: {focal:.0f} px puts the camera {distance:.0f} mm "
            f"from the boards, expected {NEAREST_MM:g} to {FARTHEST_MM:g}. Check --square-mm {board.square_mm:g} (ten "
            "times too large or small?), or give the measured --camera-height-mm if it is right"
        )
    _check_block(solved, setup)


def _check_block(solved: cv.Solved, setup: Setup) -> None:
    """Raise where the camera does not stand well above the block: the verdict looks up to twice its height."""
    lowest = float(np.linalg.norm(solved.translations, axis=1).min())
    if 2 * setup.block_mm >= 0.9 * lowest:
        raise CalibrationFailed(
            f"--block-mm {setup.block_mm:g} reaches up to the camera, which stands {lowest:.0f} mm from the nearest "
            "board. Give the block's thickness, and check --square-mm"
        )
