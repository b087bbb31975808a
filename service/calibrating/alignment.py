"""A calibration's machine frame, by points that a person jogged to."""

from __future__ import annotations

from dataclasses import replace

from contour.camera_calibration.alignment_fit import AlignmentFit
from service.measuring.calibration_file import CalibrationRecord

WORK_POINTS = ("x_mm", "y_mm", "machine_x_mm", "machine_y_mm")


def square_mm(record: CalibrationRecord) -> float | None:
    """The square of the board that it was made from, for advice; None where it was not."""
    told = record.made.get("square_mm")
    return float(told) if isinstance(told, int | float) else None


def aligned(record: CalibrationRecord, fit: AlignmentFit) -> CalibrationRecord:
    """The record with the fit's alignment, and with what its file is to keep of it."""
    calibration = replace(record.calibration, alignment=fit.alignment)  # type: ignore[type-var]
    made = {
        **record.made,
        "alignment_points": float(len(fit.residuals_mm)),
        "alignment_worst_mm": round(float(fit.residuals_mm.max()), 4),
        "alignment_scale": round(fit.scale, 6),
        "alignment_scale_95": round(fit.scale_95, 6),
    }
    return replace(record, calibration=calibration, made=made)
