"""Whether the next reply is worth holding the event loop for, and whether to look for it before going to sleep.

To be told of a reply, a task waits for two turns of the event loop, and on an idle machine for two processors that have
fallen asleep meanwhile: 90 µs a request were measured on loopback, where a wait in place takes 10. So a controller that
was prompt is waited for in place. One that is not, or that lives in this very loop, costs a vain wait now and then:
each makes the next one half as likely.

A program that sleeps must be woken: on another processor than the controller's that took 50 µs a request, more than all
the rest of it. One that spins, looking again at once, is there when the reply comes, but only where the controller runs
on a processor of its own and answers within that time; elsewhere it takes the processor from what it waits for. So each
look in vain makes the next ones rarer.
"""

from __future__ import annotations

PROMPT_S = 0.001
WAIT_S = 0.005  # longest single wait; one below the kernel's tick of 4 ms would set its timer anew each time: 6 µs
HOLD_S = 0.010  # longest that the event loop is held, all waits between two of its turns together
MOST_NEEDED = 1024
SPIN_S = 0.0001  # longest look; a controller on another processor answered after 40 µs
RAREST = 1024  # waits from one look in vain to the next


class InPlaceWaiting:
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


class Spinning:
    """What is known of one connection: whether looking again and again was worth it lately."""

    def __init__(self) -> None:
        self._left = 0  # waits without a look
        self._pause = 1  # of them after the next look in vain, halved

    def worth(self) -> bool:
        """True where this wait may begin with a look of `SPIN_S` at most; each call counts as a wait."""
        if self._left:
            self._left -= 1
            return False
        return True

    def ended(self, came: bool) -> None:
        """A look has ended, with or without a reply."""
        if came:
            self._pause = max(self._pause // 2, 1)
            return
        self._pause = min(2 * self._pause, RAREST)
        self._left = self._pause
