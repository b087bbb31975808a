"""What is told of how jobs fared over a time."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.web.models import Answer


class TrendFigure(Answer):
    """A quantity of the jobs of which it is known."""

    known: int
    mean: float
    least: float
    most: float


class TrendBounds(Answer):
    """Between which bounds accepted jobs lie; null = no bound, or none that is known."""

    least: float | None
    most: float | None


class ReasonCount(Answer):
    """How often; texts by `code` in /api/v1/reasons."""

    code: int
    count: int


class TrendBucket(Answer):
    """Jobs taken at `begin` or in the time until the next bucket, and ended."""

    begin: str
    outcomes: dict[Literal["accepted", "written", "refused", "failed"], int]
    reasons: list[ReasonCount]
    figures: dict[str, TrendFigure] = Field(description="uncertainty_mm, blur_px, level, area_mm2, total_ms, pitch_px")


class RecipeUse(Answer):
    """One state of a recipe's settings; a second one of a number is a change."""

    number: int
    name: str
    jobs: int
    first: str
    last: str


class CalibrationUse(Answer):
    """A calibration by which jobs were carried out."""

    digest: str
    jobs: int
    first: str
    last: str


class MissedCount(Answer):
    """Triggers that came to no job."""

    kind: str
    reason: str
    count: int


class Check(Answer):
    """One `combtrace verify` or `combtrace repeat`."""

    at: str
    kind: str
    calibration: str
    pictures: int
    mean_mm: float
    p95_mm: float
    worst_mm: float
    limit_mm: float
    verdict: str


class Trends(Answer):
    """How jobs fared from `begin` until before `end`, in buckets of step_s."""

    begin: str
    end: str
    step_s: int
    buckets: list[TrendBucket]
    limits: dict[str, TrendBounds]
    recipes: list[RecipeUse]
    calibrations: list[CalibrationUse]
    missed: list[MissedCount]
    checks: list[Check]
