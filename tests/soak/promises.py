"""What always holds, held against what both sides say: the controller's own log and verdict, and the service's journal.

Nothing of the service's code is used: the journal is read as SQLite, pages by a decoder written from the protocol.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

Rings = tuple[tuple[tuple[int, int], ...], ...]  # µm, exterior first

PROMISES = {
    "accepted-twice": "one job, or one trigger, accepted by the controller more than once",
    "torn-or-misread": "an accepted contour that is not, to the micrometre, the one measured for its job",
    "stale": "accepted after its time, in another session than the journal's, or for another trigger than the last",
    "falsely-accepted": "accepted in the journal, not at the controller",
    "falsely-denied": "accepted at the controller, refused or failed in the journal",
    "trigger-lost": "an acknowledged trigger without a job that has a final state",
    "trigger-repeated": "two jobs for one trigger",
    "trigger-invented": "a job for a trigger that the controller never gave",
    "unsettled": "a job without a final state after both sides had come to rest",
    "against-protocol": "anything in the controller's verdict but heartbeats that line faults held back",
    "number-repeated": "one job number for two jobs",
    "expired-in-time": "answered 5 (expired) though exposed less than `valid_for` ago, for the last trigger",
    "both-go-on": "two services with one journal's content go on at one controller",
    "answer-missing": "an ACK on a serial line without its DONE or FAIL",
    "answer-wrong": "an ACK, DONE or FAIL on a serial line that the journal does not bear out",
    "ended": "the service ended by itself, or did not come back to Ready",
}
CONTROLLER_RESTARTED, OTHER_SERVICE = 153, 155
AGE_SLACK_S = 0.1  # from the controller's scan, which judges the age, to the log's line


@dataclass(frozen=True)
class Taken:
    """A contour that the controller accepted. at_s: when, on the clock of `exposed`; session, trigger: its own then."""

    job_id: int
    rings: Rings
    at_s: float | None = None
    session: int | None = None
    trigger: int | None = None


@dataclass
class Evidence:
    """All that both sides say of one campaign.

    jobs: rows of the journal. taken: accepted contours. measured: rings by job, or None where they are not known.
    known: rings that a picture can give, where `measured` is not known. events: the controller's own (Verdict.tell).
    verdict_kinds: violations by kind. memory_lost: the controller forgot its last answer at some time.
    other_service: another service, or an older journal of this one, was at the controller. gone: jobs accepted by a
    controller that was taken away before it could say so. said: the service's lines on a serial line.
    """

    jobs: list[dict[str, Any]]
    taken: list[Taken]
    events: list[dict[str, Any]]
    measured: dict[int, Rings] = field(default_factory=dict)
    known: frozenset[Rings] = frozenset()
    exposed: dict[int, float] = field(default_factory=dict)
    valid_for_s: float | None = None
    verdict_kinds: Counter[str] = field(default_factory=Counter)
    memory_lost: bool = False
    other_service: bool = False
    gone: frozenset[int] = frozenset()
    said: list[str] = field(default_factory=list)


class Findings:
    """Violations of the promises: counts by promise, and the first few of each in words."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.texts: list[str] = []

    def add(self, promise: str, text: str, count: int = 1) -> None:
        """Note one."""
        assert promise in PROMISES
        self.counts[promise] += count
        if len(self.texts) < 50:
            self.texts.append(f"{promise}: {text}")


def judge(evidence: Evidence) -> Findings:
    """Every violation of the promises in the evidence."""
    findings = Findings()
    _contours(evidence, findings)
    _outcomes(evidence, findings)
    _triggers(evidence, findings)
    _numbers(evidence.jobs, findings)
    _answers(evidence, findings)
    for kind, count in evidence.verdict_kinds.items():
        if kind != "heartbeat-stalled":
            findings.add("against-protocol", f"{kind} {count}x", count)
    return findings


def _contours(evidence: Evidence, findings: Findings) -> None:
    _accepted_once(Counter(taken.job_id for taken in evidence.taken), findings)
    rows = {row["job_id"]: row for row in evidence.jobs}
    pairs = Counter(
        (rows[taken.job_id]["trigger_session"], rows[taken.job_id]["trigger_counter"])
        for taken in evidence.taken
        if taken.job_id in rows and rows[taken.job_id]["trigger_counter"] is not None
    )
    given = _given(evidence)
    for pair, count in pairs.items():
        if count > max(1, given[pair]):
            findings.add("accepted-twice", f"session and trigger {pair}, {count} times")
    # A job that a restored journal left unsent is taken back in whatever session there is then.
    sessions = {(row["job_id"], row["session"]) for row in evidence.jobs}
    for taken in evidence.taken:
        row = rows.get(taken.job_id)
        same = (taken.job_id, taken.session) in sessions
        _contour(taken, {**row, "session": taken.session} if row and same else row, evidence, findings)


