"""A slice of each campaign of `make soak`, and what judges them: every promise, broken on purpose, is found broken."""

from __future__ import annotations

import copy
import logging
from collections import Counter
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from tests.soak.cells.faulted_cell import FaultedCell, Terms
from tests.soak.pieces import INCIDENTS, Amounts, all_pieces, faulted_terms, incident_terms, killing_terms
from tests.soak.promises import PROMISES, Evidence, Findings, Side, Taken, judge, judge_twins
from tests.soak.report import NAMES, write_report

SLICES = [
    Terms(seed=901, jobs=15, risk=0.06),
    Terms(seed=902, jobs=12, risk=0.12, forgetful=True, slow_program=True, word_order="little"),
    Terms(seed=903, jobs=8, risk=0.12, has_clock=False),
    Terms(seed=904, jobs=12, risk=0.12, slow_program=True, payload_capacity=64, part_capacity=600, word_order="little"),
]


@pytest.mark.parametrize("terms", SLICES, ids=str)
async def test_what_always_holds_holds_under_faults_and_restarts(
    tmp_path: Path, terms: Terms, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "pymodbus")
    came_to = await FaultedCell(tmp_path, terms).run(60)
    assert came_to.findings.counts == Counter(), came_to.findings.texts
    # How many of them are accepted hangs on how long each fault holds a request up, which no seed fixes.
    assert came_to.acknowledged >= 5, "nothing was tried"
    assert came_to.accepted >= 1, "nothing was brought to its end"
    assert came_to.faults.total() >= 1, "nothing was done to it"


# --- the judge --------------------------------------------------------------------------------------------------------

SQUARE = (((0, 0), (100, 0), (100, 100), (0, 100)),)


def row(job: int, outcome: str | None = "accepted", reason: int | None = None, **values: Any) -> dict[str, Any]:
    found = {"job_id": job, "outcome": outcome, "reason": reason, "detail": None, "session": 9}
    second = f"2026-01-01T00:00:{job % 60:02}"
    found |= {"taken_at": f"{second}+00:00", "settled_at": f"{second}.500+00:00"}
    return {**found, "trigger_kind": "controller", "trigger_session": 9, "trigger_counter": job, **values}


def evidence() -> Evidence:
    """Two jobs for two triggers, one accepted and one refused, in order."""
    return Evidence(
        jobs=[row(1), row(2, "refused", 151)],
        taken=[Taken(1, SQUARE, at_s=10.5, session=9, trigger=1)],
        events=[
            {"event": kind, "session": 9, "trigger": number}
            for number in (1, 2)
            for kind in ("trigger", "acknowledged")
        ],
        measured={1: SQUARE},
        exposed={1: 10.0},
        valid_for_s=0.8,
    )


def twice(given: Evidence) -> None:
    given.taken.append(copy.copy(given.taken[0]))


def torn(given: Evidence) -> None:
    given.measured[1] = (((0, 0), (100, 0), (100, 101), (0, 100)),)


def unknown(given: Evidence) -> None:
    given.measured.clear()


def too_late(given: Evidence) -> None:
    given.exposed[1] = 9.0


def in_another_session(given: Evidence) -> None:
    given.jobs[0]["session"] = 8


def for_another_trigger(given: Evidence) -> None:
    given.taken[0] = Taken(1, SQUARE, 10.5, 9, 2)


def claimed(given: Evidence) -> None:
    given.jobs[1] = row(2)


def denied(given: Evidence) -> None:
    given.jobs[0] = row(1, "failed", 153)


def never_ended(given: Evidence) -> None:
    given.jobs[1] = row(2, None)


def lost(given: Evidence) -> None:
    del given.jobs[1]


def repeated(given: Evidence) -> None:
    given.jobs.append(row(3, "refused", 110, trigger_counter=2))


def invented(given: Evidence) -> None:
    given.jobs.append(row(3, "refused", 110))


def numbered_twice(given: Evidence) -> None:
    given.jobs.append(row(2, "refused", 151, taken_at="2026-01-01T00:01:00+00:00"))


def untold(given: Evidence) -> None:
    given.said = ["ACK 1", "DONE 1 4 100", "ACK 2"]


def told_falsely(given: Evidence) -> None:
    given.said = ["ACK 2", "DONE 2 4 100"]


