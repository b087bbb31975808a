"""The one record of a job's end: a sentence for people, with figures, and all of them as fields."""

from __future__ import annotations

import logging
from typing import Any

from service.logs import event
from service.reasons import Outcome
from service.records.job import Job

STAGES = ("frame_ms", "pages_ms", "transfer_ms", "total_ms")


def log_end(log: logging.Logger, job: Job) -> None:
    """Log how a settled job ended; as a warning where it was not accepted or written."""
    done = job.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN)
    figures = " ".join(f"{name}={value}" for name, value in _figures(job).items() if value is not None)
    sentence = f"job {job.job_id} {job.outcome}{_ending(job, done)} {figures}"
    log.log(logging.INFO if done else logging.WARNING, sentence, extra=event("job", **fields(job)))


def fields(job: Job) -> dict[str, Any]:
    """What JSON says of a job's end."""
    return {
        "job": job.job_id,
        "outcome": str(job.outcome),
        "reason": None if job.reason is None else int(job.reason),
        "reason_name": None if job.reason is None else job.reason.label,
        "detail": job.detail,
        **_figures(job),
        "vertices": job.report.get("vertices"),
        "area_mm2": job.report.get("area_mm2"),
        "frame": job.report.get("frame"),
        "stages_ms": job.report.get("timings_ms", {}),
        "calibration": None if job.terms is None else job.terms.calibration,
        "taken_at": job.taken_at,
    }


def _ending(job: Job, done: bool) -> str:
    report = job.report
    if done and report.get("vertices"):
        area = report.get("area_mm2")
        text = f": {report['vertices']} vertices" + (f", {area:.0f} mm²" if area else "")
        return text + (f" ({job.detail})" if job.detail else "")
    return "" if job.reason is None else f": {int(job.reason)} {job.reason.label}: {job.detail}"


def _figures(job: Job) -> dict[str, Any]:
    """Where it came from, how sure it is, and what it took."""
    recipe = job.trigger.recipe or None if job.terms is None else job.terms.recipe["number"]
    trace_ms = job.report.get("timings_ms", {}).get("total")
    return {
        "trigger": job.trigger.kind,
        "recipe": recipe,
        "uncertainty_mm": job.report.get("uncertainty_mm"),
        "measure_ms": None if trace_ms is None else round(trace_ms, 1),
        **{name: job.report.get(name) for name in STAGES},
    }
