from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.jobs.trigger_lines import (
    Malformed,
    PingRequest,
    StatusRequest,
    TriggerRequest,
    ack,
    done,
    fail,
    nak,
    parse_line,
    pong,
)

BAD_REQUEST = Malformed(400, "bad_request")
UNKNOWN_RECIPE = Malformed(122, "unknown_recipe")


@pytest.mark.parametrize(
    ("line", "request_"),
    [
        (b"TRIG", TriggerRequest()),
        (b"trig", TriggerRequest()),
        (b"  TRIG \t", TriggerRequest()),
        (b"TRIG recipe=1", TriggerRequest(1)),
        (b"Trig  RECIPE=0065535", TriggerRequest(65_535)),
        (b"TRIG recipe=0", TriggerRequest()),
        (b"STAT", StatusRequest()),
        (b"PING", PingRequest()),
        (b"", None),
        (b" \t ", None),
    ],
)
def test_a_good_line_is_understood_and_an_empty_one_passed_over(line, request_):
    assert parse_line(line) == request_


@pytest.mark.parametrize("number", [b"", b"65536", b"-1", b"+1", b"1.0", b"abc", b"0x10", b"1_0", b"9" * 60, b"\xb2"])
def test_a_recipe_that_no_number_can_be_is_unknown(number):
    assert parse_line(b"TRIG recipe=" + number) == UNKNOWN_RECIPE


@pytest.mark.parametrize(
    "line",
    [
        b"TRIGGER",
        b"TRIG 1",
        b"TRIG recipe=1 recipe=2",
        b"TRIG recipe = 1",
        b"TRIG recipe",
        b"TRIG recipes=1",
        b"TRIG,recipe=1",
        b"PING PING",
        b"STAT 1",
        b"\x00TRIG",
        b"TRIG\x00",
        b"\xff\xfe",
        b"ACK 1",
        b"TRIG" + b" " * 77,
        b" " * 81,
    ],
)
def test_anything_else_is_a_bad_request(line):
    assert parse_line(line) == BAD_REQUEST


@given(st.binary(max_size=120))
def test_no_bytes_whatever_raise(line):
    assert isinstance(parse_line(line), TriggerRequest | StatusRequest | PingRequest | Malformed | None)


WORDS = st.lists(st.sampled_from([b"TRIG", b"trig", b"TRIGG", b"STAT", b"recipe=7", b"\0", b"x"]), max_size=3)


@given(WORDS.map(b" ".join))
def test_a_job_is_begun_by_the_word_trig_alone_or_with_one_recipe(line):
    word, *rest = line.split() or [b""]
    begins = word.upper() == b"TRIG" and rest in ([], [b"recipe=7"])
    assert isinstance(parse_line(line), TriggerRequest) == begins


@given(st.integers(1, 65_535))
def test_every_recipe_number_passes(number):
    assert parse_line(b"TRIG recipe=%d" % number) == TriggerRequest(number)


def test_replies_read_as_the_protocol_says():
    assert ack(7) == "ACK 7"
    assert done(7, 4, 5000.4) == "DONE 7 4 5000"
    assert fail(7, 110, "no_block_found") == "FAIL 7 110 no_block_found"
    assert nak(120, "busy") == "NAK 120 busy"
    assert pong() == "PONG"


@pytest.mark.parametrize("area_mm2", [math.nan, math.inf, -1.0])
def test_an_area_that_is_no_area_is_not_sent(area_mm2):
    with pytest.raises(ValueError, match="area_mm2"):
        done(7, 4, area_mm2)


def test_the_longest_replies_fit_on_a_line():
    longest = [
        done(2**32 - 1, 10**6, 4e9),
        fail(2**32 - 1, 114, "uncertainty_too_large"),
        nak(122, "unknown_recipe"),
    ]
    assert max(map(len, longest)) <= 80
