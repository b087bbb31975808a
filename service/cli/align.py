"""`combtrace align`: the machine frame against the work frame, from points that a person jogged to."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, EXIT_REFUSED, UserError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from contour.calibration import Calibration

HELP = "tie the calibration to the machine's own coordinates"
DESCRIPTION = """\
Fit turn and shift from the work frame to the machine frame through points that a person
jogged the tool to, and write them into the calibration file. The CSV file's header says
what its points are:

  x_mm,y_mm,machine_x_mm,machine_y_mm     work-frame points, such as corners of the board
  x_px,y_px,machine_x_mm,machine_y_mm     pixels of marks at --height-mm

Three points or more, spread over the table. The scale between both is told and not
applied: a scale that is not 1 is a wrong square size or a wrong unit.

Exit status: 0 written, 3 refused (a point is farther off than --accept-mm), 2 unusable
input."""

WORK = ("x_mm", "y_mm", "machine_x_mm", "machine_y_mm")
PIXELS = ("x_px", "y_px", "machine_x_mm", "machine_y_mm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Points, the calibration, and the bound."""
    parser.add_argument("--points", type=Path, required=True, metavar="FILE", help="CSV of points")
    parser.add_argument("--calibration", type=Path, required=True, metavar="FILE", help="the file to align")
    parser.add_argument("--output", type=Path, metavar="FILE", help="write there instead")
    parser.add_argument("--height-mm", type=float, default=0.0, metavar="H", help="height of pixel points; default 0")
    parser.add_argument("--accept-mm", type=float, default=0.5, metavar="MM", help="largest residual; default 0.5")


def run(args: argparse.Namespace) -> int:
    """Fit, print, write."""
    from contour.alignment_fit import fit_alignment
    from contour.errors import CalibrationError, CalibrationFailed
    from service.calibration_file import CalibrationFileError, load_record, save_record
    from service.points_file import PointsFileError, read_points

    if not -1000 <= args.height_mm <= 10_000:
        raise UserError(f"--height-mm {args.height_mm:g}: expected -1000 to 10000")
    if not 0 < args.accept_mm < 1e4:
        raise UserError(f"--accept-mm {args.accept_mm:g}: expected a number above 0")
    try:
        record = load_record(args.calibration)
        layout, table = read_points(args.points, [WORK, PIXELS])
        work = _work_points(table[:, :2], record.calibration, args.height_mm) if layout == PIXELS else table[:, :2]
        fit = fit_alignment(work, table[:, 2:], args.accept_mm)
    except (CalibrationFileError, PointsFileError) as error:
        raise UserError(str(error)) from error
    except CalibrationFailed as error:
        far = "from the rigid fit" in str(error)
        raise UserError(f"{args.points}: {error}", EXIT_REFUSED if far else 2) from error
    except CalibrationError as error:
        raise UserError(f"{args.points}: {error}") from error
    for number, miss in enumerate(fit.residuals_mm, 1):
        print(f"point {number}: off by {miss:.3f} mm")
    x, y = fit.alignment.translation_mm
    print(f"turn      {fit.alignment.rotation_deg:.4f} degrees")
    print(f"shift     {x:.3f}, {y:.3f} mm")
    print(f"scale     {fit.scale:.6f}, told and not applied")
    calibration = replace(record.calibration, alignment=fit.alignment)  # type: ignore[type-var]
    made = {
        **record.made,
        "alignment_points": float(len(work)),
        "alignment_worst_mm": round(float(fit.residuals_mm.max()), 4),
        "alignment_scale": round(fit.scale, 6),
    }
    path = args.output or args.calibration
    try:
        save_record(path, replace(record, calibration=calibration, made=made))
    except CalibrationFileError as error:
        raise UserError(str(error)) from error
    print(f"written   {path}")
    return EXIT_OK


def _work_points(pixels: NDArray[np.float64], calibration: Calibration, height_mm: float) -> NDArray[np.float64]:
    """Work points of pixels at a height; raise UserError where the calibration does not know that height."""
    if not calibration.height_known(height_mm):
        raise UserError(f"--height-mm {height_mm:g}: the calibration does not know its scale there. Use its own plane")
    return calibration.to_work(pixels, height_mm)
