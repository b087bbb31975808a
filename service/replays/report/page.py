"""The report of a run: one HTML file with its pictures in it, in the reader's language."""

from __future__ import annotations

import base64
import html
import importlib.metadata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from statistics import median
from typing import TYPE_CHECKING

from service.details import russian
from service.reasons import Language, Reason
from service.replays.report.conditions import Condition
from service.replays.report.histogram import histogram
from service.replays.report.summary import Group, Summary
from service.replays.rows import Row
from service.texts import Texts
from service.trends.documents import STYLE
from service.trends.parts import section, table
from service.trends.words import moment, number

if TYPE_CHECKING:
    from service.replays.run import WorkerFigures
    from service.replays.thumbnails import Thumbnails

OWN_STYLE = """
svg .bar { fill: var(--strong); } svg .middle { text-anchor: middle; font-size: 11px; }
figure { display: inline-block; margin: 4px 8px 8px 0; vertical-align: top; width: 590px; max-width: 100%; }
figure img { display: inline-block; width: 190px; max-width: 100%; margin-right: 4px; vertical-align: top; }
figcaption { font-size: 14px; }
td:first-child { white-space: nowrap; }
"""
_CODES = {int(reason) for reason in Reason}
words = Texts("service.replays.report").words

Draw = Callable[[Row], "Thumbnails | None"]


@dataclass(frozen=True)
class RunTold:
    """What the report says of the run beside its rows. workers: of this run, by name; left_out: workers, and why."""

    against: str | None
    settings: Mapping[str, object]
    archives: Mapping[str, str]
    conditions: Sequence[Condition] = ()
    workers: Mapping[str, WorkerFigures] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)


def report(language: Language, summary: Summary, told: RunTold, draw: Draw) -> str:
    """The document. draw: makes the pictures of a row's job, None where they cannot be made."""
    title = words(language, "title")
    made = words(language, "made", time=moment(datetime.now(UTC)), version=importlib.metadata.version("combtrace"))
    body = [
        f'<h1>{title}</h1><p class="dim">{html.escape(_compared(language, told))} {made}</p><main>',
        _counts(language, summary),
        _conditions(language, summary, told.conditions),
        _flips(language, summary, draw),
        _shifts(language, summary),
        _worst(language, summary, draw),
        *(_group(language, name, groups) for name, groups in summary.groups.items()),
        _left_out(language, summary, told.left_out),
        _times(language, summary, told),
    ]
    return (
        f'<!doctype html><html lang="{language}" data-theme="light"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title>'
        f"<style>{STYLE}{OWN_STYLE}</style></head><body>{''.join(body)}</main></body></html>\n"
    )


def _compared(language: Language, told: RunTold) -> str:
    before = told.against or words(language, "as_archived")
    settings = ", ".join(f"{key}={value}" for key, value in told.settings.items()) or words(language, "as_archived")
    cells = ", ".join(f"{cell} ({address})" for cell, address in told.archives.items())
    return words(language, "compared", before=before, settings=settings, cells=cells)


def _counts(language: Language, summary: Summary) -> str:
    whole = summary.whole
    shown = [
        ("", whole.jobs, "jobs"),
        ("", whole.changed, "changed"),
        ("bad" if whole.sent_to_refused else "good", whole.sent_to_refused, "sent_to_refused"),
        ("hold" if whole.refused_to_sent else "good", whole.refused_to_sent, "refused_to_sent"),
        ("bad" if whole.left_out else "good", whole.left_out, "left_out"),
    ]
    parts = [f"<p><b class='{kind}'>{number(language, n, 0)}</b>{words(language, key)}</p>" for kind, n, key in shown]
    parts += [
        f"<p><b>{number(language, whole.shift_mm(percent))}</b>{words(language, key)}</p>"
        for percent, key in ((99, "p99"), (100, "most"))
    ]
    return section(words(language, "whole"), f'<div class="counts">{"".join(parts)}</div>', "wide")


def _conditions(language: Language, summary: Summary, conditions: Sequence[Condition]) -> str:
    if not conditions:
        return ""
    figures = summary.figures()
    rows = [
        [one, number(language, figures[one.name]), words(language, "met" if one.met(figures) else "not_met")]
        for one in conditions
    ]
    return section(
        words(language, "conditions"), table(_head(language, "condition", "is", "verdict"), rows, (1,)), "wide"
    )


