from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from drivers.trigger.lines import LONGEST, LineSplitter

texts = st.lists(st.binary(max_size=LONGEST).filter(lambda text: not set(text) & set(b"\r\n")), max_size=8)
ends = st.sampled_from([b"\r", b"\n", b"\r\n"])


def in_pieces(splitter, data, cuts):
    """The lines of `data`, fed in pieces."""
    marks = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [line for start, end in pairwise(marks) for line in splitter.feed(data[start:end])]


@given(texts, ends, st.lists(st.integers(0, 1000)))
def test_lines_come_out_as_they_went_in_however_they_are_cut_up(lines, end, cuts):
    assert in_pieces(LineSplitter(), b"".join(line + end for line in lines), cuts) == lines


@given(st.binary(max_size=600), st.lists(st.integers(0, 1000)))
def test_pieces_never_matter(data, cuts):
    assert in_pieces(LineSplitter(), data, cuts) == LineSplitter().feed(data)


@given(st.binary(max_size=2000))
def test_after_any_noise_and_a_line_end_the_next_line_is_whole(noise):
    splitter = LineSplitter()
    lines = splitter.feed(noise + b"\rPING\n")
    assert lines[-1] == b"PING"
    assert all(len(line) <= LONGEST + 1 for line in lines)


def test_a_line_of_80_is_whole_and_one_of_81_is_told_once_as_too_long():
    splitter = LineSplitter()
    assert splitter.feed(b"a" * 80 + b"\r") == [b"a" * 80]
    assert splitter.feed(b"b" * 81) == [b"b" * 81]
    assert splitter.feed(b"b" * 10_000) == []
    assert splitter.feed(b"\r\nPING\r\n") == [b"PING"]


def test_a_lone_line_feed_after_a_finished_crlf_is_an_empty_line():
    assert LineSplitter().feed(b"a\r\n\n\rb\n") == [b"a", b"", b"", b"b"]


def test_a_dropped_beginning_leaves_the_next_line_whole():
    splitter = LineSplitter()
    splitter.feed(b"\xff\x00")
    splitter.drop()
    assert splitter.feed(b"TRIG\r") == [b"TRIG"]
    splitter.feed(b"x" * 200)
    splitter.drop()
    assert splitter.feed(b"TRIG\r") == [b"TRIG"]
