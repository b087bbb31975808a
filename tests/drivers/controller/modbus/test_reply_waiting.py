"""When the event loop is held for a reply, and when such a wait begins with looking for it, instead of sleep."""

from __future__ import annotations

import os
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.modbus.byte_channel import ByteChannel
from drivers.controller.modbus.reply_waiting import HOLD_S, PROMPT_S, RAREST, WAIT_S, InPlaceWaiting, Spinning

PROMPT = PROMPT_S / 10


def test_it_is_not_held_for_a_controller_that_is_not_known() -> None:
    assert not InPlaceWaiting().worth(100.0)


def test_it_is_held_for_one_that_was_prompt_and_no_more_for_one_that_was_slow() -> None:
    known = InPlaceWaiting()
    known.came_by_loop(PROMPT)
    assert known.worth(100.0)
    known.waited(2 * PROMPT_S, 100.0, came=True)
    assert not known.worth(100.0)


def test_each_vain_wait_needs_twice_as_many_prompt_replies_before_the_next() -> None:
    known = InPlaceWaiting()
    for needed in (1, 2, 4, 8):
        for _ in range(needed):
            assert not known.worth(100.0)
            known.came_by_loop(PROMPT)
        assert known.worth(100.0)
        known.waited(WAIT_S, 100.0, came=False)


@given(st.lists(st.tuples(st.floats(0, WAIT_S), st.booleans(), st.floats(0, HOLD_S)), max_size=60))
def test_it_is_never_held_for_longer_than_the_bound_without_a_turn(waits: list[tuple[float, bool, float]]) -> None:
    known = InPlaceWaiting()
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


# --- looking before sleeping ------------------------------------------------------------------------------------------


def waits_to_the_next_look(known: Spinning) -> int:
    waits = 0
    while not known.worth():
        waits += 1
    return waits


def test_each_look_in_vain_makes_the_next_ones_rarer_up_to_a_bound() -> None:
    known = Spinning()
    paused = []
    for _ in range(13):
        paused.append(waits_to_the_next_look(known))
        known.ended(came=False)
    assert paused == [0, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 1024, 1024]


def test_a_controller_that_answers_at_once_is_looked_for_each_time() -> None:
    known = Spinning()
    for _ in range(100):
        assert known.worth()
        known.ended(came=True)


def test_one_reply_that_came_is_half_of_the_trust_back() -> None:
    known = Spinning()
    for _ in range(4):
        waits_to_the_next_look(known)
        known.ended(came=False)
    assert waits_to_the_next_look(known) == 16
    known.ended(came=True)
    assert known.worth()
    known.ended(came=False)
    assert waits_to_the_next_look(known) == 16


@given(st.lists(st.booleans(), max_size=200))
def test_the_next_look_always_comes(looks: list[bool]) -> None:
    known = Spinning()
    for came in looks:
        assert waits_to_the_next_look(known) <= RAREST
        known.ended(came)


async def test_what_comes_after_a_look_in_vain_is_waited_for_all_the_same() -> None:
    near, far = socket.socketpair()
    near.setblocking(False)
    got: list[bytes] = []
    channel = ByteChannel(near.fileno(), near.close, got.append, pytest.fail)
    late = threading.Timer(0.02, os.write, (far.fileno(), b"late"))
    late.start()
    assert channel.wait(5.0)
    assert got == [b"late"]
    far.send(b"there")
    assert channel.wait(5.0)
    assert got == [b"late", b"there"]
    assert not channel.wait(0.0)
    late.join()
    channel.close()
    far.close()