def _flips(language: Language, summary: Summary, draw: Draw) -> str:
    parts = []
    for (code, refused), count in summary.flip_counts.most_common():
        told = words(language, "now_refused" if refused else "now_sent", reason=_reason(language, code), n=count)
        shown = "".join(_figure(row, draw(row), _caption(language, row)) for row in summary.flips[code, refused])
        parts.append(f"<h3>{html.escape(told)}</h3>{shown}")
    return section(words(language, "flips"), "".join(parts) or f"<p>{words(language, 'none')}</p>", "wide")


def _shifts(language: Language, summary: Summary) -> str:
    title = words(language, "shifts")
    shifts = summary.whole.shifts_mm
    if not shifts:
        return section(title, f"<p>{words(language, 'no_shifts')}</p>")
    percents = (50, 90, 95, 99, 99.9, 100)
    row = [number(language, summary.whole.shift_mm(percent)) for percent in percents]
    quantiles = table([f"{percent} %" for percent in percents], [row], range(len(row)))
    return section(title, histogram(language, title, shifts) + quantiles)


def _worst(language: Language, summary: Summary, draw: Draw) -> str:
    shown = [_figure(row, draw(row), _caption(language, row)) for row in summary.worst]
    about = f'<p class="dim">{words(language, "worst_about")}</p>'
    return section(words(language, "worst"), about + "".join(shown) if shown else words(language, "none"), "wide")


def _figure(row: Row, drawn: Thumbnails | None, caption: str) -> str:
    pictures = [] if drawn is None else [drawn.before, drawn.after, *([] if drawn.place is None else [drawn.place])]
    shown = "".join(f'<img alt="" src="data:image/jpeg;base64,{base64.b64encode(one).decode()}">' for one in pictures)
    return f"<figure>{shown}<figcaption>{html.escape(caption)}</figcaption></figure>"


def _caption(language: Language, row: Row) -> str:
    told = [words(language, "job", cell=row["cell"], job=row["job_id"])]
    for unit in ("mm", "px"):
        if row[f"distance_{unit}"] is not None:
            told.append(f"{number(language, row[f'distance_{unit}'])} {unit}")
    if row["text_after"]:
        told.append(russian(row["text_after"]) if language is Language.RUSSIAN else row["text_after"])
    return "; ".join(told)


def _group(language: Language, name: str, groups: Mapping[str, Group]) -> str:
    rows = [
        [
            value,
            *(number(language, n, 0) for n in (one.jobs, one.changed, one.sent_to_refused, one.refused_to_sent)),
            *(number(language, one.shift_mm(percent)) for percent in (50, 99, 100)),
            number(language, one.left_out, 0),
        ]
        for value, one in sorted(groups.items())
    ]
    head = _head(
        language, name, "jobs", "changed", "sent_to_refused", "refused_to_sent", "p50", "p99", "most", "left_out"
    )
    return section(words(language, f"by_{name}"), table(head, rows, range(1, len(head))), "wide")


def _left_out(language: Language, summary: Summary, workers: Mapping[str, str]) -> str:
    rows: list[list[object]] = []
    for kind, count in summary.left_out.most_common():
        examples = " ".join(
            f"{row['cell']} {row['job_id']}: {row['left_out_text']}." for row in summary.left_out_rows[kind]
        )
        rows.append([words(language, kind), count, examples])
    rows += [[words(language, "worker_left_out"), 1, f"{worker} {why}"] for worker, why in workers.items()]
    title = words(language, "left_out_title")
    if not rows:
        return section(title, f"<p>{words(language, 'none')}</p>", "wide")
    return section(title, table(_head(language, "kind", "jobs", "examples"), rows, (1,)), "wide")


def _times(language: Language, summary: Summary, told: RunTold) -> str:
    rows: list[list[object]] = [
        [words(language, name), number(language, median(times)), number(language, sum(times) / 3.6e6)]
        for name, times in summary.times_ms.items()
    ]
    parts = table(_head(language, "step", "median_ms", "sum_h"), rows, (1, 2))
    if told.workers:
        each = [
            [name, one.jobs, number(language, one.jobs_a_second), number(language, one.peak_mb, 0)]
            for name, one in sorted(told.workers.items())
        ]
        parts += table(_head(language, "worker", "jobs", "jobs_a_second", "peak_mb"), each, (1, 2, 3))
    versions = [[before, after, count] for (before, after), count in summary.versions.most_common()]
    parts += table(_head(language, "combtrace_before", "combtrace_after", "jobs"), versions, (2,))
    return section(words(language, "times"), parts, "wide")


def _reason(language: Language, code: int) -> str:
    """A reason's code and sentence; the code alone where another version knew it."""
    return f"{code} {Reason(code).explained(language).sentence}" if code in _CODES else str(code)


def _head(language: Language, *keys: str) -> list[str]:
    return [words(language, key) for key in keys]
