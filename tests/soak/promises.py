"""What always holds, held against what both sides say: the controller's own log and verdict, and the service's journal.

Nothing of the service's code is used: the journal is read as SQLite, pages by a decoder written from the protocol.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
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
    "ended": "the service ended by itself, or did not come back to Ready",
}
CONTROLLER_RESTARTED = 153
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
    for kind, count in evidence.verdict_kinds.items():
        if kind != "heartbeat-stalled":
            findings.add("against-protocol", f"{kind} {count}x", count)
    return findings


def _contours(evidence: Evidence, findings: Findings) -> None:
    times = Counter(taken.job_id for taken in evidence.taken)
    for job, count in times.items():
        if count > 1:
            findings.add("accepted-twice", f"job {job}, {count} times")
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
    for taken in evidence.taken:
        _contour(taken, rows.get(taken.job_id), evidence, findings)


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
            if row["reason"] == CONTROLLER_RESTARTED and evidence.memory_lost:
                continue  # the protocol's one exception
            findings.add("falsely-denied", f"job {job}: {outcome} {row['reason']} {row['detail']}")


def _triggers(evidence: Evidence, findings: Findings) -> None:
    jobs = Counter(
        (row["trigger_session"], row["trigger_counter"]) for row in evidence.jobs if row["trigger_counter"] is not None
    )
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
