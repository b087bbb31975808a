"""The row of a job: what it came to before beside what it comes to now, or why it was left out."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import numpy as np

from contour.geometry.rings import Contour
from service.reasons import Outcome
from service.records.replay import Apart, apart_of

COLUMNS: Final[dict[str, tuple[str, str]]] = {
    "cell": ("string", "name of the archive, as `--archive CELL=…` gives it"),
    "job_id": ("int64", "number of the job"),
    "taken_at": ("timestamp", "when its trigger was taken, UTC"),
    "recipe": ("int64", "number of its recipe"),
    "recipe_name": ("string", "name of its recipe"),
    "archived_as": ("string", "end that the name of its document says"),
    "outcome_before": ("string", "accepted, written, refused or failed"),
    "outcome_after": ("string", "the same now; what the controller answered is taken for given"),
    "reason_before": ("int64", "code of the first reason; null where there is none"),
    "reason_after": ("int64", "the same now"),
    "text_after": ("string", "that reason with its figures, as a sentence"),
    "flipped": ("bool", "sent now and not before, or the other way round"),
    "identical": ("bool", "everything is as it was, to the last bit"),
    "distance_mm": ("double", "largest between the two outlines, holes too; null where one is missing"),
    "distance_px": ("double", "the same in pixels, where there is no calibration"),
    "area_mm2_before": ("double", "area of the outline"),
    "area_mm2_after": ("double", "the same now"),
    "vertices_before": ("int64", "vertices of the outline"),
    "vertices_after": ("int64", "the same now"),
    "uncertainty_mm_before": ("double", "bound that was stated"),
    "uncertainty_mm_after": ("double", "the same now"),
    "total_ms_before": ("double", "time that measuring took"),
    "total_ms_after": ("double", "the same now"),
    "read_ms": ("double", "time until document and frame were at hand"),
    "combtrace_before": ("string", "version"),
    "combtrace_after": ("string", "version"),
    "numpy_before": ("string", "version"),
    "numpy_after": ("string", "version"),
    "opencv_before": ("string", "version"),
    "opencv_after": ("string", "version"),
    "left_out": ("string", "why it could not be done, by kind; null where it was"),
    "left_out_text": ("string", "the same as a sentence"),
    "worker": ("string", "which process did it"),
}
OF_THE_RUN: Final = ("total_ms_before", "total_ms_after", "read_ms", "worker")
"""Columns that are others each time; total_ms_before where another version measures."""

Row = dict[str, Any]
_HOLDS: Final[dict[str, type]] = {"string": str, "int64": int, "double": float, "bool": bool, "timestamp": datetime}


@dataclass(frozen=True)
class Versions:
    """What does the work."""

    combtrace: str
    numpy: str
    opencv: str


@dataclass(frozen=True)
class Side:
    """What a job came to by one version and one set of settings. codes: why it is refused, empty = it is sent.

    kept: what was measured, as documents keep it.
    """

    codes: tuple[int, ...]
    kept: dict[str, Any]
    versions: Versions

    def contour(self, frame: str) -> Contour | None:
        """The outline in `pixels` or `millimetres`."""
        found = self.kept[frame]
        if found is None:
            return None
        return Contour(np.array(found["exterior"]), tuple(np.array(hole) for hole in found["holes"]))

    def as_before(self, other: Side) -> bool:
        """True where verdict and outline are the same to the last bit."""
        same = all(self.kept[name] == other.kept[name] for name in ("pixels", "millimetres", "uncertainty_mm"))
        return same and self.codes == other.codes


def fitting(row: Row) -> Row:
    """The same, for the table: a damaged document may say anything, and one value would stop the whole run.

    Raise TypeError, ValueError, OverflowError where a column cannot hold its value.
    """
    found: Row = {}
    for column, value in row.items():
        kind = COLUMNS[column][0]
        whole = type(value) is int
        fits = value is None or isinstance(value, _HOLDS[kind]) or (whole and kind == "double")
        if not fits or (isinstance(value, bool) and kind != "bool"):
            raise TypeError(f"{column}: {str(value)[:60]!r}, expected {kind}")
        if whole and kind == "int64" and not -(2**63) <= value < 2**63:
            raise OverflowError(f"{column}: a number that no {kind} holds")
        if isinstance(value, str):
            value.encode()  # a half of a pair of surrogates cannot be written
        found[column] = float(value) if whole and kind == "double" else value
    return found


def row_of(document: dict[str, Any], before: Side, after: Side) -> Row:
    """What the row tells of a job that was done again, but for times of reading and for who did it."""
    apart = apart_between(before, after)
    row: Row = {
        "flipped": bool(after.codes) != bool(before.codes),
        "identical": after.as_before(before),
        "text_after": next((entry["text"] for entry in after.kept["reasons"]), None),
        "distance_mm": apart.distance if apart is not None and apart.unit == "mm" else None,
        "distance_px": apart.distance if apart is not None and apart.unit == "px" else None,
    }
    for name, side in (("before", before), ("after", after)):
        row[f"outcome_{name}"], row[f"reason_{name}"] = _end(document["job"], side.codes)
        for quantity in ("area_mm2", "vertices", "uncertainty_mm"):
            row[f"{quantity}_{name}"] = side.kept[quantity]
        row[f"total_ms_{name}"] = dict(side.kept["timings_ms"]).get("total")
        for program in ("combtrace", "numpy", "opencv"):
            row[f"{program}_{name}"] = getattr(side.versions, program)
    return row


def apart_between(before: Side, after: Side) -> Apart | None:
    """How far the two outlines are apart, in mm where both have them; None where there is none of the two."""
    for frame, unit in (("millimetres", "mm"), ("pixels", "px")):
        was, now = before.contour(frame), after.contour(frame)
        if was is not None and now is not None:
            return apart_of(was, now, unit)
    return None


def job_columns(document: dict[str, Any]) -> Row:
    """What the row tells of the job itself."""
    recipe = dict(document["recipe"] or {})
    return {
        "taken_at": datetime.fromisoformat(document["job"]["taken_at"]),
        "recipe": recipe.get("number"),
        "recipe_name": recipe.get("name"),
    }


def _end(job: dict[str, Any], codes: tuple[int, ...]) -> tuple[str, int | None]:
    """Outcome and reason. What the controller made of a contour that is sent again is taken for given."""
    if codes:
        return str(Outcome.REFUSED), codes[0]
    if job["outcome"] == Outcome.REFUSED:
        return str(Outcome.ACCEPTED), None
    return job["outcome"], job["reason"]