def told_another_reason(given: Evidence) -> None:
    given.said = ["ACK 2", "FAIL 2 110 no_block_found"]


def impolite(given: Evidence) -> None:
    given.verdict_kinds["value-split"] = 1


CRIMES = {
    twice: {"accepted-twice"},
    torn: {"torn-or-misread"},
    unknown: {"torn-or-misread"},
    too_late: {"stale"},
    in_another_session: {"stale"},
    for_another_trigger: {"stale"},
    claimed: {"falsely-accepted"},
    denied: {"falsely-denied"},
    never_ended: {"unsettled", "trigger-lost"},
    lost: {"trigger-lost"},
    repeated: {"trigger-repeated"},
    invented: {"trigger-invented"},
    numbered_twice: {"number-repeated"},
    untold: {"answer-missing"},
    told_falsely: {"answer-wrong"},
    told_another_reason: {"answer-wrong"},
    impolite: {"against-protocol"},
}


def test_evidence_in_order_is_found_in_order() -> None:
    assert judge(evidence()).counts == Counter()


@pytest.mark.parametrize(("crime", "kinds"), CRIMES.items(), ids=lambda value: getattr(value, "__name__", None))
def test_each_broken_promise_is_found_broken(crime: Any, kinds: set[str]) -> None:
    given = evidence()
    crime(given)
    found = set(judge(given).counts)
    assert kinds <= found
    assert found - kinds <= {"accepted-twice"}


def test_every_promise_can_be_found_broken() -> None:
    told_by_cells = {"ended", "both-go-on", "expired-in-time"}  # each has its test below
    assert set().union(*CRIMES.values()) | told_by_cells == set(PROMISES)


def test_a_denied_job_is_forgiven_only_a_controller_that_lost_its_memory() -> None:
    given = evidence()
    denied(given)
    given.memory_lost = True
    assert judge(given).counts == Counter()


def answered(job: int, second: int) -> dict[str, Any]:
    return {"event": "answer", "job": job, "answer": 11, "whole": False, "at": f"2026-01-01T00:00:{second:02}+00:00"}


@pytest.mark.parametrize("reason", [153, 155])
def test_a_denied_job_is_forgiven_another_service_only_below_a_job_that_had_ended(reason: int) -> None:
    given = evidence()
    given.jobs[0] = row(1, "failed", reason)
    given.other_service = True
    given.events += [answered(1, 0), answered(2, 2)]  # what came later, and its own answer, excuse nothing
    assert set(judge(given).counts) == {"falsely-denied"}
    given.events.append(answered(2, 1))
    assert judge(given).counts == Counter()
    given.other_service = False
    assert set(judge(given).counts) == {"falsely-denied"}


def test_a_job_that_was_taken_back_later_counts_in_the_session_in_which_it_was_accepted() -> None:
    given = evidence()
    given.jobs.append(row(1, "accepted", session=10))
    assert judge(given).counts == Counter()
    given.jobs[0] = row(1, "accepted", session=11)
    assert set(judge(given).counts) == {"stale"}


def test_a_denied_job_is_forgiven_a_controller_that_was_taken_away() -> None:
    given = evidence()
    given.jobs[0] = row(1, "failed", 156)
    assert set(judge(given).counts) == {"falsely-denied"}
    given.gone = frozenset({1})
    assert judge(given).counts == Counter()
    given.jobs[0] = row(1, None)
    assert "unsettled" in judge(given).counts, "it must end all the same"


def test_a_job_found_at_the_controller_is_not_its_number_given_again() -> None:
    given = evidence()
    given.jobs.insert(0, row(1, taken_at="2026-01-01T00:01:00+00:00", trigger_kind="found", trigger_counter=None))
    assert judge(given).counts == Counter()


def encountered(
    first: list[dict[str, Any]], second: list[dict[str, Any]], *, by_first: bool = True, earlier: Any = SQUARE
) -> set[str]:
    """What is found of two services that both measured job 7, where the controller took the one's contour.

    earlier: what it took of job 6, which an earlier life of the first one measured as SQUARE.
    """
    other = (((0, 0), (100, 0), (100, 101), (0, 100)),)
    taken = [Taken(7, SQUARE if by_first else other), Taken(6, earlier)]
    findings = Findings()
    noticed_at = datetime.fromisoformat("2026-01-01T00:00:08+00:00")
    judge_twins(
        (Side(first, {7: SQUARE}), Side(second, {7: other})), taken, [], noticed_at, 0.8, findings, before={6: SQUARE}
    )
    return set(findings.counts)


