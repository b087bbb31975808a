"""A history as the REST interface tells it."""

from __future__ import annotations

from service.measuring.trend_file import COLUMNS
from service.records.journal_file import stamp
from service.trends.history import Bucket, History
from service.trends.limits import limits_of
from service.web import trend_models as models


def answer(history: History) -> models.Trends:
    """All of it."""
    return models.Trends(
        begin=stamp(history.span.begin),
        end=stamp(history.span.end),
        step_s=history.span.step_s,
        buckets=[_bucket(bucket) for bucket in history.buckets],
        limits={name: models.TrendBounds(least=least, most=most) for name, (least, most) in limits_of(history).items()},
        recipes=[models.RecipeUse(number=one.number, name=one.name, **vars(one.use)) for one in history.recipes],
        calibrations=[models.CalibrationUse(digest=one.digest, **vars(one.use)) for one in history.calibrations],
        missed=[
            models.MissedCount(kind=kind, reason=reason, count=count)
            for (kind, reason), count in history.missed.items()
        ],
        checks=[
            models.Check(at=stamp(line.time), kind=line.check, **{name: getattr(line, name) for name in COLUMNS[2:]})
            for line in history.checks
        ],
    )


def _bucket(bucket: Bucket) -> models.TrendBucket:
    figures = {
        name: models.TrendFigure(known=one.known, mean=one.mean, least=one.least, most=one.most)
        for name, one in bucket.figures.items()
        if one.known
    }
    return models.TrendBucket.model_validate(
        {
            "begin": stamp(bucket.begin),
            "outcomes": bucket.outcomes,
            "reasons": [{"code": code, "count": count} for code, count in bucket.reasons.most_common()],
            "figures": figures,
        }
    )
