"""Which readings of the controller's clock count: those that fit, and what jumps only once it holds."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.mailbox.blocks import LinkBlock
from service.link.controller_clock import MODULUS, ControllerClock, Stamp

SESSION = 9


class Heard:
    """A clock that is told readings; each with the next heartbeat, unless the controller is in the midst of a scan."""

    def __init__(self) -> None:
        self.clock = ControllerClock()
        self._beats = itertools.count()
        self._beat = 0

    def hear(self, clock_ms: int, at_s: float, *, session: int = SESSION, beats: bool = True) -> Stamp | None:
        self._beat = next(self._beats) if beats else self._beat
        self.clock.heard(
            LinkBlock(session=session, clock=clock_ms % MODULUS, controller_heartbeat=self._beat & 0xFFFF), at_s
        )
        return self.clock.stamp(session)

    def run_in(self, from_ms: int = 1000) -> None:
        """Hear a running clock from 0 s to 1 s."""
        for number in range(11):
            self.hear(from_ms + 100 * number, 0.1 * number)
        assert self.clock.stamp(SESSION) == Stamp(SESSION, (from_ms + 1000) % MODULUS)


def test_the_first_readings_count_once_they_have_held_over_two_changes_of_the_heartbeat() -> None:
    heard = Heard()
    assert heard.hear(1000, 0.0) is None
    assert heard.hear(1010, 0.01, beats=False) is None
    assert heard.hear(1020, 0.02, beats=False) is None
    assert heard.hear(1030, 0.03, beats=False) is None
    assert heard.hear(1100, 0.1) is None
    assert "two changes" in (heard.clock.fault(SESSION) or "")
    assert heard.hear(1200, 0.2) == Stamp(SESSION, 1200)
    assert heard.clock.fault(SESSION) is None


def test_a_reading_counts_when_it_fits_the_last_one_that_counted_within_a_second() -> None:
    heard = Heard()
    heard.run_in()
    assert heard.hear(2900, 2.0) == Stamp(SESSION, 2900)
    assert heard.hear(4901, 3.0) is None
    assert heard.hear(4000, 3.1) == Stamp(SESSION, 4000), "what did not count is not what the next must fit"


@pytest.mark.parametrize("half", [0x0001_FFFA, 0x0000_0004])
def test_a_value_that_stands_half_written_for_a_whole_scan_never_counts(half: int) -> None:
    heard = Heard()
    heard.run_in(0xFFFA - 1000)
    for number in range(1, 11):  # the halves of 0x0001_0004 are written one scan apart; no heartbeat meanwhile
        assert heard.hear(half, 1.0 + 0.01 * number, beats=False) is None
        assert heard.clock.fault(SESSION) is None, "that is no fault: it is over with the scan"
    assert heard.hear(0xFFFA + 110, 1.11) == Stamp(SESSION, 0xFFFA + 110)


def test_a_clock_that_was_set_counts_again_once_it_holds() -> None:
    heard = Heard()
    heard.run_in()
    assert heard.hear(900_000, 1.1) is None
    assert heard.hear(900_100, 1.2) is None
    assert heard.hear(900_200, 1.3) == Stamp(SESSION, 900_200)


def test_what_jumps_and_does_not_hold_replaces_nothing() -> None:
    heard = Heard()
    heard.run_in()
    for number in range(50):
        assert heard.hear(900_000 + 5000 * number, 1.1 + 0.1 * number) is None
    assert heard.hear(8000, 7.0) == Stamp(SESSION, 8000)


def test_a_connection_that_was_lost_leaves_what_counted_but_not_what_was_in_doubt() -> None:
    heard = Heard()
    heard.run_in()
    heard.hear(900_000, 1.1)
    heard.hear(900_100, 1.2)
    heard.clock.disconnected()
    assert heard.clock.stamp(SESSION) is None, "nothing was read yet"
    assert heard.hear(900_200, 1.3) is None
    assert heard.hear(2400, 1.4) == Stamp(SESSION, 2400)


def test_a_clock_may_wrap() -> None:
    heard = Heard()
    heard.run_in(MODULUS - 1500)
    assert heard.hear(400, 1.9) == Stamp(SESSION, 400)


def test_a_running_clock_that_wraps_to_0_is_not_taken_for_a_missing_one() -> None:
    heard = Heard()
    heard.run_in(MODULUS - 1001)
    assert heard.hear(0, 1.001) == Stamp(SESSION, MODULUS - 1)


def test_a_controller_without_a_clock_gives_a_stamp_of_0_once_it_had_time_to_run() -> None:
    heard = Heard()
    assert heard.hear(0, 0.0) is None, "without a limit a late contour would be taken"
    assert heard.hear(0, 0.9) is None
    assert heard.clock.fault(SESSION) == "the controller's clock shows 0: whether it runs is not known yet"
    assert heard.hear(0, 1.1) == Stamp(SESSION, 0)
    heard.clock.disconnected()
    assert heard.hear(0, 2.0) == Stamp(SESSION, 0), "known after a reconnection too"


def test_a_clock_of_another_session_has_to_hold_anew() -> None:
    heard = Heard()
    heard.run_in()
    assert heard.hear(2100, 1.1, session=10) is None
    assert heard.hear(2200, 1.2, session=10) is None
    assert heard.hear(2300, 1.3, session=10) == Stamp(10, 2300)


def test_no_stamp_while_the_session_is_0() -> None:
    heard = Heard()
    for number in range(5):
        assert heard.hear(500 + number, 0.001 * number, session=0) is None


@given(
    start=st.integers(0, MODULUS - 1),
    torn=st.lists(st.tuples(st.integers(0, 300), st.sampled_from(["high", "low"])), max_size=40),
)
def test_whatever_is_half_written_no_stamp_is_off_by_more_than_the_tolerance(
    start: int, torn: list[tuple[int, str]]
) -> None:
    heard = Heard()
    halves = dict(torn)
    for number in range(320):
        whole, before = (start + 100 * number) % MODULUS, (start + 100 * (number - 1)) % MODULUS
        if number in halves:
            first = halves[number]
            seen = (whole & 0xFFFF0000 | before & 0xFFFF) if first == "high" else (before & 0xFFFF0000 | whole & 0xFFFF)
            for part in range(5):
                heard.hear(seen, 0.1 * number + 0.01 * part, beats=False)
        stamp = heard.hear(whole, 0.1 * number + 0.06)
        if stamp is not None:
            off_ms = (stamp.clock_ms - whole + MODULUS // 2) % MODULUS - MODULUS // 2
            assert abs(off_ms) <= 1000
    assert stamp is not None, "the last two seconds were whole"
