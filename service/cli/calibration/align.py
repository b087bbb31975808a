"""`combtrace align`: the machine frame against the work frame, from points that a person jogged to."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contour.calibration.calibration import Calibration
    from contour.camera_calibration.alignment_fit import AlignmentFit

HELP = "tie the calibration to the machine's own coordinates"
DESCRIPTION = """\
Fit turn and shift from the work frame to the machine frame through points that a person
jogged the tool to, and write them into the calibration file. The CSV file's header says
what its points are:

  x_mm,y_mm,machine_x_mm,machine_y_mm     work-frame points, such as corners of the board
  x_px,y_px,machine_x_mm,machine_y_mm     pixels of marks at --height-mm

Three points or more, spread over the table; four show which of them is off. The scale
between both is told and not applied: a scale that is not 1 is a wrong square size or a
wrong unit. Rows of the same place are repeats: they tell how well you jog, and with it
how far off a point may lie; without any, --jog-mm does.

Exit status: 0 written, 3 refused (a point is farther off than jogging explains, or the
scale is not 1 within --accept-scale-percent), 2 unusable input."""

PIXELS = ("x_px", "y_px", "machine_x_mm", "machine_y_mm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Points, the calibration, and the bound."""
    parser.add_argument("--points", type=Path, required=True, metavar="FILE", help="CSV of points")
    parser.add_argument("--calibration", type=Path, required=True, metavar="FILE", help="the file to align")
    parser.add_argument("--output", type=Path, metavar="FILE", help="write there instead")
    parser.add_argument("--height-mm", type=float, default=0.0, metavar="H", help="height of pixel points; default 0")
    parser.add_argument(
        "--jog-mm", type=float, default=0.15, metavar="MM", help="spread of jogging, one sigma; default 0.15"
    )
    parser.add_argument(
        "--accept-mm", type=float, metavar="MM", help="largest residual; default: what the spread explains"
    )
    parser.add_argument(
        "--accept-scale-percent", type=float, default=0.1, metavar="P", help="largest scale error; default 0.1"
    )


def run(args: argparse.Namespace) -> int:
    """Fit, print, write."""
    from contour.camera_calibration.alignment_fit import AlignmentLimits, fit_alignment
    from contour.errors import CalibrationError, CalibrationFailed
    from service.calibrating.alignment import WORK_POINTS, aligned, square_mm
    from service.measuring.calibration_file import CalibrationFileError, load_record, save_record
    from service.measuring.points_file import PointsFileError, read_points

    if not -1000 <= args.height_mm <= 10_000:
        raise UserError(f"--height-mm {args.height_mm:g}: expected -1000 to 10000")
    for name in ("accept_mm", "accept_scale_percent", "jog_mm"):
        value = getattr(args, name)
        if value is not None and not 0 < value < 1e4:
            raise UserError(f"--{name.replace('_', '-')} {value:g}: expected a number above 0")
    try:
        record = load_record(args.calibration)
        layout, table = read_points(args.points, [WORK_POINTS, PIXELS])
        work = _work_points(table[:, :2], record.calibration, args.height_mm) if layout == PIXELS else table[:, :2]
        limits = AlignmentLimits(args.accept_mm, args.accept_scale_percent / 100, args.jog_mm, square_mm(record))
        fit = fit_alignment(work, table[:, 2:], limits)
    except (CalibrationFileError, PointsFileError) as error:
        raise UserError(str(error)) from error
    except (CalibrationFailed, CalibrationError) as error:
        raise UserError(f"{args.points}: {error}") from error
    _tell(fit, args.accept_scale_percent / 100)
    if fit.refusal is not None:
        options = " ".join(fit.refusal.overrides)
        nevertheless = f". To take it nevertheless: {options}" if options else ""
        raise UserError(f"{args.points}: {fit.refusal.text}{nevertheless}", EXIT_REFUSED)
    path = args.output or args.calibration
    try:
        save_record(path, aligned(record, fit))
    except CalibrationFileError as error:
        raise UserError(str(error)) from error
    print(f"written   {path}")
    return EXIT_OK


def _tell(fit: AlignmentFit, accept_scale: float) -> None:
    for number, miss in enumerate(fit.residuals_mm, 1):
        print(f"point {number}: off by {miss:.3f} mm")
    x, y = fit.alignment.translation_mm
    print(f"turn      {fit.alignment.rotation_deg:.4f} degrees")
    print(f"shift     {x:.3f}, {y:.3f} mm")
    print(f"scale     {fit.scale:.6f}, told and not applied; ± {fit.scale_95:.6f} (95 %)")
    if fit.scale_95 > accept_scale:
        print("          the points do not tell it that well: jog to points farther apart, or to each again")
    source = f"by {fit.repeats} repeats" if fit.repeats else "as told (--jog-mm); jog to points twice to measure it"
    print(f"jogging   {fit.spread_mm:.3f} mm {source}; explains misses up to {fit.allowed_mm.min():.3f} mm")
    if len(fit.first_points) == 3:
        print("          3 places show that one is off, not which: jog to a fourth")


def _work_points(pixels: NDArray[np.float64], calibration: Calibration, height_mm: float) -> NDArray[np.float64]:
    """Work points of pixels at a height; raise UserError where the calibration does not know that height."""
    if not calibration.height_known(height_mm):
        own_mm = getattr(calibration, "plane_height_mm", 0.0)
        raise UserError(
            f"--height-mm {height_mm:g}: the calibration does not know its scale there. Take marks on its own plane, "
            f"and --height-mm {own_mm:g}"
        )
    sure = calibration.uncertainty
    for x, y in [] if sure is None else sure.uncovered(pixels):
        print(f"WARNING   pixel ({x:g}, {y:g}) lies where the calibration is not covered: take a mark inside")
    return calibration.to_work(pixels, height_mm)
