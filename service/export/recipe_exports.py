"""What a recipe says of exports, made ready."""

from __future__ import annotations

import numpy as np

from contour.geometry.rings import Contour
from service.config.recipes import Gcode, Recipe
from service.export.document import ExportDocument, ExportError
from service.export.files import exported, read_template
from service.export.forms import ENDINGS
from service.export.gcode import TEMPLATE, GcodeSettings
from service.measuring.measurement import Measurement


def gcode_settings(recipe: Recipe) -> GcodeSettings:
    """How the recipe wants its G-code; raise ExportError where its template cannot be read."""
    asked = recipe.gcode
    return GcodeSettings(
        feed_mm_min=asked.feed_mm_min,
        plunge_mm_min=asked.plunge_mm_min,
        safe_z_mm=asked.safe_z_mm,
        cut_z_mm=asked.cut_z_mm,
        path_tolerance_mm=asked.path_tolerance_mm,
        direction=asked.direction,
        lead_in_mm=asked.lead_in_mm,
        template=TEMPLATE if asked.template is None else read_template(asked.template),
    )


def trial(recipe: Recipe) -> list[str]:
    """What keeps the recipe's exports from being made of a plain square, at its thickness; empty where nothing does.

    G-code is tried where `gcode` says anything, also without `exports`: `combtrace trace --gcode` takes it from there.
    """
    side_mm = 10 * max(recipe.gcode.lead_in_mm, 10.0)
    square = np.array([[0.0, 0.0], [side_mm, 0.0], [side_mm, side_mm], [0.0, side_mm]])
    document = ExportDocument(Contour(square), "trial", recipe.thickness_mm)
    forms = dict.fromkeys((*recipe.exports, *(["gcode"] if recipe.gcode != Gcode() else [])))
    return [error for form in forms if (error := _tried(form, document, recipe)) is not None]


def _tried(form: str, document: ExportDocument, recipe: Recipe) -> str | None:
    try:
        exported(form, document, lambda: gcode_settings(recipe))
    except ExportError as error:
        return f"{form}: {error}"
    return None


def document_of(measurement: Measurement, title: str) -> ExportDocument | None:
    """The contour, and the parts in it, to be exported; None of one that was refused, or is in pixels alone."""
    contour, thickness_mm = measurement.millimetres, measurement.thickness_mm
    if measurement.findings or contour is None or thickness_mm is None:
        return None
    placed = tuple(fit.placed for fit in measurement.laid)
    return ExportDocument(contour, title, thickness_mm, measurement.uncertainty_mm, placed)


def exports_of(recipe: Recipe, measurement: Measurement, title: str) -> tuple[dict[str, bytes], list[str]]:
    """The files that the recipe wants beside a job's evidence, by name, none of a refused one; and what went wrong."""
    document = document_of(measurement, title)
    if document is None:
        return {}, []
    files, errors = {}, []
    for form in recipe.exports:
        try:
            files[f"contour.{ENDINGS[form]}"] = exported(form, document, lambda: gcode_settings(recipe))
        except ExportError as error:
            errors.append(f"{form}: {error}")
    return files, errors
