"""Sections of which a page of trends and a shift's report are made: HTML without style or script."""

from __future__ import annotations

import html
from collections.abc import Sequence
from datetime import datetime
from math import nan

from service.measuring.trend_file import CHECKS
from service.reasons import Language, Outcome, Reason
from service.trends.chart import Bar, Mark, bar_chart, line_chart
from service.trends.history import Bucket, Figure, History
from service.trends.limits import Bounds, limits_of
from service.trends.words import moment, number, words

SHOWN = ("uncertainty_mm", "blur_px", "level", "area_mm2", "total_ms")
MOST_REASONS = 4
_REASONS = {reason.label: reason for reason in Reason}
_CODES = {int(reason) for reason in Reason}


def section(title: str, body: str, kind: str = "") -> str:
    """A titled part of the page."""
    return f'<section class="{kind}"><h2>{html.escape(title)}</h2>{body}</section>'


def table(head: Sequence[str], rows: Sequence[Sequence[object]], numbers: Sequence[int] = ()) -> str:
    """A table. numbers: columns that stand to the right."""

    def cells(name: str, row: Sequence[object]) -> str:
        kinds = [' class="number"' if column in numbers else "" for column in range(len(row))]
        told = (f"<{name}{kind}>{html.escape(str(cell))}</{name}>" for cell, kind in zip(row, kinds, strict=True))
        return f"<tr>{''.join(told)}</tr>"

    body = "".join(cells("td", row) for row in rows)
    return f"<table><thead>{cells('th', head)}</thead><tbody>{body}</tbody></table>"


def counts(language: Language, history: History) -> str:
    """How jobs ended, and how many triggers came to none."""
    outcomes, jobs = history.whole.outcomes, sum(history.whole.outcomes.values())
    share = 100 * history.accepted / jobs if jobs else nan
    told = [
        ("good", number(language, history.accepted, 0), "accepted"),
        ("bad", number(language, outcomes["refused"], 0), "refused"),
        ("hold", number(language, outcomes["failed"], 0), "failed"),
        ("", number(language, sum(history.missed.values()), 0), "missed"),
        ("", f"{number(language, share, 1)} %", "share"),
    ]
    parts = (f"<p><b class='{kind}'>{value}</b>{words(language, key)}</p>" for kind, value, key in told)
    return section(words(language, "jobs"), f'<div class="counts">{"".join(parts)}</div>', "wide")


def jobs_chart(language: Language, history: History) -> str:
    """How jobs ended, over the span."""
    bars = []
    for bucket in history.buckets:
        outcomes = bucket.outcomes
        ends = {"accepted": outcomes["accepted"] + outcomes["written"]}
        bars.append(Bar(bucket.begin, {**ends, "refused": outcomes["refused"], "failed": outcomes["failed"]}))
    name = words(language, "jobs")
    return section(name, bar_chart(language, name, history.span, bars))


def reason_charts(language: Language, history: History) -> str:
    """How often jobs ended for the most frequent reasons, over the span, a chart each."""
    charts = []
    for code, _count in history.whole.reasons.most_common(MOST_REASONS):
        name, _next = _told(language, code)
        failed = code in _CODES and Reason(code).outcome is Outcome.FAILED
        bars = [Bar(one.begin, {"failed" if failed else "refused": one.reasons[code]}) for one in history.buckets]
        charts.append(section(name, bar_chart(language, name, history.span, bars)))
    return "".join(charts)


def _told(language: Language, code: int) -> tuple[str, str]:
    """A reason's code and sentence, and what to do; the code alone where another version knew it."""
    if code not in _CODES:
        return str(code), ""
    told = Reason(code).explained(language)
    return f"{code} {told.sentence}", told.next_action


def quantity_chart(language: Language, history: History, quantity: str) -> str:
    """One quantity over the span, with its bounds."""
    marks = [_mark(bucket, bucket.figures[quantity]) for bucket in history.buckets if bucket.figures[quantity].known]
    bounds = limits_of(history).get(quantity, (None, None))
    name = words(language, quantity)
    return section(name, line_chart(language, name, history.span, marks, bounds))


