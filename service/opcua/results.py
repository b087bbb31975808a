"""A job's end as OPC 40100-1 has it: the fields of a result, for the event and for `ResultDataType` alike."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from asyncua import ua

from service.reasons import Outcome, Reason
from service.records.job import Job

COMPLETED, ABORTED, FAILED = 1, 3, 4
FIGURES = ("area_mm2", "uncertainty_mm", "vertices", "thickness_mm")
"""What stands in `ResultContent` after outcome, code, name and detail, in this order."""


def made(name: str, **fields: Any) -> Any:
    """A structure of the companion specification, as the library made it from the nodeset."""
    return vars(ua)[name](**fields)


def recipe_id(settings: Mapping[str, Any]) -> Any:
    """Which recipe, with the hash of its settings that the journal keeps too."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).digest()
    return made("RecipeIdInternalDataType", Id=str(settings["name"]), Hash=digest, HashAlgorithm="SHA-256")


def result_fields(job: Job) -> dict[str, Any]:
    """By the specification's names, of a settled job. No contour is among them."""
    number, terms = str(job.job_id), job.terms
    settled_at = datetime.fromisoformat(job.settled_at or job.taken_at)
    trace_ms = job.report.get("timings_ms", {}).get("total")
    return {
        "ResultId": made("ResultIdDataType", Id=number),
        "JobId": made("JobIdDataType", Id=number),
        "IsPartial": False,
        "ResultState": _state(job),
        "InternalRecipeId": recipe_id({"name": ""} if terms is None else terms.recipe),
        "InternalConfigurationId": made(
            "ConfigurationIdDataType", Id="" if terms is None or terms.calibration is None else terms.calibration
        ),
        "CreationTime": settled_at,
        "ProcessingTimes": made(
            "ProcessingTimesDataType",
            StartTime=datetime.fromisoformat(job.taken_at),
            EndTime=settled_at,
            AcquisitionDuration=job.report.get("frame_ms"),
            ProcessingDuration=trace_ms,
        ),
        "ResultContent": _content(job),
    }


def _state(job: Job) -> int:
    if job.outcome is Outcome.FAILED:
        return ABORTED if job.reason is Reason.ABORTED else FAILED
    return COMPLETED


def _content(job: Job) -> list[ua.Variant]:
    """Outcome, code, name and detail of the reason, then FIGURES; null where a job has none."""
    code, name = (0, "") if job.reason is None else (int(job.reason), job.reason.label)
    head = [
        ua.Variant(str(job.outcome), ua.VariantType.String),
        ua.Variant(code, ua.VariantType.UInt16),
        ua.Variant(name, ua.VariantType.String),
        ua.Variant(job.detail or "", ua.VariantType.String),
    ]
    figures = (job.report.get(name) for name in FIGURES)
    return head + [
        ua.Variant() if figure is None else ua.Variant(float(figure), ua.VariantType.Double) for figure in figures
    ]
