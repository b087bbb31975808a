"""One service per controller: what is found in `owner`, and what may then be written."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from contextlib import suppress

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivers.controller.mailbox.blocks import ServiceBlock
from service.link.ownership import ForeignOwner, Ownership

OURS, THEIRS = 100, 200


class Watched:
    """An ownership on a clock that the test moves."""

    def __init__(self) -> None:
        self.time = 0.0
        self.ownership = Ownership(OURS, now=lambda: self.time)

    def see(self, owner: int, beat: int = 0, *, after_s: float = 0.1) -> bool:
        self.time += after_s
        return self.ownership.saw(ServiceBlock(owner=owner, service_heartbeat=beat))

    def write(self, beat: int) -> None:
        """A write of ours that was confirmed."""
        self.ownership.writing(beat)
        self.ownership.wrote()

    def begin(self) -> None:
        """Begin on registers that nobody has written: our heartbeat 1 stands there now."""
        assert self.see(0)
        self.write(1)
        assert self.ownership.ours

    def see_for(self, seconds: float, owner: int, beats: Iterable[int]) -> list[bool]:
        return [self.see(owner, beat) for beat in itertools.islice(beats, round(seconds * 10))]


def test_registers_that_nobody_has_written_are_ours_with_the_first_write() -> None:
    watched = Watched()
    assert watched.see(0)
    assert not watched.ownership.ours
    watched.write(1)
    assert watched.ownership.ours


def test_our_own_number_is_watched_for_1_5_s_before_anything_is_written() -> None:
    watched = Watched()
    assert watched.see_for(1.5, OURS, itertools.repeat(7)) == [False] * 15
    assert "with our number" in (watched.ownership.fault() or "")
    assert watched.see(OURS, 7)
    watched.write(8)
    assert watched.ownership.ours


def test_a_copy_of_our_journal_that_lives_is_left_alone() -> None:
    watched = Watched()
    assert not any(watched.see_for(20.0, OURS, (number // 9 for number in itertools.count())))
    assert watched.ownership.conflict
    assert "a copied journal" in (watched.ownership.fault() or "")


def test_one_late_write_of_our_former_life_is_no_other_service() -> None:
    watched = Watched()
    watched.see_for(1.0, OURS, itertools.repeat(7))
    assert watched.see_for(1.5, OURS, itertools.repeat(8)) == [False] * 15, "watched anew"
    assert watched.see(OURS, 8)


def test_a_heartbeat_that_we_did_not_write_twice_in_a_row_is_another_with_our_number() -> None:
    watched = Watched()
    watched.begin()
    assert watched.see(OURS, 1)
    watched.write(2)
    assert not watched.see(OURS, 77)
    assert not watched.ownership.ours
    assert not watched.ownership.decided, "looked at again at once"
    assert not watched.see(OURS, 78)
    assert watched.ownership.conflict


def test_a_heartbeat_of_ours_that_lands_late_is_ours() -> None:
    watched = Watched()
    watched.begin()
    watched.ownership.writing(2)  # no reply
    watched.ownership.disconnected()
    watched.write(3)
    assert watched.see(OURS, 3)
    assert watched.see(OURS, 2)
    assert watched.see(OURS, 2)
    assert watched.ownership.ours


def test_what_a_controller_remembers_after_its_restart_is_ours() -> None:
    watched = Watched()
    watched.begin()
    for beat in range(2, 600):
        watched.write(beat)
    watched.ownership.controller_restarted()
    assert watched.see(OURS, 5), "registers of long ago"
    watched.write(600)
    assert watched.see(OURS, 600)
    assert not watched.see(OURS, 30)


def test_a_persons_word_begins_anew() -> None:
    watched = Watched()
    watched.begin()
    watched.see(THEIRS, 5)
    watched.see(THEIRS, 5)
    assert watched.ownership.conflict
    watched.ownership.begin()
    assert watched.see_for(3.0, THEIRS, itertools.repeat(5)) == [False] * 30
    assert watched.see(THEIRS, 5)


def test_before_the_first_look_nothing_may_be_sent() -> None:
    with pytest.raises(ForeignOwner, match="not been read yet"):
        Watched().ownership.check()


def test_a_foreign_owner_whose_heartbeat_moves_is_left_alone_for_good() -> None:
    watched = Watched()
    assert not any(watched.see_for(20.0, THEIRS, itertools.count()))
    assert watched.ownership.conflict
    assert "Stop one of the two" in (watched.ownership.fault() or "")
    assert not any(watched.see_for(20.0, THEIRS, itertools.repeat(7))), "also when it stops: a person decides"
    assert not watched.see(OURS)


def test_a_foreign_owner_whose_heartbeat_stands_for_3_s_is_taken_over_and_ours_must_stand_for_3_s_more() -> None:
    watched = Watched()
    assert watched.see_for(3.0, THEIRS, itertools.repeat(7)) == [False] * 30
    assert not watched.ownership.ours
    while not watched.see(THEIRS, 7):  # from here on our own stands there
        assert watched.time < 3.5
    beats = itertools.count(1)
    watched.write(0)
    claimed_at = watched.time
    while not watched.ownership.ours:
        beat = next(beats)
        assert watched.see(OURS, beat - 1), "the heartbeat goes on meanwhile"
        watched.write(beat)
        with suppress(ForeignOwner):
            watched.ownership.check()
            assert watched.ownership.ours
    assert 3.0 <= watched.time - claimed_at < 3.3


def test_a_heartbeat_that_moves_in_the_last_moment_counts() -> None:
    watched = Watched()
    watched.see_for(2.9, THEIRS, itertools.repeat(7))
    watched.see(THEIRS, 8)
    assert watched.ownership.conflict


def test_another_that_writes_while_ours_must_stand_is_left_alone() -> None:
    watched = Watched()
    while not watched.see(THEIRS, 7):
        pass
    watched.write(1)
    assert all(watched.see_for(1.0, OURS, itertools.repeat(1)))
    assert not any(watched.see_for(20.0, THEIRS, itertools.repeat(9)))
    assert watched.ownership.conflict


def test_a_claim_whose_write_was_lost_with_the_connection_is_watched_anew() -> None:
    watched = Watched()
    while not watched.see(THEIRS, 7):
        pass
    watched.ownership.writing(1)
    watched.ownership.disconnected()
    assert not watched.see(THEIRS, 7, after_s=1.1)
    assert watched.see_for(2.8, THEIRS, itertools.repeat(7)) == [False] * 28
    assert any(watched.see_for(0.3, THEIRS, itertools.repeat(7)))


def test_a_pause_without_a_connection_is_no_time_of_watching() -> None:
    watched = Watched()
    watched.see_for(1.0, THEIRS, itertools.repeat(7))
    watched.ownership.disconnected()
    assert not watched.see(THEIRS, 7, after_s=60.0)
    assert watched.see_for(2.9, THEIRS, itertools.repeat(7)) == [False] * 29


@pytest.mark.parametrize(("owner", "watch_s"), [(THEIRS, 3.0), (OURS, 1.5)])
def test_a_line_that_loses_replies_is_watched_to_the_end_without_its_pauses(owner: int, watch_s: float) -> None:
    watched = Watched()
    seen_s = -0.1
    while not watched.see(owner, 7):
        seen_s += 0.1
        if round(seen_s, 1) in (0.3, 0.8, 1.3, 1.4):
            watched.ownership.disconnected()
            assert not watched.see(owner, 7, after_s=0.4)
    assert seen_s == pytest.approx(watch_s, abs=0.15)


def test_a_heartbeat_that_moved_while_replies_were_lost_has_moved() -> None:
    watched = Watched()
    watched.see_for(1.0, THEIRS, itertools.repeat(7))
    watched.ownership.disconnected()
    assert not watched.see(THEIRS, 8, after_s=0.4)
    assert watched.ownership.conflict


@pytest.mark.parametrize(("owner", "found"), [(OURS, 7), (0, 0)])
def test_our_first_write_that_lands_late_is_ours(owner: int, found: int) -> None:
    watched = Watched()
    while not watched.see(owner, found):
        pass
    watched.ownership.writing(20)  # no reply
    watched.ownership.disconnected()
    assert watched.see(owner, found, after_s=0.4)
    watched.write(21)
    assert watched.see(OURS, 21)
    assert all(watched.see_for(0.3, OURS, itertools.repeat(20)))
    assert watched.ownership.ours


def test_a_write_of_ours_that_lands_late_is_ours_however_many_came_after_it() -> None:
    watched = Watched()
    watched.begin()
    watched.ownership.writing(2)  # no reply
    watched.ownership.disconnected()
    for beat in range(3, 103):  # ten jobs, in a second and a half
        watched.write(beat)
        assert watched.see(OURS, beat, after_s=0.015)
    assert all(watched.see_for(0.3, OURS, itertools.repeat(2)))


def test_a_write_of_before_a_restart_of_the_controller_that_lands_after_it_is_ours() -> None:
    watched = Watched()
    watched.begin()
    watched.ownership.writing(2)  # no reply
    watched.ownership.disconnected()
    watched.ownership.controller_restarted()
    assert watched.see(OURS, 1)
    watched.write(3)
    assert all(watched.see_for(0.3, OURS, itertools.repeat(2)))
    assert watched.ownership.ours


def test_our_claim_stands_over_a_lost_reply() -> None:
    watched = Watched()
    while not watched.see(THEIRS, 7):
        pass
    watched.write(1)
    assert all(watched.see_for(1.5, OURS, itertools.repeat(1)))
    watched.ownership.disconnected()
    assert watched.see(OURS, 1, after_s=0.5)
    assert not watched.ownership.ours
    assert all(watched.see_for(1.8, OURS, itertools.repeat(1)))
    assert watched.ownership.ours


def test_one_reading_alone_is_not_acted_on() -> None:
    watched = Watched()
    watched.begin()
    assert not watched.see(THEIRS)
    assert not watched.ownership.conflict
    assert watched.see(OURS, 1)
    assert watched.ownership.ours


def test_a_foreign_owner_later_stops_all_writing_until_a_person_says_so() -> None:
    watched = Watched()
    watched.begin()
    watched.see(THEIRS)
    assert not watched.see(THEIRS)
    assert watched.ownership.conflict
    with pytest.raises(ForeignOwner, match="combtrace confirm"):
        watched.ownership.check()
    assert not any(watched.see_for(20.0, THEIRS, itertools.repeat(0))), "also when it stands still"
    assert not watched.see(OURS, 1)


@example(readings=[(THEIRS, 0, 0.0), (THEIRS, 0, 0.0), (THEIRS, 0, 2.9)], written=False)  # hardly ever drawn
@example(readings=[(OURS, 0, 0.0), (OURS, 0, 0.0), (OURS, 0, 1.4)], written=False)
@given(
    st.lists(st.tuples(st.sampled_from([0, OURS, THEIRS, 300]), st.integers(0, 1), st.floats(0, 2.9)), max_size=60),
    st.booleans(),
)
def test_nothing_is_written_over_another_that_moved_or_was_watched_for_less_than_3_s(
    readings: list[tuple[int, int, float]], written: bool
) -> None:
    watched = Watched()
    still: tuple[int, int] | None = None
    since = 0.0
    for owner, beat, after_s in readings:
        allowed = watched.see(owner, beat, after_s=after_s)
        if (owner, beat) != still:
            still, since = (owner, beat), watched.time
        if allowed and owner not in (0, OURS):
            assert watched.time - since >= 3.0
        if allowed and owner == OURS and not watched.ownership.begun:
            assert watched.time - since >= 1.5
        if allowed and written:
            watched.write(beat)
