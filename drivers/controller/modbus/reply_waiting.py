"""Whether the next reply is worth holding the event loop for.

To be told of a reply, a task waits for two turns of the event loop, and on an idle machine for two processors that have
fallen asleep meanwhile: 90 µs a request were measured on loopback, where a wait in place takes 10. So a controller that
was prompt is waited for in place. One that is not, or that lives in this very loop, costs a vain wait now and then:
each makes the next one half as likely.
"""

from __future__ import annotations

PROMPT_S = 0.001
WAIT_S = 0.005  # longest single wait; one below the kernel's tick of 4 ms would set its timer anew each time: 6 µs
HOLD_S = 0.010  # longest that the event loop is held, all waits between two of its turns together
MOST_NEEDED = 1024


class Promptness:
    """What is known of one connection's replies. Times in seconds."""

    def __init__(self) -> None:
        self._in_a_row = 0  # prompt replies
        self._needed = 1  # of them, before a wait in place
        self._held_s = 0.0
        self._held_until_s = 0.0

    def worth(self, now_s: float) -> bool:
        """True where the next reply may be waited for in place, `WAIT_S` at most."""
        if now_s - self._held_until_s > HOLD_S:  # the loop has turned since
            self._held_s = 0.0
        return self._in_a_row >= self._needed and self._held_s + WAIT_S <= HOLD_S

    def came_by_loop(self, took_s: float) -> None:
        """A reply came through the event loop, so that it has turned."""
        self._held_s = 0.0
        self._in_a_row = self._in_a_row + 1 if took_s < PROMPT_S else 0

    def waited(self, took_s: float, now_s: float, came: bool) -> None:
        """A wait in place has ended, with or without a reply."""
        self._held_s += took_s
        self._held_until_s = now_s
        if not came:
            self._needed = min(2 * self._needed, MOST_NEEDED)
        elif self._needed > 1:
            self._needed //= 2
        if not came or took_s > PROMPT_S:
            self._in_a_row = 0
