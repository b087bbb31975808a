"""A page of trends, and a shift's report: whole HTML documents in the reader's language."""

from __future__ import annotations

import html
import importlib.metadata
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime

from service.reasons import Language
from service.records.journal_reader import Note
from service.trends import parts
from service.trends.history import History
from service.trends.words import lasting, moment, static, words

STYLE = static("style.css")


def trends_page(language: Language, theme: str, history: History, links: str) -> str:
    """The page of trends; `links` lead to other spans and recipes."""
    charts = [parts.jobs_chart(language, history)]
    charts += [parts.quantity_chart(language, history, name) for name in parts.SHOWN]
    step = words(language, "step", step=lasting(language, history.span.step_s))
    one = "" if len({used.number for used in history.recipes}) <= 1 else f" {words(language, 'one_recipe')}"
    body = (
        f'<h1>{words(language, "trends")}</h1>{links}<p class="dim">{_span(language, history)}; {step}.{one}</p>'
        f"<main>{''.join(charts)}{parts.check_charts(language, history)}{parts.reason_charts(language, history)}"
        f"{parts.reasons(language, history)}{parts.missed(language, history)}</main>"
    )
    style = (
        '<link rel="icon" href="/static/icon.svg" type="image/svg+xml"><link rel="stylesheet" href="/trends/style.css">'
    )
    return _document(language, theme, words(language, "trends"), style, body)


def shift_report(language: Language, history: History, orders: Sequence[Note] | None = None) -> str:
    """The report of a span, complete in itself, for one or two sheets of A4. orders: None = not told here."""
    title = words(language, "report")
    version = importlib.metadata.version("combtrace")
    made = words(language, "made", time=moment(datetime.now(UTC)), version=version)
    told = [
        parts.counts(language, history),
        parts.reasons(language, history),
        parts.figures(language, history),
        parts.used(language, history),
        parts.checks(language, history),
        parts.missed(language, history),
        _orders(language, orders),
        parts.jobs_chart(language, history),
        parts.quantity_chart(language, history, "uncertainty_mm"),
        parts.quantity_chart(language, history, "total_ms"),
    ]
    body = f'<h1>{title}</h1><p class="dim">{_span(language, history)}; {made}.</p><main>{"".join(told)}</main>'
    return _document(language, "light", f"{title} {moment(history.span.begin)}", f"<style>{STYLE}</style>", body)


def _span(language: Language, history: History) -> str:
    return words(language, "from_to", begin=moment(history.span.begin), end=moment(history.span.end))


def _orders(language: Language, orders: Sequence[Note] | None) -> str:
    title = words(language, "people")
    if orders is None:
        return parts.section(title, f"<p>{words(language, 'no_people')}</p>")
    if not orders:
        return parts.section(title, f"<p>{words(language, 'none')}</p>")
    given = Counter((note.who or words(language, "nobody"), note.action) for note in orders)
    rows = [[who, action, number] for (who, action), number in given.most_common()]
    head = [words(language, key) for key in ("who", "order", "count")]
    return parts.section(title, parts.table(head, rows, (2,)))


def _document(language: Language, theme: str, title: str, style: str, body: str) -> str:
    return (
        f'<!doctype html><html lang="{language}" data-theme="{theme}"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{html.escape(title)}</title>'
        f"{style}</head><body>{body}</body></html>\n"
    )
