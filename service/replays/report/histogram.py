"""How many outlines lie how far apart, as SVG without style of its own: bars over a logarithmic scale."""

from __future__ import annotations

import html
import itertools
from collections.abc import Sequence

import numpy as np

from service.reasons import Language
from service.trends.words import number

WIDTH, HEIGHT = 620, 210
EDGES_MM = (*tuple(float(f"{first}e{power}") for power in range(-3, 2) for first in (1, 2, 5)), 100.0)
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 12, 20, 26


def counts_by_shift(shifts_mm: Sequence[float]) -> list[tuple[str, int]]:
    """The bars: what each is of, in mm, and how many; the first are those that are the same."""
    shifts = np.asarray(shifts_mm, dtype=np.float64)
    found = [("0", int(np.count_nonzero(shifts == 0)))]
    moved = shifts[shifts > 0]
    bounds = (0.0, *EDGES_MM, np.inf)
    for low, high in itertools.pairwise(bounds):
        told = f"< {high:g}" if low == 0 else f"≥ {low:g}" if high == np.inf else f"{low:g}–{high:g}"
        found.append((told, int(np.count_nonzero((moved >= low) & (moved < high)))))
    return found


def histogram(language: Language, name: str, shifts_mm: Sequence[float]) -> str:
    """The bars with how many each is of; heights by the square root, so that one of a million is seen."""
    bars = counts_by_shift(shifts_mm)
    highest = max(count for _, count in bars) or 1
    step = (WIDTH - _LEFT - _RIGHT) / len(bars)
    parts = [f'<path class="axis" d="M{_LEFT} {_TOP}V{HEIGHT - _BOTTOM}H{WIDTH - _RIGHT}"/>']
    for place, (told, count) in enumerate(bars):
        x, height = _LEFT + place * step, (HEIGHT - _TOP - _BOTTOM) * (count / highest) ** 0.5
        if count:
            parts.append(
                f'<rect class="bar" x="{x + 1:.1f}" y="{HEIGHT - _BOTTOM - height:.1f}" width="{step - 2:.1f}" '
                f'height="{height:.1f}"><title>{html.escape(told)} mm: {count}</title></rect>'
                f'<text class="middle" x="{x + step / 2:.1f}" y="{HEIGHT - _BOTTOM - height - 4:.1f}">'
                f"{number(language, count, 0)}</text>"
            )
        if place % 3 == 0:
            parts.append(f'<text class="middle" x="{x + step / 2:.1f}" y="{HEIGHT - 8}">{html.escape(told)}</text>')
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{html.escape(name)}">{"".join(parts)}</svg>'
