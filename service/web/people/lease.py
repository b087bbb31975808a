"""The word: one person at a time gives orders from the page, others see who, and can take over by saying why."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

HELD_S = 120.0  # from the last order on
LEAST_WORD = 3  # characters


@dataclass(frozen=True)
class Held:
    """Who has the word, since when and until when on the lease's clock."""

    who: str
    since_s: float
    until_s: float


class Lease:
    """Who has the word. Changed in the page's loop alone; may be looked at from any thread."""

    def __init__(self, *, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._held: Held | None = None

    def holder(self) -> Held | None:
        """Who has it now."""
        held = self._held
        return held if held is not None and self._now() < held.until_s else None

    def other_than(self, who: str) -> Held | None:
        """Who else has it."""
        held = self.holder()
        return held if held is not None and held.who != who else None

    def take(self, who: str) -> None:
        """They have it, from now on for a while; who had it already has it longer."""
        now_s, held = self._now(), self.holder()
        since_s = held.since_s if held is not None and held.who == who else now_s
        self._held = Held(who, since_s, now_s + HELD_S)

    def told(self) -> dict[str, object] | None:
        """Who has it and for how long yet, for all who look."""
        held, now_s = self.holder(), self._now()
        if held is None:
            return None
        return {"who": held.who, "since_s": round(now_s - held.since_s, 1), "left_s": round(held.until_s - now_s, 1)}
