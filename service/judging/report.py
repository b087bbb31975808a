"""The judging report: one HTML file with a table and each picture under its two outlines; no script is needed."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour
from service.judging.judgement import Judgement
from service.judging.table import COLUMNS, cells, sentence
from service.judging.truth_file import Truth
from service.measuring.report_pictures import embedded

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1360px; margin: 24px auto; padding: 0 16px; }
h1 { font-size: 24px; } figure { margin: 32px 0; } figcaption { margin-bottom: 6px; }
table { border-collapse: collapse; }
td, th { text-align: left; padding: 3px 14px 3px 0; border-bottom: 1px solid #ddd; }
svg { width: 100%; max-height: 90vh; display: block; } svg.sample { display: inline; width: 48px; height: 12px; }
path { fill: none; vector-effect: non-scaling-stroke; stroke-linejoin: round; }
.under { stroke: #fff; stroke-width: 5; } .truth { stroke: #0050a0; stroke-width: 2.5; stroke-dasharray: 9 6; }
.ours { stroke: #d55e00; stroke-width: 2; } .ok { color: #1a6b30; } .refused, .error { color: #9c3d00; }
.outside { color: #b00000; font-weight: bold; }
"""
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def report(judgements: Sequence[Judgement], figures: Iterable[str]) -> str:
    """The page of all judgements; figures: of `figure`, in their order."""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in COLUMNS)
    rows = "".join(_row(one) for one in judgements)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Judged outlines</title>'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><style>{STYLE}</style></head><body>'
        f"<h1>Judged outlines</h1><p>{html.escape(sentence(judgements))}.</p>"
        f"<p>Distances in pixels, of the true outline from ours and back, the worse way. {_sample('truth')} the true "
        f"outline, {_sample('ours')} ours.</p><table><tr>{head}</tr>{rows}</table>{''.join(figures)}</body></html>\n"
    )


def figure(judgement: Judgement, picture: Bytes, ours: Contour | None, truth: Truth) -> str:
    """The picture under both outlines."""
    height, width = picture.shape[:2]
    outlines = [("truth", _path(truth.outline)), *([] if ours is None else [("ours", _path(ours))])]
    drawn = "".join(f'<path class="under" d="{path}"/>' for _, path in outlines)
    drawn += "".join(f'<path class="{kind}" d="{path}"/>' for kind, path in reversed(outlines))  # dashes go on top
    name = html.escape(cells(judgement)[0])
    edge = "" if truth.edge is None else f", true edge: {truth.edge}"
    details = html.escape("; ".join(judgement.details))
    return (
        f'<figure id="{name}"><figcaption><strong>{name}</strong>{edge}. {details}</figcaption>'
        f'<svg viewBox="-0.5 -0.5 {width} {height}" role="img" aria-label="{name}">'
        f'<image href="{embedded(picture)}" x="-0.5" y="-0.5" width="{width}" height="{height}"/>{drawn}</svg></figure>'
    )


def _row(judgement: Judgement) -> str:
    name, verdict, *rest = (html.escape(cell) for cell in cells(judgement))
    kind = "outside" if judgement.bound_held is False and judgement.status == "ok" else judgement.status
    linked = name if judgement.status == "error" else f'<a href="#{name}">{name}</a>'
    return f'<tr><td>{linked}</td><td class="{kind}">{verdict}</td>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'


def _path(contour: Contour) -> str:
    rings = ("L".join(f"{x:.2f} {y:.2f}" for x, y in ring.tolist()) for ring in contour.rings)
    return "".join(f"M{ring}Z" for ring in rings)


def _sample(kind: str) -> str:
    return f'<svg class="sample" viewBox="0 0 48 12"><path class="{kind}" d="M0 6H48"/></svg>'