def _accepted_once(times: Counter[int], findings: Findings) -> None:
    for job, count in times.items():
        if count > 1:
            findings.add("accepted-twice", f"job {job}, {count} times")


def _contour(taken: Taken, row: dict[str, Any] | None, evidence: Evidence, findings: Findings) -> None:
    job = taken.job_id
    if row is None:
        findings.add("torn-or-misread", f"job {job} is not in the journal")
        return
    right = evidence.measured.get(job)
    if right is not None and taken.rings != right:
        findings.add("torn-or-misread", f"job {job}: {taken.rings} instead of {right}")
    elif right is None and taken.rings not in evidence.known:
        findings.add("torn-or-misread", f"job {job}: {taken.rings} is no contour of any picture")
    exposed = evidence.exposed.get(job)
    if taken.at_s is not None and exposed is not None and evidence.valid_for_s is not None:
        age = taken.at_s - exposed
        if age > evidence.valid_for_s + AGE_SLACK_S:
            findings.add("stale", f"job {job} accepted {age:.3f} s after its exposure")
    if taken.session is not None and taken.session != row["session"]:
        findings.add("stale", f"job {job} of session {row['session']} accepted in {taken.session}")
    counter = row["trigger_counter"]
    if taken.trigger is not None and counter is not None and counter != taken.trigger:
        findings.add("stale", f"job {job} for trigger {counter} accepted at trigger {taken.trigger}")


def _outcomes(evidence: Evidence, findings: Findings) -> None:
    accepted = {taken.job_id for taken in evidence.taken}
    for row in evidence.jobs:
        job, outcome = row["job_id"], row["outcome"]
        if outcome is None:
            findings.add("unsettled", f"job {job}")
        elif outcome == "accepted" and job not in accepted:
            findings.add("falsely-accepted", f"job {job}")
        elif outcome in ("refused", "failed") and job in accepted:
            if _excepted(row, evidence):
                continue
            findings.add("falsely-denied", f"job {job}: {outcome} {row['reason']} {row['detail']}")


def _excepted(row: dict[str, Any], evidence: Evidence) -> bool:
    """True where the protocol excepts the denial, by what was seen: a controller without memory, or another service.

    Another service's job had ended above it by then, so that `last_job` could tell of this one no more; or no
    `valid_for` bounded how long it could be accepted.
    """
    if row["job_id"] in evidence.gone or (row["reason"] == CONTROLLER_RESTARTED and evidence.memory_lost):
        return True
    if row["reason"] not in (CONTROLLER_RESTARTED, OTHER_SERVICE) or not evidence.other_service:
        return False
    return evidence.valid_for_s is None or any(
        event["job"] > row["job_id"] and at(event["at"]) <= at(row["settled_at"])
        for event in evidence.events
        if event["event"] == "answer" and is_final(event)
    )


def is_final(event: dict[str, Any]) -> bool:
    """True for an answer that ends its job."""
    return event["answer"] in (4, 5, 7, 11) or bool(event["answer"] == 1 and event["whole"])


def at(stamp: str) -> datetime:
    """The time of an event, or of a journal's row."""
    return datetime.fromisoformat(stamp)


def _numbers(rows: list[dict[str, Any]], findings: Findings) -> None:
    """Two jobs of one number differ in when they were taken; one `found` at the controller is the same job again."""
    taken: dict[int, set[str]] = {}
    for row in rows:
        if row["trigger_kind"] != "found":
            taken.setdefault(row["job_id"], set()).add(row["taken_at"])
    for job, stamps in taken.items():
        if len(stamps) > 1:
            findings.add("number-repeated", f"job {job}, taken at {sorted(stamps)}")


def _triggers(evidence: Evidence, findings: Findings) -> None:
    numbered = {(row["trigger_session"], row["trigger_counter"], row["job_id"]) for row in evidence.jobs}
    jobs = Counter((session, counter) for session, counter, _ in numbered if counter is not None)
    given = _given(evidence)
    for pair, count in jobs.items():
        if count > max(1, given[pair]):
            findings.add("trigger-repeated", f"session and trigger {pair}: {count} jobs")
        if not given[pair]:
            findings.add("trigger-invented", f"session and trigger {pair}")
    ended = {(row["trigger_session"], row["trigger_counter"]) for row in evidence.jobs if row["outcome"] is not None}
    for pair in acknowledged(evidence.events):
        if pair not in ended:
            findings.add("trigger-lost", f"session and trigger {pair}")


