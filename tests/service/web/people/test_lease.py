"""One person at a time has the word."""

from __future__ import annotations

from service.web.people.lease import HELD_S, Lease


def test_who_gives_orders_has_the_word_until_a_while_after_the_last_one() -> None:
    now = [0.0]
    lease = Lease(now=lambda: now[0])
    assert (lease.holder(), lease.told(), lease.other_than("anna")) == (None, None, None)
    lease.take("anna")
    now[0] += HELD_S - 1
    lease.take("anna")
    now[0] += HELD_S - 1
    assert lease.other_than("anna") is None
    other = lease.other_than("oleg")
    assert other is not None
    assert (other.who, other.since_s) == ("anna", 0.0)
    assert lease.told() == {"who": "anna", "since_s": 2 * (HELD_S - 1), "left_s": 1.0}
    now[0] += 2
    assert (lease.other_than("oleg"), lease.told()) == (None, None)


def test_who_takes_it_over_has_it_anew() -> None:
    now = [0.0]
    lease = Lease(now=lambda: now[0])
    lease.take("anna")
    now[0] = 10.0
    lease.take("oleg")
    assert lease.told() == {"who": "oleg", "since_s": 0.0, "left_s": HELD_S}
    assert lease.other_than("oleg") is None
