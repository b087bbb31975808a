"""When parts look now and then: together, and out of step with what they look at where that seems to stand still."""

from __future__ import annotations

from itertools import accumulate

import pytest

from service.poll_timing import off_beat, until_beat


@pytest.mark.parametrize(("now_s", "pause_s"), [(0.0, 0.05), (0.02, 0.03), (0.03, 0.07), (12.25, 0.05)])
def test_the_next_look_is_at_a_multiple_of_the_period_at_least_half_a_period_away(now_s: float, pause_s: float) -> None:
    assert until_beat(now_s, 0.05) == pytest.approx(pause_s)


@pytest.mark.parametrize("changes", [0.5, 1, 2, 3, 4, 5, 10, 20, 50])
def test_what_goes_to_and_fro_is_seen_to_move_however_often_it_does_in_a_period(changes: float) -> None:
    looks = accumulate(off_beat(turn) for turn in range(1000))
    seen = [int(changes * at) % 2 for at in looks]
    still = max(len(run) for run in "".join(map(str, seen)).replace("01", "0 1").replace("10", "1 0").split())
    assert still <= 12, "looks in a row that show no change"
