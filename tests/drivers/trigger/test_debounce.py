"""What counts as one trigger, whatever contact, scanner or interference does."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from drivers.trigger.debounce import Burst, SteadyEdge

GAPS = st.lists(st.floats(0.0, 1.0), max_size=60)


def moments(gaps):
    at_s, all_of_them = 0.0, []
    for gap in gaps:
        at_s += gap
        all_of_them.append(at_s)
    return all_of_them


@given(GAPS, st.floats(0.01, 0.5))
def test_a_burst_begins_at_the_first_byte_and_after_each_long_silence_only(gaps, silence_s):
    burst, times = Burst(silence_s), moments(gaps)
    begun = [burst.heard(at_s) for at_s in times]
    expected = [number == 0 or times[number] - times[number - 1] >= silence_s for number in range(len(times))]
    assert begun == expected


def test_a_device_that_babbles_for_an_hour_triggers_once():
    burst = Burst(0.2)
    assert sum(burst.heard(0.1 * number) for number in range(36_000)) == 1


@given(st.lists(st.tuples(st.booleans(), st.floats(0.001, 0.2)), max_size=80), st.sampled_from(["rising", "falling"]))
def test_edges_are_those_of_the_levels_that_held(held, edge):
    """Looked at densely; held: levels one after the other and how long each stays."""
    hold_s, step_s = 0.05, 0.004
    watcher, at_s, edges = SteadyEdge(edge, hold_s), 0.0, 0
    merged: list[list[float]] = []
    for level, duration_s in held:
        steps = max(1, round(duration_s / step_s))
        for _ in range(steps):
            edges += watcher.level(level, at_s)
            at_s += step_s
        if merged and merged[-1][0] == level:
            merged[-1][1] += steps
        else:
            merged.append([level, steps])
    # A level seen n times in a row was seen for (n - 1) steps.
    steady = [level for level, steps in merged if (steps - 1) * step_s >= hold_s - 1e-9]
    changes = [after for before, after in pairwise(steady) if before != after]
    assert edges == changes.count(edge == "rising")


def test_a_contact_that_is_closed_from_the_beginning_is_no_edge():
    watcher = SteadyEdge("rising", 0.05)
    assert not any(watcher.level(True, 0.01 * number) for number in range(100))
    assert not any(watcher.level(False, 1 + 0.01 * number) for number in range(10))
    assert sum(watcher.level(True, 2 + 0.01 * number) for number in range(10)) == 1