def _given(evidence: Evidence) -> Counter[tuple[int, int]]:
    """How often the controller gave each trigger, by session and counter.

    More than once where it lost its memory and drew a session at random that it had had before.
    """
    return Counter((event["session"], event["trigger"]) for event in evidence.events if event["event"] == "trigger")


def acks(said: Iterable[str]) -> set[int]:
    """Jobs that were acknowledged on a serial line."""
    return {int(line.split()[1]) for line in said if line.startswith("ACK ")}


def untold(said: list[str]) -> set[int]:
    """Jobs that were acknowledged on a serial line, without their DONE or FAIL on it."""
    return acks(said) - {int(line.split()[1]) for line in said if line.startswith(("DONE ", "FAIL "))}


def _answers(evidence: Evidence, findings: Findings) -> None:
    rows = {row["job_id"]: row for row in evidence.jobs}
    for job in untold(evidence.said):
        findings.add("answer-missing", f"job {job}: ACK, and neither DONE nor FAIL")
    for line in evidence.said:
        word, *rest = line.split()
        if word not in ("ACK", "DONE", "FAIL"):
            continue
        row = rows.get(int(rest[0]))
        done = row is not None and row["outcome"] in ("accepted", "written")
        if row is None or (word == "DONE" and not done) or (word == "FAIL" and (done or str(row["reason"]) != rest[1])):
            told = "no such job" if row is None else f"{row['outcome']} {row['reason']}"
            findings.add("answer-wrong", f"{line!r}, the journal says {told}")


@dataclass
class Side:
    """One of two services with one number: its own rows of its journal, and what it measured by job."""

    rows: list[dict[str, Any]]
    measured: dict[int, Rings]


def judge_twins(
    sides: tuple[Side, Side],
    taken: list[Taken],
    events: list[dict[str, Any]],
    noticed_at: datetime,
    valid_for_s: float | None,
    findings: Findings,
    before: dict[int, Rings],
) -> None:
    """What always holds of two services with copies of one journal, which must have noticed by `noticed_at`.

    before: what the first one measured in earlier lives; the second may find such a job in the service block.
    """
    accepted = {(contour.job_id, contour.rings) for contour in taken}
    numbers = Counter(row["job_id"] for side in sides for row in side.rows if row["trigger_kind"] != "found")
    for job, count in numbers.items():
        if count > 1:
            findings.add("number-repeated", f"job {job} of both of two services with one number")
    if all(any(at(row["taken_at"]) > noticed_at for row in side.rows) for side in sides):
        findings.add("both-go-on", f"both took jobs after {noticed_at:%H:%M:%S}")
    for number, side in enumerate(sides, start=1):
        evidence = Evidence([], [], events, valid_for_s=valid_for_s, other_service=True)
        for row in side.rows:
            job, outcome = row["job_id"], row["outcome"]
            own = (job, side.measured.get(job)) in accepted
            if outcome is None:
                findings.add("unsettled", f"job {job} of service {number} of two")
            elif outcome == "accepted" and not own and row["trigger_kind"] != "found":
                findings.add("falsely-accepted", f"job {job} of service {number} of two, whose contour it was not")
            elif outcome in ("refused", "failed") and own and not _excepted(row, evidence):
                findings.add("falsely-denied", f"job {job} of service {number} of two: {row['reason']} {row['detail']}")
    measured = before.items() | {(job, rings) for side in sides for job, rings in side.measured.items()}
    own = {row["job_id"] for side in sides for row in side.rows}
    for job, rings in accepted:
        if job in own and (job, rings) not in measured:
            findings.add("torn-or-misread", f"job {job} is as neither of two services measured it")
    _accepted_once(Counter(contour.job_id for contour in taken if contour.job_id in own), findings)


def acknowledged(events: Iterable[dict[str, Any]]) -> set[tuple[int, int]]:
    """Triggers, by session and counter, that the controller saw acknowledged."""
    return {(event["session"], event["trigger"]) for event in events if event["event"] == "acknowledged"}


def logged_contours(lines: Iterable[str]) -> list[Taken]:
    """What `simulate-controller --log` wrote: whole lines only."""
    found = []
    for line in lines:
        if line.endswith("\n"):
            contour = json.loads(line)
            rings = [contour["millimetres"]["exterior"], *contour["millimetres"]["holes"]]
            found.append(Taken(contour["job_id"], micrometres(rings)))
    return found


def micrometres(rings_mm: Iterable[Iterable[Iterable[float]]]) -> Rings:
    """Rings in whole micrometres."""
    return tuple(tuple((round(x * 1000), round(y * 1000)) for x, y in ring) for ring in rings_mm)
