"""What a client did against the protocol, as the simulated controller saw it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime

KEPT = 20  # violations of one kind that are told one by one; counts go on

KINDS = {
    "function-code": "another function code than 3, 6 and 16",
    "request-too-long": "more than 123 registers in one FC16",
    "outside-blocks": "a write outside service and contour block",
    "service-block-partial": "the service block written otherwise than whole, in one FC16",
    "service-block-content": "a value in the service block that the protocol does not know",
    "heartbeat-stalled": "service_heartbeat unchanged for more than a second on an open connection",
    "transfer-not-alone": "transfer written otherwise than alone, with FC6",
    "written-while-valid": "payload or header written while transfer was not 0",
    "page-by-single-registers": "payload or header written with FC6",
    "value-split": "a 32-bit value or an x,y pair split over two requests",
    "commit-without-clearing": "a transfer value written over another one, without 0 between them",
    "transfer-not-new": "a transfer value that the attempt before had, or that ack_transfer holds",
    "transfer-reused": "the same transfer value with other content",
    "content-changed": "a page sent again with other content",
    "too-early": "a request before the reply to the one before, on the same connection",
    "went-on-after-lost-reply": "a write to the contour block, not transfer = 0, after one that was never answered",
    "unknown-trigger-acknowledged": "trigger_ack is a value that this session's trigger_counter never had",
    "second-service": "another owner writes the service block less than 3 s after the one before",
    "settled-went-down": "settled_job lower than before, or above job_id, with the same owner",
    "job-went-down": "a job_id lower than one sent before, or 0",
    "job-in-two-sessions": "a job sent in more than one session",
    "contour-before-acknowledgement": "a contour for a trigger that was not acknowledged",
    "contradictory-page": "counts, ring table, bounding box, area or flags contradict the points",
    "withdrawal-not-empty": "a withdrawal that holds more than job_id and session",
}


@dataclass(frozen=True)
class Violation:
    """One violation: when (UTC), what was seen, and the registers of the request, where it is about one."""

    at: datetime
    text: str
    address: int | None = None
    values: tuple[int, ...] = ()

    def as_json(self) -> dict[str, object]:
        """As in the verdict's file."""
        at = self.at.isoformat(timespec="milliseconds")
        if self.address is None:
            return {"at": at, "text": self.text}
        return {"at": at, "text": self.text, "registers": {"address": self.address, "values": list(self.values)}}


def _utc() -> datetime:
    return datetime.now(UTC)


@dataclass
class Verdict:
    """Violations by kind (the keys of KINDS), answers given, and the longest pause between two heartbeats.

    A lost or late reply is no violation; what a client does about it may be. faults: what was done to the client.
    on_event: gets each thing of note as it happens; see `tell`.
    """

    counts: Counter[str] = field(default_factory=Counter)
    seen: dict[str, list[Violation]] = field(default_factory=dict)
    answers: Counter[int] = field(default_factory=Counter)
    accepted: int = 0
    requests: int = 0
    longest_heartbeat_gap_s: float = 0.0
    faults: Counter[str] = field(default_factory=Counter)
    now: Callable[[], datetime] = _utc
    on_event: Callable[[dict[str, object]], None] | None = None

    @property
    def clean(self) -> bool:
        """True while nothing against the protocol was seen."""
        return not self.counts

    @property
    def texts(self) -> dict[str, list[str]]:
        """What was seen, by kind; at most KEPT of each."""
        return {kind: [violation.text for violation in violations] for kind, violations in self.seen.items()}

    def note(self, kind: str, text: str, address: int | None = None, values: Sequence[int] = ()) -> None:
        """Add a violation; address and values: the registers of the request that it is about."""
        if kind not in KINDS:
            raise KeyError(kind)
        self.counts[kind] += 1
        kept = self.seen.setdefault(kind, [])
        if len(kept) < KEPT:
            kept.append(Violation(self.now(), text, address, tuple(values)))
        self.tell("violation", kind=kind, text=text)

    def tell(self, event: str, **values: object) -> None:
        """Hand on what happened: session, trigger, acknowledged, answer, fault or violation, with its numbers."""
        if self.on_event is not None:
            self.on_event({"at": self.now().isoformat(timespec="milliseconds"), "event": event, **values})

    def as_json(self) -> dict[str, object]:
        """The verdict's file: `clean`, violations with rule, count, times, texts and registers, answers, contours."""
        return {
            "clean": self.clean,
            "violations": [
                {
                    "kind": kind,
                    "rule": KINDS[kind],
                    "count": count,
                    "seen": [violation.as_json() for violation in self.seen[kind]],
                }
                for kind, count in sorted(self.counts.items())
            ],
            "answers": {str(answer): count for answer, count in sorted(self.answers.items())},
            "accepted": self.accepted,
            "requests": self.requests,
            "longest_heartbeat_gap_s": round(self.longest_heartbeat_gap_s, 3),
            "faults": dict(sorted(self.faults.items())),
        }

    def __str__(self) -> str:
        if self.clean:
            return f"nothing against the protocol, {self.accepted} contours accepted"
        return "; ".join(f"{kind} {count}x, first: {self.seen[kind][0].text}" for kind, count in self.counts.items())
