from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from drivers.camera.genicam.clock import CameraClock

delays = st.floats(1e-5, 0.5)


@given(offset_s=st.floats(-1e6, 1e6), steps=st.lists(st.tuples(delays, delays, delays), min_size=1, max_size=20))
def test_the_true_time_of_a_frame_lies_between_the_bounds(offset_s, steps):
    clock, now_s = CameraClock(), 1000.0
    for before_s, travel_s, pause_s in steps:
        exposed_s = now_s + before_s
        assert clock.frame_came(exposed_s - offset_s, now_s, exposed_s + travel_s)
        assert clock.earliest_s(exposed_s - offset_s) <= exposed_s + 1e-6
        assert clock.latest_s(exposed_s - offset_s) >= exposed_s - 1e-6
        now_s = exposed_s + travel_s + pause_s


def test_a_frame_from_before_its_trigger_is_none_of_it():
    clock = CameraClock()
    assert clock.frame_came(5.0, 105.0, 105.01)
    assert not clock.frame_came(6.0, 106.5, 106.6)
    assert clock.frame_came(7.0, 107.0, 107.02)


def test_a_clock_that_was_read_tells_without_a_frame():
    clock = CameraClock()
    assert not clock.known
    clock.latched(50.0, 10.0, 10.001)
    assert clock.known
    assert clock.earliest_s(51.0) == 11.0
    assert not clock.frame_came(50.5, 10.6, 10.7)


def test_clocks_that_drift_stay_within_their_bounds():
    clock, fast = CameraClock(), 1 + 1e-4
    for second in range(0, 5000, 500):
        assert clock.frame_came(second * fast, second - 0.001, second + 0.01)
    assert clock.earliest_s(4500 * fast) <= 4500 <= clock.latest_s(4500 * fast)


def test_a_clock_that_was_set_anew_is_learnt_anew():
    clock = CameraClock()
    assert clock.frame_came(1000.0, 5.0, 5.01)
    assert clock.frame_came(2000.0, 6.0, 6.01)
    assert math.isclose(clock.earliest_s(2000.0), 6.0)
