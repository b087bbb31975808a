"""Moments at which all parts that look now and then do so together: waking the process costs more than looking."""

from __future__ import annotations

GOLDEN_SECTION = 0.618033988749895


def until_beat(now_s: float, period_s: float) -> float:
    """Seconds from `now_s` to a multiple of `period_s`: the first that is at least half a period away."""
    pause_s = period_s - now_s % period_s
    return pause_s if 2 * pause_s >= period_s else pause_s + period_s


def off_beat(turn: int) -> float:
    """Share of a period, 0.1 to 1, by which the look number `turn` comes after the one before.

    What goes to and fro in step with looks at equal distances seems to stand still; at these it cannot: they are cut by
    the golden section, which keeps out of step with every period.
    """
    return 0.1 + 0.9 * (turn * GOLDEN_SECTION % 1.0)
