"""A certificate: everything that was measured of a cell, by what, and what it says of the stated limit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import cached_property
from typing import Any, Literal

from contour.length_test.coverage import FEWEST_PLACES
from contour.length_test.study import Study
from contour.length_test.verdict import (
    Conditions,
    Decision,
    FormError,
    LengthError,
    Limit,
    PlaneError,
    height_limit_mm,
    length_errors,
    plane_errors,
    together,
)
from service.certifying import gauge_file
from service.certifying.gauge_file import Gauge
from service.certifying.sight import Sight
from service.measuring.calibration_file import CalibrationRecord
from service.reasons import Rejection

PROCEDURE = "combtrace-accept-1"
"""Changes when figures of two certificates no longer mean the same."""

PLATE_LIMIT_MM = 0.1
"""What `calibrate` asks of positions unless told otherwise."""
BLOCK_LIMIT_MM = 0.5
"""Of a traced block where its recipe states no max_uncertainty_mm: about the bound that contours state."""

_UNTOLD_K = 5.0 / 3.0**0.5
"""Standard uncertainty of a temperature that nobody measured: within 5 K of the reference, any as likely."""
_MEASURED_K = 0.5


LimitBy = Literal["stated", "recipe", "default"]


@dataclass(frozen=True)
class Circumstances:
    """Who tested what, when and how. temperature_c: the gauge's; None = nobody measured it. limit_by: whose it is."""

    made: datetime
    operator: str
    cell: str
    command: str
    version: str
    calibration_file: str
    recipe: str
    limit: Limit
    temperature_c: float | None = None
    places: int = FEWEST_PLACES
    marks_tolerance_px: float = 1.0
    limit_by: LimitBy = "stated"


