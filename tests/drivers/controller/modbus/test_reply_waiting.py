"""When the event loop is held for a reply."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.modbus.reply_waiting import HOLD_S, PROMPT_S, WAIT_S, Promptness

PROMPT = PROMPT_S / 10


def test_it_is_not_held_for_a_controller_that_is_not_known() -> None:
    assert not Promptness().worth(100.0)


def test_it_is_held_for_one_that_was_prompt_and_no_more_for_one_that_was_slow() -> None:
    known = Promptness()
    known.came_by_loop(PROMPT)
    assert known.worth(100.0)
    known.waited(2 * PROMPT_S, 100.0, came=True)
    assert not known.worth(100.0)


def test_each_vain_wait_needs_twice_as_many_prompt_replies_before_the_next() -> None:
    known = Promptness()
    for needed in (1, 2, 4, 8):
        for _ in range(needed):
            assert not known.worth(100.0)
            known.came_by_loop(PROMPT)
        assert known.worth(100.0)
        known.waited(WAIT_S, 100.0, came=False)


@given(st.lists(st.tuples(st.floats(0, WAIT_S), st.booleans(), st.floats(0, HOLD_S)), max_size=60))
def test_it_is_never_held_for_longer_than_the_bound_without_a_turn(waits: list[tuple[float, bool, float]]) -> None:
    known = Promptness()
    known.came_by_loop(PROMPT)
    now, held_s = 100.0, 0.0
    for took_s, came, own_work_s in waits:
        if not known.worth(now):
            known.came_by_loop(PROMPT)
            held_s = 0.0
        now += took_s
        held_s += took_s
        assert held_s <= HOLD_S + 1e-12
        known.waited(took_s, now, came)
        now += own_work_s
