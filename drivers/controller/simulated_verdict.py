"""What a client did against the protocol, as the simulated controller saw it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

KEPT_TEXTS = 20  # of one kind; counts go on

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
    "job-went-down": "a job_id lower than one sent before, or 0",
    "job-in-two-sessions": "a job sent in more than one session",
    "contour-before-acknowledgement": "a contour for a trigger that was not acknowledged",
    "contradictory-page": "counts, ring table, bounding box, area or flags contradict the points",
    "withdrawal-not-empty": "a withdrawal that holds more than job_id and session",
}


@dataclass
class Verdict:
    """Violations by kind (the keys of KINDS), answers given, and the longest pause between two heartbeats.

    A lost or late reply is no violation; what a client does about it may be.
    """

    counts: Counter[str] = field(default_factory=Counter)
    texts: dict[str, list[str]] = field(default_factory=dict)
    answers: Counter[int] = field(default_factory=Counter)
    accepted: int = 0
    longest_heartbeat_gap_s: float = 0.0

    @property
    def clean(self) -> bool:
        """True while nothing against the protocol was seen."""
        return not self.counts

    def note(self, kind: str, text: str) -> None:
        """Add a violation."""
        if kind not in KINDS:
            raise KeyError(kind)
        self.counts[kind] += 1
        kept = self.texts.setdefault(kind, [])
        if len(kept) < KEPT_TEXTS:
            kept.append(text)

    def as_json(self) -> dict[str, object]:
        """The verdict's file: `clean`, violations with rule, count and texts, answers, accepted contours."""
        return {
            "clean": self.clean,
            "violations": [
                {"kind": kind, "rule": KINDS[kind], "count": count, "texts": self.texts[kind]}
                for kind, count in sorted(self.counts.items())
            ],
            "answers": {str(answer): count for answer, count in sorted(self.answers.items())},
            "accepted": self.accepted,
            "longest_heartbeat_gap_s": round(self.longest_heartbeat_gap_s, 3),
        }

    def __str__(self) -> str:
        if self.clean:
            return f"nothing against the protocol, {self.accepted} contours accepted"
        return "; ".join(f"{kind} {count}x, first: {self.texts[kind][0]}" for kind, count in self.counts.items())
