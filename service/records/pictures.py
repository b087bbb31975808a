"""Overlays on disk."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.image.overlay import draw_overlay
from service.measuring.measurement import Measurement


class PictureFileError(Exception):
    """A picture cannot be written: where, and why."""


def write_overlay(path: Path, picture: NDArray[np.uint8], measurement: Measurement) -> None:
    """Write the picture with the contour over it; the format follows the ending. Raise PictureFileError."""
    write_picture(path, overlay(picture, measurement))


def overlay(picture: NDArray[np.uint8], measurement: Measurement) -> NDArray[np.uint8]:
    """The picture as BGR with all that was measured in it."""
    return draw_overlay(
        picture,
        measurement.pixels,
        caption=caption(measurement),
        refused=bool(measurement.findings),
        uncertainty_px=measurement.uncertainty_px,
        shown_px=measurement.shown_px,
        hidden=measurement.hidden,
        parts=[fit.drawn for fit in measurement.laid if fit.drawn is not None],
        ribbon=None if measurement.ribbon is None else measurement.ribbon.line_px,
    )


def write_picture(path: Path, pixels: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write the picture, grey or BGR; the format follows the ending, PNG without one. Raise PictureFileError."""
    try:
        done, data = cv2.imencode(path.suffix or ".png", pixels)
        if not done:
            raise PictureFileError(f"{path}: could not be encoded. Use .png or .jpg")
        path.write_bytes(data.tobytes())
    except cv2.error as error:
        raise PictureFileError(f"{path}: {path.suffix!r} is no picture format known here. Use .png or .jpg") from error
    except OSError as error:
        raise PictureFileError(f"{path}: cannot be written: {error.strerror}. Name another file") from error


def caption(measurement: Measurement) -> list[str]:
    """Lines for the overlay: the verdict, and what was found."""
    verdict = "accepted"
    if measurement.findings:
        code, _ = measurement.findings[0]
        verdict = f"refused: {int(code)} {code.label}"
    found = measurement.method
    if measurement.pixels is not None:
        found += f", {measurement.pixels.point_count} vertices"
    if measurement.area_mm2 is not None and measurement.size_mm is not None:
        width, height = measurement.size_mm
        found += f", {measurement.area_mm2:.0f} mm2, {width:.1f} x {height:.1f} mm"
    if measurement.uncertainty_mm is not None:
        found += f", within {measurement.uncertainty_mm:.2f} mm"
    elif measurement.uncertainty_px is not None:
        found += f", within {measurement.uncertainty_px:.1f} px"
    ribbon = [] if measurement.ribbon is None else [measurement.ribbon.words]
    part = measurement.part
    if part is None:
        laid = [f"part {number}: {laid} of {wanted}" for number, laid, wanted in measurement.laid_of_each]
        return [verdict, found, *ribbon, *([f"laid: {', '.join(laid)}"] if laid else [])]
    laid_one = f"{part.part.path.name}: margin {part.margin_mm:.2f} mm, needed {part.needed_mm:.2f} mm"
    return [verdict, found, *ribbon, laid_one]