def _mark(bucket: Bucket, figure: Figure) -> Mark:
    return Mark(bucket.begin, figure.least, figure.mean, figure.most)


def check_charts(language: Language, history: History) -> str:
    """The worst deviation of each check over the span, one chart a kind of check that was made."""
    parts = []
    for kind in CHECKS:
        lines = [line for line in history.checks if line.check == kind]
        if lines:
            marks = [Mark(line.time, line.mean_mm, line.worst_mm, line.worst_mm) for line in lines]
            name = words(language, kind)
            parts.append(section(name, line_chart(language, name, history.span, marks, (None, lines[-1].limit_mm))))
    return "".join(parts)


def reasons(language: Language, history: History) -> str:
    """Why jobs were not accepted, how often, and what to do."""
    rows = []
    for code, count in history.whole.reasons.most_common():
        told, next_action = _told(language, code)
        rows.append([told, count, next_action])
    if not rows:
        return section(words(language, "reasons"), f"<p>{words(language, 'none')}</p>", "wide")
    head = [words(language, key) for key in ("reason", "count", "next")]
    return section(words(language, "reasons"), table(head, rows, (1,)), "wide")


def missed(language: Language, history: History) -> str:
    """Triggers that came to no job, by source and reason."""
    rows = []
    for (kind, label), count in history.missed.items():
        reason = _REASONS.get(label)
        rows.append([kind, reason.explained(language).sentence if reason else label, count])
    if not rows:
        return section(words(language, "by_missed"), f"<p>{words(language, 'none')}</p>")
    head = [words(language, key) for key in ("source", "reason", "count")]
    return section(words(language, "by_missed"), table(head, rows, (2,)))


def figures(language: Language, history: History) -> str:
    """Each quantity over the whole span, with its bounds."""
    bounds, rows = limits_of(history), []
    for name in SHOWN:
        figure = history.whole.figures[name]
        least, most = (figure.least, figure.most) if figure.known else (nan, nan)
        told = [number(language, value) for value in (least, figure.mean, most)]
        rows.append([words(language, name), *told, _bounds(language, bounds.get(name, (None, None)))])
    head = [words(language, key) for key in ("figure", "least", "mean", "most", "limit")]
    return section(words(language, "figures"), table(head, rows, (1, 2, 3)), "wide")


def _bounds(language: Language, bounds: Bounds) -> str:
    told = [
        words(language, key, limit=number(language, bound)).partition(": ")[2]
        for bound, key in zip(bounds, ("limit_least", "limit_most"), strict=True)
        if bound is not None
    ]
    return ", ".join(told) or "–"


def used(language: Language, history: History) -> str:
    """With which recipes and calibrations jobs were carried out: a second line of one recipe is a change of it."""
    recipe, calibration = words(language, "recipe"), words(language, "calibration")
    told = [(f"{recipe} {one.number} {one.name}", one.use) for one in history.recipes]
    told += [(f"{calibration} {one.digest.removeprefix('sha256:')[:12]}", one.use) for one in history.calibrations]
    rows = [[what, _time(use.first), _time(use.last), use.jobs] for what, use in told]
    head = [words(language, key) for key in ("what", "first", "last", "jobs")]
    return section(words(language, "changed"), table(head, rows, (3,)), "wide")


def _time(text: str) -> str:
    return moment(datetime.fromisoformat(text))


def checks(language: Language, history: History) -> str:
    """Each check that was made."""
    if not history.checks:
        return section(words(language, "checks"), f"<p>{words(language, 'none')}</p>")
    rows = [
        [moment(line.time), line.check, words(language, line.verdict), number(language, line.worst_mm)]
        for line in history.checks[-20:]
    ]
    head = [words(language, key) for key in ("time", "what", "verdict", "worst")]
    return section(words(language, "checks"), table(head, rows, (3,)), "wide")