def test_of_two_services_with_one_number_each_may_claim_only_what_is_its_own() -> None:
    other = row(1027, "failed", 155)
    assert encountered([row(7)], [other]) == set()
    assert encountered([row(7)], [row(7)]) == {"number-repeated", "falsely-accepted"}
    assert encountered([row(7, "failed", 155)], [other]) == {"falsely-denied"}
    assert encountered([row(7)], [row(1007, None)]) == {"unsettled"}
    assert encountered([row(7)], [other], by_first=False) == {"falsely-accepted"}


def test_of_two_services_one_may_find_what_an_earlier_life_of_the_other_sent() -> None:
    found = row(6, trigger_kind="found")
    assert encountered([row(7)], [found]) == set()
    assert encountered([row(7)], [found], earlier=(((0, 0), (1, 0), (1, 1)),)) == {"torn-or-misread"}


def test_of_two_services_with_one_number_only_one_may_go_on() -> None:
    late = row(9, "refused", 110)
    assert encountered([row(7), late], [row(1027, "failed", 155)]) == set()
    assert encountered([row(7), late], [row(1029, "refused", 110)]) == {"both-go-on"}


# --- pieces and report ------------------------------------------------------------------------------------------------


def test_the_pieces_amount_to_what_was_asked_and_each_has_its_own_terms() -> None:
    names = all_pieces(Amounts())
    sums: Counter[str] = Counter()
    for name in names:
        campaign, _, amount = name.split(":")
        sums[campaign] += int(amount)
    assert sums == {
        "tcp": 5000,
        "rtu": 500,
        "rtu-over-tcp": 500,
        "service-kills": 500,
        "controller-kills": 100,
        "service-stops": 100,
        "controller-stops": 50,
        "restored-journals": 1200,
        "copied-journals": 40,
        "foreign-owners": 240,
        "spare-controllers": 360,
        "changed-settings": 200,
        "torn-values": 350,
        "small-disks": 40,
        "serial-answers": 100,
        "fuzz": 100_000,
    }
    assert len(set(names)) == len(names)
    terms = [faulted_terms("tcp", number, 1) for number in range(1, 41)]
    assert {term.word_order for term in terms} == {"big", "little"}
    assert {term.payload_capacity for term in terms if term.word_order == "little"} == {1984, 64, 602, 24}
    assert set(sums) == set(NAMES), "each has its row in the report"
    for campaign in INCIDENTS:
        assert {incident_terms(campaign, number, 1).word_order for number in range(1, 5)} == {"big", "little"}
    assert {killing_terms("service-kills", number, 1).payload_capacity for number in range(1, 9)} == {1984, 64}


def test_the_report_replaces_its_own_section_and_leaves_the_rest(tmp_path: Path) -> None:
    page = tmp_path / "reliability.md"
    page.write_text("# Reliability\n\nRules.\n")
    result: dict[str, Any] = {
        "campaign": "tcp",
        "terms": "",
        "done": 5,
        "jobs": 5,
        "accepted": 3,
        "acknowledged": 5,
        "restarts": 1,
        "seconds": 9.0,
        "outcomes": {"accepted": 3, "failed": 2},
        "faults": {"lost-reply": 4},
        "instants": {"service": 1},
        "findings": {"stale": 1},
        "texts": ["stale: job 3"],
    }
    write_report(page, [result])
    first = page.read_text()
    assert first.startswith("# Reliability\n\nRules.\n")
    assert "| lost-reply | 4 |" in first
    assert "stale: job 3" in first
    page.write_text(first + "\nAfter.\n")
    write_report(page, [{**result, "findings": {}, "texts": []}])
    second = page.read_text()
    assert second.count("## Campaigns") == 1
    assert "stale: job 3" not in second
    assert second.endswith("\nAfter.\n")


def test_a_session_that_was_drawn_twice_after_lost_memory_makes_no_repeated_trigger() -> None:
    given = evidence()
    given.events.append({"event": "trigger", "session": 9, "trigger": 2})
    given.jobs.append(row(3, "refused", 110, trigger_counter=2))
    assert judge(given).counts == Counter()
