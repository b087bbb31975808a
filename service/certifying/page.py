"""A certificate as one HTML page that is complete in itself, to print and to sign."""

from __future__ import annotations

import html

from contour.length_test.verdict import Decision
from service.certifying import beside, sections
from service.certifying.certificate import Certificate
from service.certifying.earlier import Comparison
from service.certifying.plots import legend, over_direction, over_length, over_places
from service.certifying.words import detail, millimetres, static, words
from service.reasons import Language


def certificate_page(language: Language, certificate: Certificate, comparison: Comparison | None = None) -> str:
    """The page, with a comparison where an earlier certificate is given."""
    title = words(language, "title")
    body = "".join(
        [
            _head(language, certificate),
            _section(language, "results", sections.results(language, certificate)),
            _section(language, "plots", _plots(language, certificate)),
            _section(language, "tested", sections.tested(language, certificate)),
            _section(language, "gauge", sections.gauge(language, certificate)),
            _section(language, "budget", sections.budget(language, certificate)),
            "" if comparison is None else beside.against(language, certificate, comparison),
            _section(language, "study", beside.study(language, certificate)),
            _section(language, "all_lengths", sections.lengths(language, certificate)),
            _section(language, "pictures", sections.pictures(language, certificate)),
            _section(language, "repeat", sections.repeat(language, certificate)),
            _section(language, "not", f"<p>{html.escape(words(language, 'not_text'))}</p>"),
            _signatures(language),
        ]
    )
    return (
        f'<!doctype html><html lang="{language}"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title} {certificate.number}'
        f"</title><style>{static('style.css')}</style></head><body>{body}</body></html>\n"
    )


def _head(language: Language, certificate: Certificate) -> str:
    told, worst, decision = certificate.told, certificate.worst, certificate.decision
    who = told.operator or words(language, "nobody")
    made = words(language, "made", time=f"{told.made:%Y-%m-%d %H:%M %z}", who=who)
    summary = words(
        language,
        "summary",
        error=millimetres(language, worst.error_mm, signed=True),
        name=worst.seen.name,
        picture=worst.picture,
        limit=millimetres(language, worst.limit_mm),
        unsure=millimetres(language, worst.budget.expanded_mm),
    )
    said = [error.decision for error in certificate.lengths]
    counts = {one.value: said.count(one) for one in Decision}
    counted = words(language, "counted", lengths=len(said), places=len(certificate.kept), **counts)
    besides = [words(language, "finding", text=detail(language, text)) for _, text in certificate.findings]
    lines = "".join(f"<small>{html.escape(line)}</small>" for line in (summary, counted, *besides))
    number = words(language, "number", number=certificate.number)
    return (
        f'<h1>{words(language, "title")}</h1><p class="dim">{html.escape(f"{number}, {made}")}</p>'
        f'<div class="verdict {decision}">{html.escape(words(language, decision.value))}{lines}</div>'
    )


def _plots(language: Language, certificate: Certificate) -> str:
    errors, height_mm = certificate.lengths, certificate.gauge.file.height_mm
    drawn = (
        over_length(errors, words(language, "over_length")),
        over_direction(errors, words(language, "over_direction")),
        over_places(errors, certificate.record.calibration, height_mm, words(language, "over_places")),
    )
    colours = legend({one: words(language, f"dot_{one}") for one in Decision})
    return f'<div class="plots">{"".join(drawn)}<div>{colours}</div></div>'


def _section(language: Language, key: str, body: str) -> str:
    return f"<section><h2>{html.escape(words(language, key))}</h2>{body}</section>"


def _signatures(language: Language) -> str:
    return f'<div class="sign"><p>{words(language, "sign_operator")}</p><p>{words(language, "sign_quality")}</p></div>'
