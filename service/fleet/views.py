"""What is told of each cell, as the REST interface answers it and the page shows it: judged once, here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from service.fleet.cells import Cell, number, text
from service.fleet.settings import Fleet
from service.fleet.store import Drift, Figures
from service.web.html import KINDS

SILENT_S = 3.0  # cells say something each second; with the page's own second it is shown within 5
URGENCY = ("lost", "fault", "halted", "starting", "busy", "ready")

Condition = Literal["here", "silent", "gone"]


class Quantity(BaseModel):
    """A day's mean, and by how much it is worse than that of the week before, %; drifts: by more than is allowed."""

    model_config = ConfigDict(frozen=True)
    mean: float | None = None
    worse_percent: float | None = None
    drifts: bool = False


class CellView(BaseModel):
    """One cell. condition: silent = it is said to be there and says nothing; gone = it died, or was never born since
    this page began. Its other fields are then what it said last. Times are Unix ms.
    """

    model_config = ConfigDict(frozen=True)
    group: str
    node: str
    page: str | None
    condition: Condition
    heard_ms: int
    state: str
    kind: str
    state_since_ms: int | None
    reason: str
    reason_code: int
    alarms: list[str]
    warnings: list[str]
    last_job: int | None
    last_outcome: str
    last_settled_ms: int | None
    shift: dict[str, int]
    missed_triggers: int | None
    not_sent: int | None
    uncertainty_mm: Quantity
    blur_px: Quantity
    calibration: str
    calibration_since_ms: int | None
    calibration_age_days: float | None
    calibration_old: bool
    calibration_shared: bool
    recipes: str
    recipes_since_ms: int | None
    recipes_differ: bool
    version: str
    version_since_ms: int | None
    version_differs: bool


class FleetView(BaseModel):
    """All cells, those that need a person first. connected: whether the broker is reached at all."""

    model_config = ConfigDict(frozen=True)
    connected: bool
    cells: list[CellView]


def viewer(settings: Fleet) -> Callable[[Cell, Figures | None, float], CellView]:
    """What makes a view of a cell, its figures, and how long it has been silent, s."""

    def view(cell: Cell, figures: Figures | None, silent_s: float) -> CellView:
        told, found = cell.values, figures or Figures({}, Drift(), Drift())
        here: Condition = "here" if silent_s < SILENT_S else "silent"
        condition: Condition = here if cell.born else "gone"
        state = text(told, "State/Name")
        return CellView(
            group=cell.name[0],
            node=cell.name[1],
            page=_address(text(told, "Service/Page")),
            condition=condition,
            heard_ms=cell.heard_ms,
            state=state,
            kind=KINDS.get(state, "lost") if condition == "here" else "lost",
            state_since_ms=cell.state_since_ms,
            reason=text(told, "State/Reason"),
            reason_code=_whole(told, "State/Reason Code") or 0,
            alarms=text(told, "Alarms/Texts").splitlines(),
            warnings=text(told, "Warnings/Texts").splitlines(),
            last_job=_whole(told, "Job/Number"),
            last_outcome=text(told, "Job/Outcome"),
            last_settled_ms=_whole(told, "Job/Settled"),
            shift=found.outcomes,
            missed_triggers=_whole(told, "Counters/Missed Triggers"),
            not_sent=_whole(told, "Counters/Not Sent"),
            uncertainty_mm=_quantity(found.uncertainty, settings),
            blur_px=_quantity(found.blur, settings),
            calibration_old=_is_old(told, settings),
            calibration_shared=False,
            recipes_differ=False,
            version_differs=False,
            **_versions(told),
        )

    return view


def _versions(told: dict[str, Any]) -> dict[str, Any]:
    return {
        "calibration": text(told, "Calibration/Hash").removeprefix("sha256:"),
        "calibration_since_ms": _whole(told, "Calibration/Since"),
        "calibration_age_days": number(told, "Calibration/Age days"),
        "recipes": text(told, "Recipes/Hash"),
        "recipes_since_ms": _whole(told, "Recipes/Since"),
        "version": text(told, "Service/Version"),
        "version_since_ms": _whole(told, "Service/Since"),
    }


def compared(views: Iterable[CellView]) -> list[CellView]:
    """The same, held against one another: recipes within a group, versions in the plant, and calibrations, of which
    each belongs to one camera; those that need a person first.
    """
    cells = list(views)
    recipes = {group: _usual(one.recipes for one in cells if one.group == group) for group in {c.group for c in cells}}
    version = _usual(one.version for one in cells)
    calibrations = Counter(one.calibration for one in cells if one.calibration)
    found = [
        one.model_copy(
            update={
                "recipes_differ": bool(one.recipes) and one.recipes != recipes[one.group],
                "version_differs": bool(one.version) and one.version != version,
                "calibration_shared": calibrations[one.calibration] > 1,
            }
        )
        for one in cells
    ]
    return sorted(found, key=lambda one: (URGENCY.index(one.kind), one.group, one.node))


def _usual(values: Iterable[str]) -> str:
    """The most frequent, of equally frequent ones the last by name: of two versions the later."""
    counts = Counter(value for value in values if value)
    return max(counts, key=lambda value: (counts[value], value), default="")


def _quantity(drift: Drift, settings: Fleet) -> Quantity:
    worse = drift.worse_percent
    return Quantity(mean=drift.mean, worse_percent=worse, drifts=worse is not None and worse > settings.drift_percent)


def _is_old(told: dict[str, Any], settings: Fleet) -> bool:
    age, allowed = number(told, "Calibration/Age days"), number(told, "Calibration/Max Age days") or 0
    return age is not None and age > min(allowed or settings.calibration_days, settings.calibration_days)


def _whole(told: dict[str, Any], name: str) -> int | None:
    found = number(told, name)
    return None if found is None or not abs(found) < 2**63 else int(found)


def _address(url: str) -> str | None:
    """Whoever may write at the broker must not make the page lead to a script."""
    return url if url.startswith(("http://", "https://")) else None