@dataclass(frozen=True, eq=False)
class Certificate:
    """What was measured. `kept` and `left`: pictures that served and that did not; `findings`: what speaks against the
    cell whatever its errors; `study`: of operators and placements, None where none was made.
    """

    told: Circumstances
    gauge: Gauge
    record: CalibrationRecord
    kept: Sequence[Sight]
    left: Sequence[Sight]
    findings: tuple[Rejection, ...]
    study: Study | None = None

    @cached_property
    def conditions(self) -> Conditions:
        """How the gauge lay."""
        return conditions_of(self.gauge, self.told.temperature_c)

    @cached_property
    def lengths(self) -> tuple[LengthError, ...]:
        """Each length in each picture."""
        return tuple(
            error
            for sight in self.kept
            if sight.gauge is not None
            for error in length_errors(sight.name, sight.gauge, self.gauge.known, self.conditions, self.told.limit)
        )

    @cached_property
    def forms(self) -> tuple[FormError, ...]:
        """The line that comes out least straight, in each picture."""
        form_mm, limit_mm = self.gauge.file.form_mm, self.told.limit.constant_mm
        worst = (
            (sight.name, max(sight.gauge.lines, key=lambda line: line.form_mm)) for sight in self.kept if sight.gauge
        )
        return tuple(FormError(name, line.name, line.form_mm, form_mm, limit_mm) for name, line in worst)

    @cached_property
    def planes(self) -> tuple[PlaneError, ...]:
        """How the plane on which a plate lies comes out in each picture; none of a block."""
        file, calibration = self.gauge.file, self.record.calibration
        seen = [(sight.name, sight.gauge) for sight in self.kept if sight.gauge is not None]
        return plane_errors(seen, file.form_mm, height_limit_mm(calibration, file.height_mm, self.told.limit))

    @property
    def decision(self) -> Decision:
        """Of all errors together; a finding fails."""
        if self.findings:
            return Decision.FAILS
        return together([one.decision for part in (self.lengths, self.forms, self.planes) for one in part])

    @property
    def passes(self) -> bool:
        """True where the stated limit is shown to hold."""
        return self.decision is Decision.PASSES

    @property
    def worst(self) -> LengthError:
        """The length with the largest share of its limit."""
        return max(self.lengths, key=lambda one: abs(one.error_mm) / one.limit_mm)

    @property
    def worst_form(self) -> FormError:
        """The line that comes out least straight."""
        return max(self.forms, key=lambda one: one.form_mm)

    @property
    def worst_plane(self) -> PlaneError | None:
        """The picture in which the plate's plane is farthest from the mean; None of a block."""
        return max(self.planes, key=lambda one: abs(one.off_mm), default=None)

    @property
    def uncertainty_mm(self) -> float:
        """The test's own: the largest expanded one of a length."""
        return max(error.budget.expanded_mm for error in self.lengths)

    @property
    def marks_px(self) -> float | None:
        """How far a fixed mark was from its place at most; None where none was seen."""
        return max((sight.marks_px for sight in (*self.kept, *self.left) if sight.marks_px is not None), default=None)

    @property
    def own_figure_mm(self) -> float | None:
        """What the calibration itself states: 95 % of positions at this height are within it."""
        sure = self.record.calibration.uncertainty
        return None if sure is None else float(sure.figure_mm(self.gauge.file.height_mm))

    @property
    def within_own_figure(self) -> int | None:
        """Lengths whose error twice that figure and the test's uncertainty explain: it is stated for each end."""
        figure = self.own_figure_mm
        if figure is None:
            return None
        return sum(abs(one.error_mm) <= 2 * figure + one.budget.expanded_mm for one in self.lengths)

    @cached_property
    def number(self) -> str:
        """Names it: the time, and the beginning of a hash of all that it says."""
        text = json.dumps(self._content(), sort_keys=True)
        return f"{self.told.made:%Y%m%d-%H%M}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"

    def fields(self) -> dict[str, Any]:
        """The certificate as JSON has it."""
        return {"number": self.number, **self._content()}

    def _content(self) -> dict[str, Any]:
        told, form = self.told, self.worst_form
        return {
            "procedure": PROCEDURE,
            "passes": self.passes,
            "decision": self.decision.value,
            "limit_mm": told.limit.constant_mm,
            "limit_by": told.limit_by,
            "limit_per_m_mm": told.limit.per_m_mm,
            "largest_error_mm": _rounded(max((one.error_mm for one in self.lengths), key=abs)),
            "form_error_mm": _rounded(form.form_mm),
            "form_uncertainty_mm": form.uncertainty_mm,
            "uncertainty_mm": _rounded(self.uncertainty_mm),
            "lengths": [_length(error) for error in self.lengths],
            "forms": [
                {**asdict(one), "form_mm": _rounded(one.form_mm), "decision": one.decision} for one in self.forms
            ],
            "planes": [
                {**asdict(one), "off_mm": _rounded(one.off_mm), "decision": one.decision} for one in self.planes
            ],
            "findings": [{"code": int(reason), "name": reason.label, "detail": text} for reason, text in self.findings],
            "calibration_hash": self.record.digest,
            "calibration_file": told.calibration_file,
            "calibration_created": None if self.record.created is None else self.record.created.isoformat(),
            "calibration_figure_mm": self.own_figure_mm,
            "lengths_within_calibration_figure": self.within_own_figure,
            "marks_largest_px": _rounded(self.marks_px),
            "camera": self.record.camera_name,
            "picture_px": [self.record.calibration.image_width, self.record.calibration.image_height],
            "version": told.version,
            "made": told.made.isoformat(timespec="seconds"),
            "operator": told.operator,
            "cell": told.cell,
            "recipe": told.recipe,
            "command": told.command,
            "temperature_c": told.temperature_c,
            "gauge": gauge_file.fields(self.gauge),
            "pictures": [_picture(sight) for sight in (*self.kept, *self.left)],
            "study": None if self.study is None else asdict(self.study),
        }


def conditions_of(gauge: Gauge, temperature_c: float | None) -> Conditions:
    """How a gauge lies at a temperature; None: within 5 K of that of its calibration."""
    file = gauge.file
    return Conditions(
        file.height_uncertainty_mm,
        file.expansion_um_per_m_k * 1e-6,
        0.0 if temperature_c is None else temperature_c - file.reference_temperature_c,
        _UNTOLD_K if temperature_c is None else _MEASURED_K,
    )


def _length(error: LengthError) -> dict[str, Any]:
    begin, end = error.seen.ends_mm.round(3).tolist()
    return {
        "picture": error.picture,
        "name": error.seen.name,
        "direction_deg": round(error.seen.direction_deg, 1),
        "from_mm": begin,
        "to_mm": end,
        "true_mm": _rounded(error.true_mm),
        "measured_mm": _rounded(error.seen.measured_mm),
        "error_mm": _rounded(error.error_mm),
        "uncertainty_mm": _rounded(error.budget.expanded_mm),
        "limit_mm": _rounded(error.limit_mm),
        "decision": error.decision.value,
    }


def _picture(sight: Sight) -> dict[str, Any]:
    return {"name": sight.name, "pixels_hash": sight.digest, "used": sight.gauge is not None, "refused": sight.refused}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(float(value), 4)
