"""A calibration of one plane from measured points, or from a scale alone."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.calibration.fixed_marks import fixed_marks
from service.cli.errors import EXIT_REFUSED, UserError
from service.cli.options.length import compare_span

if TYPE_CHECKING:
    from contour.calibration.calibration import Calibration
    from service.measuring.calibration_file import CalibrationRecord


def without_board(args: argparse.Namespace, way: str) -> CalibrationRecord:
    """What the calibration file is to hold, by `points` or `scale`; raise UserError."""
    from datetime import UTC, datetime

    from service.calibrating.from_board import made_of_lengths
    from service.measuring.calibration_file import CalibrationRecord

    if way == "points":
        calibration, cause = _from_points(args), "Check the points' millimetres: all times {factor} would agree"
    else:
        calibration, cause = _from_scale(args), "Check --scale: {factor} times as much would agree"
    compared = made_of_lengths(compare_span(args, calibration, cause))
    sentinels, made = fixed_marks(args, None), {"made_from": way, **compared}
    return CalibrationRecord(calibration, args.camera_name, datetime.now(UTC), sentinels, made)


def _from_points(args: argparse.Namespace) -> Calibration:
    """The map through all points, each point's miss told; raise UserError where one is off by too much."""
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
    """One scale for the whole picture; raise UserError."""
    from contour.calibration.calibration import SimpleCalibration
    from contour.errors import CalibrationError

    width, height = args.size
    origin = (0.0, height - 1.0) if args.origin_px is None else args.origin_px
    try:
        return SimpleCalibration(width, height, args.scale, origin, args.plane_height_mm)
    except CalibrationError as error:
        raise UserError(str(error)) from error
