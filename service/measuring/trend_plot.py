"""The trend of the weekly check as a picture: worst deviation over time against its limit, one panel a check."""

from __future__ import annotations

import html
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from math import floor, log10

from service.measuring.trend_file import CHECKS, TrendLine

WIDTH, PANEL = 900, 260
"""Units of the picture: its width, and the height of a panel."""

_LEFT, _RIGHT, _TOP, _BOTTOM = 70, 20, 34, 36
_HEADROOM = 1.15
_STYLE = """
svg { font: 13px system-ui, sans-serif; fill: #222; background: #fff; } .title { font-weight: bold; }
path { fill: none; } .axis { stroke: #999; } .grid { stroke: #ddd; } .limit { stroke: #b2182b; stroke-dasharray: 6 4; }
.worst { stroke: #2166ac; stroke-width: 1.5; } .p95 { stroke: #92c5de; stroke-width: 1.5; }
.pass { fill: #2166ac; } .fail { fill: #b2182b; } .new { stroke: #777; stroke-dasharray: 2 3; }
.down { text-anchor: end; } .middle { text-anchor: middle; } .red { fill: #b2182b; }
"""


def trend_svg(lines: Sequence[TrendLine]) -> str:
    """An SVG of all checks: worst and 95 % deviation, the limit, failures in red, a dotted line at a new calibration.

    `verify` and `repeat` have a panel each: a deviation from a master and a scatter are not the same quantity.
    """
    checks = [check for check in CHECKS if any(line.check == check for line in lines)]
    panels = "".join(
        f'<g transform="translate(0 {number * PANEL})">{_panel(check, _of(lines, check))}</g>'
        for number, check in enumerate(checks)
    )
    height = PANEL * max(len(checks), 1)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" '
        f'aria-label="Trend of the weekly check"><style>{_STYLE}</style>'
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>{panels}</svg>\n'
    )


def _of(lines: Sequence[TrendLine], check: str) -> list[TrendLine]:
    return sorted((line for line in lines if line.check == check), key=lambda line: line.time)


def _panel(check: str, lines: Sequence[TrendLine]) -> str:
    begin, end = lines[0].time, lines[-1].time
    if begin == end:
        begin, end = begin - timedelta(days=1), end + timedelta(days=1)
    top = _HEADROOM * max(max(line.worst_mm, line.limit_mm) for line in lines) or 1.0

    def x(line: TrendLine) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * ((line.time - begin) / (end - begin))

    def y(value_mm: float) -> float:
        return PANEL - _BOTTOM - (PANEL - _TOP - _BOTTOM) * value_mm / top

    last = lines[-1]
    parts = [
        f'<text x="{_LEFT}" y="20" class="title">{html.escape(check)}: {len(lines)} checks, the last '
        f"{last.worst_mm:.3f} mm of {last.limit_mm:g} mm</text>",
        f'<text x="{WIDTH - _RIGHT}" y="20" class="down">dark: worst, light: 95 %, mm; red: limit, failed</text>',
    ]
    step = _step(top)
    for value in (number * step for number in range(int(top / step) + 1)):
        parts.append(f'<path class="grid" d="M{_LEFT} {y(value):.1f}H{WIDTH - _RIGHT}"/>')
        parts.append(f'<text x="{_LEFT - 8}" y="{y(value) + 4:.1f}" class="down">{value:.3g}</text>')
    for before, line in pairwise(lines):
        if line.calibration != before.calibration:
            parts.append(f'<path class="new" d="M{x(line):.1f} {_TOP}V{PANEL - _BOTTOM}"/>')
    parts.append(f'<path class="axis" d="M{_LEFT} {_TOP}V{PANEL - _BOTTOM}H{WIDTH - _RIGHT}"/>')
    parts.append(_limits([(x(line), y(line.limit_mm)) for line in lines]))
    parts.append(_path("p95", [(x(line), y(line.p95_mm)) for line in lines]))
    parts.append(_path("worst", [(x(line), y(line.worst_mm)) for line in lines]))
    for line in lines:
        told = f"{_day(line.time)} {line.verdict}: worst {line.worst_mm:.3f}, 95 % {line.p95_mm:.3f} mm"
        kind = "pass" if line.verdict == "pass" else "fail"
        parts.append(
            f'<circle class="{kind}" cx="{x(line):.1f}" cy="{y(line.worst_mm):.1f}" r="4"><title>'
            f"{html.escape(told)}</title></circle>"
        )
    for time, place, kind in ((begin, _LEFT, ""), (end, WIDTH - _RIGHT, "down")):
        parts.append(f'<text x="{place}" y="{PANEL - 12}" class="{kind}">{_day(time)}</text>')
    return "".join(parts)


def _step(top: float) -> float:
    """A step of 1, 2 or 5 that divides the height into two to five."""
    power = 10.0 ** floor(log10(top))
    return next(share * power for share in (0.2, 0.5, 1.0, 2.0) if top / (share * power) <= 5)


def _limits(places: Sequence[tuple[float, float]]) -> str:
    """The limit of each check, held from one to the next, over the panel's whole width."""
    steps = [f"M{_LEFT} {places[0][1]:.1f}", *(f"H{x:.1f}V{y:.1f}" for x, y in places), f"H{WIDTH - _RIGHT}"]
    return f'<path class="limit" d="{"".join(steps)}"/>'


def _path(kind: str, places: Sequence[tuple[float, float]]) -> str:
    return f'<path class="{kind}" d="M{"L".join(f"{x:.1f} {y:.1f}" for x, y in places)}"/>'


def _day(time: datetime) -> str:
    return time.astimezone(UTC).strftime("%Y-%m-%d %H:%M")
