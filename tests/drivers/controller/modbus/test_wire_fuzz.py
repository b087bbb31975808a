"""A small slice of the fuzz of what reads from the wire; the soak runs 100,000 cases."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.support.controller import wire_fuzz
from tests.support.controller.wire_fuzz import PROPERTIES, fuzz


@given(st.data())
def test_whatever_comes_for_a_reply_is_waited_with_taken_for_what_it_is_or_refused(data: st.DataObject) -> None:
    wire_fuzz.one_reply(data)


@given(st.data())
def test_whatever_stands_in_a_block_is_read_as_it_stands_or_refused(data: st.DataObject) -> None:
    wire_fuzz.one_block(data)


def test_the_soaks_fuzz_runs_as_many_cases_as_it_is_told() -> None:
    counts = fuzz(300, seed_value=1)
    assert set(counts) == set(PROPERTIES)
    assert sum(counts.values()) >= 300
