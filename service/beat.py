"""Moments at which all parts that look now and then do so together: waking the process costs more than looking."""

from __future__ import annotations


def until_beat(now_s: float, period_s: float) -> float:
    """Seconds from `now_s` to a multiple of `period_s`: the first that is at least half a period away."""
    pause_s = period_s - now_s % period_s
    return pause_s if 2 * pause_s >= period_s else pause_s + period_s
