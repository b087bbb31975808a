"""A quantity over time as SVG, without any style of its own: `static/style.css` says how it looks."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from math import isfinite

from service.reasons import Language
from service.trends.history import Span
from service.trends.limits import Bounds
from service.trends.words import moment, number, words

WIDTH, HEIGHT = 620, 210
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 12, 20, 26
_WORTH_SHOWING = 3.0
"""A limit is drawn where the picture need not become more than so many times as high for it; else it is told."""


@dataclass(frozen=True)
class Mark:
    """What was seen at a time or from then on: least, mean and most of it."""

    time: datetime
    least: float
    mean: float
    most: float


@dataclass(frozen=True)
class Bar:
    """What was counted from a time on, by kind."""

    time: datetime
    counts: dict[str, int]


def line_chart(language: Language, name: str, span: Span, marks: Sequence[Mark], bounds: Bounds = (None, None)) -> str:
    """Means as a line over the band from least to most, and the bounds; one gap longer than a step breaks the line."""
    values = [value for mark in marks for value in (mark.least, mark.most) if isfinite(value)]
    if not values:
        return _empty(language)
    scale = _Scale.of(span, values, bounds)
    parts = [_axes(language, span, scale)]
    for run in _runs(marks, span.step_s * 1.5):
        upper = [f"{scale.x(mark.time):.1f} {scale.y(mark.most):.1f}" for mark in run]
        lower = [f"{scale.x(mark.time):.1f} {scale.y(mark.least):.1f}" for mark in reversed(run)]
        parts.append(f'<path class="band" d="M{"L".join(upper + lower)}Z"/>')
        parts.append(
            f'<path class="mean" d="M{"L".join(f"{scale.x(m.time):.1f} {scale.y(m.mean):.1f}" for m in run)}"/>'
        )
    for mark in marks:
        told = f"{moment(mark.time)}: {number(language, mark.mean)} ({_range(language, mark)})"
        place = f'cx="{scale.x(mark.time):.1f}" cy="{scale.y(mark.mean):.1f}"'
        parts.append(f'<circle class="dot" {place} r="2.5"><title>{html.escape(told)}</title></circle>')
    parts += _limits(language, scale, bounds)
    return _svg(name, parts)


def bar_chart(language: Language, name: str, span: Span, bars: Sequence[Bar]) -> str:
    """How many of each kind, one bar a step, the kinds one on the other."""
    highest = max((sum(bar.counts.values()) for bar in bars), default=0)
    if not highest:
        return _empty(language)
    scale = _Scale(span, 0.0, float(highest))
    width = max((WIDTH - _LEFT - _RIGHT) / len(bars) - 0.5, 0.5)
    parts = [_axes(language, span, scale)]
    for bar in bars:
        told = ", ".join(f"{words(language, kind)} {count}" for kind, count in bar.counts.items())
        below = 0
        for kind, count in bar.counts.items():
            if count:
                y, top = scale.y(below), scale.y(below + count)
                parts.append(
                    f'<rect class="{kind}" x="{scale.x(bar.time):.1f}" y="{top:.1f}" width="{width:.1f}" '
                    f'height="{y - top:.1f}"><title>{moment(bar.time)}: {told}</title></rect>'
                )
            below += count
    return _svg(name, parts)


@dataclass(frozen=True)
class _Scale:
    span: Span
    low: float
    high: float

    @classmethod
    def of(cls, span: Span, values: Sequence[float], bounds: Bounds) -> _Scale:
        low, high = min(values), max(values)
        room = (high - low) or abs(high) or 1.0
        for bound in bounds:
            if bound is not None and max(high, bound) - min(low, bound) <= _WORTH_SHOWING * room:
                low, high = min(low, bound), max(high, bound)
        room = 0.08 * ((high - low) or abs(high) or 1.0)
        return cls(span, max(low - room, 0.0) if low >= 0 else low - room, high + room)

    def x(self, time: datetime) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * ((time - self.span.begin) / (self.span.end - self.span.begin))

    def y(self, value: float) -> float:
        return HEIGHT - _BOTTOM - (HEIGHT - _TOP - _BOTTOM) * (value - self.low) / (self.high - self.low)

    def shows(self, value: float) -> bool:
        return self.low <= value <= self.high


def _axes(language: Language, span: Span, scale: _Scale) -> str:
    parts = [f'<path class="axis" d="M{_LEFT} {_TOP}V{HEIGHT - _BOTTOM}H{WIDTH - _RIGHT}"/>']
    for share in (0.0, 0.5, 1.0):
        value = scale.low + share * (scale.high - scale.low)
        y = scale.y(value)
        parts.append(f'<path class="axis" d="M{_LEFT - 4} {y:.1f}H{_LEFT}"/>')
        parts.append(f'<text class="end" x="{_LEFT - 8}" y="{y + 4:.1f}">{number(language, value)}</text>')
    parts.append(f'<text x="{_LEFT}" y="{HEIGHT - 8}">{moment(span.begin)}</text>')
    parts.append(f'<text class="end" x="{WIDTH - _RIGHT}" y="{HEIGHT - 8}">{moment(span.end)}</text>')
    return "".join(parts)


def _limits(language: Language, scale: _Scale, bounds: Bounds) -> list[str]:
    parts = []
    for bound, key, y_text in ((bounds[1], "limit_most", _TOP - 6), (bounds[0], "limit_least", HEIGHT - _BOTTOM - 6)):
        if bound is None:
            continue
        text = words(language, key, limit=number(language, bound))
        if scale.shows(bound):
            parts.append(f'<path class="limit" d="M{_LEFT} {scale.y(bound):.1f}H{WIDTH - _RIGHT}"/>')
        else:
            text = words(language, "beyond", limit=text)
        parts.append(f'<text class="limit-text end" x="{WIDTH - _RIGHT}" y="{y_text}">{text}</text>')
    return parts


def _runs(marks: Sequence[Mark], longest_gap_s: float) -> list[list[Mark]]:
    runs: list[list[Mark]] = []
    for mark in marks:
        if runs and (mark.time - runs[-1][-1].time).total_seconds() <= longest_gap_s:
            runs[-1].append(mark)
        else:
            runs.append([mark])
    return runs


def _range(language: Language, mark: Mark) -> str:
    return f"{number(language, mark.least)} … {number(language, mark.most)}"


def _empty(language: Language) -> str:
    return f'<p class="dim">{words(language, "no_jobs")}</p>'


def _svg(name: str, parts: Sequence[str]) -> str:
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(name)}">{"".join(parts)}</svg>'
