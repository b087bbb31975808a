"""A certificate's plots as SVG: errors over length and direction against the limit, and where on the table they lay."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration
from contour.geometry.arrays import Float64s
from contour.geometry.rings import densified
from contour.length_test.coverage import field_px
from contour.length_test.verdict import Decision, LengthError

WIDTH, HEIGHT = 620, 250
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 14, 14, 38
_HEADROOM = 1.15
_MAP_MARGIN = 0.04
_EDGE_STEPS = 20


@dataclass(frozen=True)
class _Scale:
    """Values to places: x from `low` to `high`, y from -top to top."""

    low: float
    high: float
    top: float

    def x(self, value: float) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * (value - self.low) / (self.high - self.low)

    def y(self, value: float) -> float:
        return _TOP + (HEIGHT - _TOP - _BOTTOM) * (1 - value / self.top) / 2


def over_length(errors: Sequence[LengthError], title: str) -> str:
    """Each error at its length, with the test's uncertainty, and the limit on both sides."""
    longest = max(error.true_mm for error in errors)
    return _errors(errors, [error.true_mm for error in errors], (0.0, 1.05 * longest), title, 50.0)


def over_direction(errors: Sequence[LengthError], title: str) -> str:
    """Each error at the direction it was measured in."""
    return _errors(errors, [error.seen.direction_deg for error in errors], (0.0, 180.0), title, 45.0)


def _errors(
    errors: Sequence[LengthError], places: Sequence[float], span: tuple[float, float], title: str, step: float
) -> str:
    reach = max(max(abs(one.error_mm) + one.budget.expanded_mm, one.limit_mm) for one in errors)
    scale = _Scale(*span, _HEADROOM * reach)
    parts = [_axes(scale, step)]
    ordered = sorted(zip(places, errors, strict=True), key=lambda pair: pair[0])
    for sign in (1.0, -1.0):
        line = [(span[0], ordered[0][1].limit_mm), *((x, one.limit_mm) for x, one in ordered)]
        line.append((span[1], ordered[-1][1].limit_mm))
        drawn = "L".join(f"{scale.x(x):.1f} {scale.y(sign * limit):.1f}" for x, limit in line)
        parts.append(f'<path class="limit" d="M{drawn}"/>')
    for x, one in ordered:
        at, unsure = scale.x(x), one.budget.expanded_mm
        low, high = scale.y(one.error_mm - unsure), scale.y(one.error_mm + unsure)
        parts.append(
            f'<path class="bar" d="M{at:.1f} {low:.1f}V{high:.1f}"/>'
            f'<circle class="{one.decision}" cx="{at:.1f}" cy="{scale.y(one.error_mm):.1f}" r="3">'
            f"<title>{html.escape(_told(one))}</title></circle>"
        )
    return _figure(HEIGHT, "".join(parts), title)


def over_places(errors: Sequence[LengthError], calibration: Calibration, height_mm: float, title: str) -> str:
    """The lengths where they lay, seen from above, red where too long, blue where too short, strong at the limit."""
    low_px, high_px = field_px(calibration)
    box = np.array([low_px, [high_px[0], low_px[1]], high_px, [low_px[0], high_px[1]]])
    edge_px = densified(box, float((high_px - low_px).max()) / _EDGE_STEPS)
    edge = calibration.to_machine(calibration.to_work(edge_px, height_mm))
    low, high = edge.min(axis=0), edge.max(axis=0)
    room = _MAP_MARGIN * float((high - low).max())
    k = WIDTH / float(high[0] - low[0] + 2 * room)
    tall = k * float(high[1] - low[1] + 2 * room)

    def drawn(points: Float64s) -> str:
        return "L".join(f"{x:.1f} {y:.1f}" for x, y in ((points - low + room) * k * [1, -1] + [0, tall]).tolist())

    parts = [f'<path class="field" d="M{drawn(edge)}Z"/>']
    for one in errors:
        share = min(abs(one.error_mm) / one.limit_mm, 1.0)
        colour = "178,24,43" if one.error_mm > 0 else "33,102,172"
        parts.append(
            f'<path class="place" stroke="rgba({colour},{0.2 + 0.8 * share:.2f})" d="M{drawn(one.seen.ends_mm)}">'
            f"<title>{html.escape(_told(one))}</title></path>"
        )
        parts += [
            f'<circle class="end" cx="{place.split()[0]}" cy="{place.split()[1]}" r="2"/>'
            for place in drawn(one.seen.ends_mm).split("L")
        ]
    corners = f"x {low[0]:.0f} … {high[0]:.0f} mm, y {low[1]:.0f} … {high[1]:.0f} mm"
    return _figure(tall, "".join(parts), f"{title} ({corners})")


def _axes(scale: _Scale, step: float) -> str:
    parts = [f'<path class="axis" d="M{_LEFT} {_TOP}V{HEIGHT - _BOTTOM}H{WIDTH - _RIGHT}"/>']
    for value in _ticks(scale.top):
        y = scale.y(value)
        parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{WIDTH - _RIGHT}"/>')
        parts.append(f'<text class="down" x="{_LEFT - 6}" y="{y + 4:.1f}">{value:+.2f}</text>')
    x = scale.low
    while x <= scale.high + 1e-9:
        parts.append(f'<text class="middle" x="{scale.x(x):.1f}" y="{HEIGHT - _BOTTOM + 16}">{x:g}</text>')
        x += step
    return "".join(parts)


def _ticks(top: float) -> list[float]:
    """Values at even steps, three or so on either side of nothing."""
    rough = top / 3
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(next(power * k for k in (1, 2, 5, 10) if power * k >= rough))
    count = int(top / step)
    return [step * number for number in range(-count, count + 1)]


def _told(one: LengthError) -> str:
    return f"{one.picture}, {one.seen.name}: {one.error_mm:+.3f} mm ± {one.budget.expanded_mm:.3f}"


def _figure(height: float, body: str, title: str) -> str:
    told = html.escape(title)
    return (
        f'<figure><svg viewBox="0 0 {WIDTH} {height:.0f}" role="img" aria-label="{told}">{body}</svg>'
        f"<figcaption>{told}</figcaption></figure>"
    )


def legend(words: dict[Decision, str]) -> str:
    """What the points' colours say."""
    items = (f'<span><i class="{key}"></i>{html.escape(text)}</span>' for key, text in words.items())
    return f'<p class="legend">{"".join(items)}</p>'
