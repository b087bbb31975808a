"""When a wait for a reply begins with looking for it, instead of sleep."""

from __future__ import annotations

import os
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.modbus.byte_channel import ByteChannel
from drivers.controller.modbus.looking import RAREST, Looking


def waits_to_the_next_look(known: Looking) -> int:
    waits = 0
    while not known.worth():
        waits += 1
    return waits


def test_each_look_in_vain_makes_the_next_ones_rarer_up_to_a_bound() -> None:
    known = Looking()
    paused = []
    for _ in range(13):
        paused.append(waits_to_the_next_look(known))
        known.ended(came=False)
    assert paused == [0, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 1024, 1024]


def test_a_controller_that_answers_at_once_is_looked_for_each_time() -> None:
    known = Looking()
    for _ in range(100):
        assert known.worth()
        known.ended(came=True)


def test_one_reply_that_came_is_half_of_the_trust_back() -> None:
    known = Looking()
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
    known = Looking()
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
    assert channel.wait(60.0)
    assert got == [b"late"]
    far.send(b"there")
    assert channel.wait(60.0)
    assert got == [b"late", b"there"]
    assert not channel.wait(0.0)
    late.join()
    channel.close()
    far.close()
