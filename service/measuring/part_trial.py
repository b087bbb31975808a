"""A recipe's part tried in an accepted block. What lays it there is loaded only where a recipe has a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from contour.calibration.calibration import Calibration
from contour.errors import ParameterError
from contour.geometry.arrays import Bytes
from service.measuring.measurement import Measurement
from service.reasons import Reason

if TYPE_CHECKING:
    from contour.ribbon.ribbon import Ribbon
    from service.config.recipes import AnyRecipe, PartToCut
    from service.parts.part import Part
    from service.parts.sure_block import SureBlock


class PartTrial:
    """Reads each part once, and says where it lies in blocks."""

    def __init__(self) -> None:
        self._parts: dict[PartToCut, Part] = {}

    def part_of(self, asked: PartToCut) -> Part:
        """The part of a recipe; raise PartFileError."""
        from service.parts.part import Asked
        from service.parts.part_file import load_part

        if asked not in self._parts:
            self._parts[asked] = load_part(asked.file, Asked(asked.units or "", asked.layer))
        return self._parts[asked]

    @staticmethod
    def with_ribbon(measured: Measurement, picture: Bytes, calibration: Calibration | None) -> Measurement:
        """The measurement of a block that was accepted, with where its core's ribbon runs, as the picture tells it."""
        from contour.ribbon.ribbon import Ribbon
        from service.parts.core_ribbon import CoreRibbon, core_ribbon

        if measured.findings or measured.pixels is None or calibration is None:
            return measured
        if measured.pitch_px is None:
            return replace(measured, ribbon=CoreRibbon(Ribbon(why=f"{measured.method} does not look at cells")))
        bright, height_mm = measured.polarity == "bright", measured.thickness_mm or 0.0
        ribbon = core_ribbon(
            picture, measured.pixels, measured.pitch_px, bright=bright, calibration=calibration, height_mm=height_mm
        )
        return replace(measured, ribbon=ribbon)

    def tried(self, measured: Measurement, asked: PartToCut, calibration: Calibration | None) -> Measurement:
        """The measurement of a block that was accepted, with where the part lies in it, refused where it does not fit.

        One that was refused before, or is without millimetres, stays as it is.
        """
        from service.parts.fit import fit_part, in_picture

        begun = self._begun(measured, (asked,), calibration)
        if isinstance(begun, Measurement):
            return begun
        (part,), block, known = begun
        try:
            fit = fit_part(part, block, asked.on(_told(measured)))
        except ParameterError as error:
            return _refused(measured, str(error))
        measured = replace(measured, part=in_picture(fit, known, measured.thickness_mm or 0.0))
        return measured if fit.finding is None else _refused(measured, fit.finding)

    def laid(self, measured: Measurement, recipe: AnyRecipe, calibration: Calibration | None) -> Measurement:
        """The same of a recipe with several parts: as many as fit lie in it; refused where none does."""
        from service.parts.fit import in_picture, lay_parts

        begun = self._begun(measured, recipe.parts, calibration)
        if isinstance(begun, Measurement):
            return begun
        parts, block, known = begun
        try:
            wanted = [(part, one.on(_told(measured))) for part, one in zip(parts, recipe.parts, strict=True)]
        except ParameterError as error:
            return _refused(measured, str(error))
        found = lay_parts(wanted, block, recipe.parts_apart_mm, recipe.parts_tries)
        if not found:
            names = ", ".join(dict.fromkeys(part.path.name for part in parts))
            return _refused(
                measured, f"None of the parts fits: {names}. Lay a larger block, or allow less margin or more turns."
            )
        laid = tuple(in_picture(fit, known, measured.thickness_mm or 0.0) for fit in found)
        return replace(measured, parts=laid, wanted=tuple(one.quantity for one in recipe.parts))

    def _begun(
        self, measured: Measurement, asked: Sequence[PartToCut], calibration: Calibration | None
    ) -> Measurement | tuple[list[Part], SureBlock, Calibration]:
        """The parts, the block and how sure it is, the calibration; else the measurement as it ends without them."""
        from service.parts.part import PartFileError
        from service.parts.sure_block import SureBlock

        if measured.findings or measured.millimetres is None or calibration is None:
            return measured
        try:
            parts = [self.part_of(one) for one in asked]
        except PartFileError as error:
            return _refused(measured, f"The part cannot be read: {error}")
        if measured.uncertainty_mm is None:
            return _refused(
                measured,
                "Whether the part fits cannot be said, since it is not known how sure the contour is. Use wall-tips, "
                "and a calibration that knows the scale at the block's height.",
            )
        try:
            block = SureBlock.of(measured.millimetres, measured.uncertainty_mm, measured.evidence or ())
        except PartFileError as error:
            return _refused(measured, f"Whether the part fits cannot be said: {error}")
        if block is None:
            return _refused(measured, "No part fits: nowhere in the block is its edge sure enough. Light it better.")
        return parts, block, calibration


def _told(measured: Measurement) -> Ribbon | None:
    return None if measured.ribbon is None else measured.ribbon.told


def _refused(measured: Measurement, text: str) -> Measurement:
    return replace(measured, findings=((Reason.PART_DOES_NOT_FIT, text),))
