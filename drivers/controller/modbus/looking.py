"""Whether to look for a reply again and again before going to sleep until it comes.

A program that sleeps must be woken: on another processor than the controller's that took 50 µs a request, more than all
the rest of it. One that looks again at once is there when the reply comes, but only where the controller runs on a
processor of its own and answers within that time; elsewhere it takes the processor from what it waits for. So each look
in vain makes the next ones rarer.
"""

from __future__ import annotations

LOOK_S = 0.0001  # longest; a controller on another processor answered after 40 µs
RAREST = 1024  # waits from one look in vain to the next


class Looking:
    """What is known of one connection: whether looking was worth it lately."""

    def __init__(self) -> None:
        self._left = 0  # waits without a look
        self._pause = 1  # of them after the next look in vain, halved

    def worth(self) -> bool:
        """True where this wait may begin with a look of `LOOK_S` at most; each call counts as a wait."""
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
