"""What stands beside a certificate's own figures: an earlier certificate, and the gauge study."""

from __future__ import annotations

import html
from collections.abc import Sequence

from service.certifying.certificate import Certificate
from service.certifying.earlier import Change, Comparison
from service.certifying.tables import HASH_SHOWN, facts, in_mm, table
from service.certifying.words import millimetres, words
from service.reasons import Language


def against(language: Language, certificate: Certificate, comparison: Comparison) -> str:
    """An earlier certificate's figures beside these."""
    earlier = comparison.earlier
    title = words(language, "against", number=earlier.number, made=earlier.made)
    head = ["", words(language, "then"), words(language, "now")]
    now_largest = max((one.error_mm for one in certificate.lengths), key=abs)
    figures = (
        ("largest_error", earlier.largest_error_mm, now_largest),
        ("form_error", earlier.form_error_mm, certificate.worst_form.form_mm),
        ("unsure", earlier.uncertainty_mm, certificate.uncertainty_mm),
        ("limit_mm", earlier.limit_mm, certificate.told.limit.constant_mm),
    )
    rows = [[words(language, key), *(millimetres(language, one) for one in pair)] for key, *pair in figures]
    rows.append(
        [
            words(language, "verdict"),
            *(words(language, "yes" if one else "no") for one in (earlier.passes, certificate.passes)),
        ]
    )
    told, hashes = certificate.told, (earlier.calibration_hash, certificate.record.digest)
    rows += [
        [words(language, "operator"), earlier.operator or "–", told.operator or "–"],
        [words(language, "calibration_hash"), *(one[:HASH_SHOWN] for one in hashes)],
        [words(language, "program"), earlier.version, told.version],
    ]
    body = table(head, rows, (1, 2)) + _changes(language, comparison.changes)
    if not comparison.changes:
        body += f"<p>{html.escape(words(language, 'other_gauge', gauge=earlier.gauge.id))}</p>"
    return f"<section><h2>{html.escape(title)}</h2>{body}</section>"


def _changes(language: Language, changes: Sequence[Change]) -> str:
    if not changes:
        return ""
    mean = words(language, "mean_error")
    head = [
        words(language, "name"),
        *(f"{mean}: {words(language, when)}" for when in ("then", "now")),
        words(language, "change_u"),
        "",
    ]
    rows = [
        [
            one.name,
            millimetres(language, one.then_mm, signed=True),
            millimetres(language, one.now_mm, signed=True),
            millimetres(language, one.uncertainty_mm),
            words(language, "moved" if one.moved else "same"),
        ]
        for one in changes
    ]
    return table(head, rows, (1, 2, 3))


def study(language: Language, certificate: Certificate) -> str:
    """Repeatability and reproducibility, where they were studied."""
    found = certificate.study
    if found is None:
        return f"<p>{html.escape(words(language, 'study_none'))}</p>"
    text = words(language, "study_text", lengths=found.lengths, operators=found.operators, placements=found.placements)
    share = millimetres(language, 100 * found.of_limits, 1)
    rows = [
        (words(language, "repeatability"), in_mm(language, millimetres(language, found.repeatability_mm, 4))),
        (words(language, "reproducibility"), in_mm(language, millimetres(language, found.reproducibility_mm, 4))),
        (words(language, "grr"), in_mm(language, millimetres(language, found.total_mm, 4))),
        (words(language, "of_limits"), words(language, "of_limits_value", share=share)),
    ]
    return f"<p>{html.escape(text)}</p>{facts(rows)}"
