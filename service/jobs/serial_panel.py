"""What a panel does at the daemon's serial line: it asks for a job and hears the end, also across the daemon's restart.

The daemon tells the end of a job that it acknowledged as soon as it is settled, if need be after its own restart. So a
panel goes on listening while the daemon is away, and asks for a sign of life now and then to know how long that is.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from drivers.trigger import LineTrigger

ANSWER_WITHIN_S = 10.0  # a trigger that is not acknowledged by then was not heard, or its job is not known to us
PING_EVERY_S = 5.0
GONE_AFTER_S = 60.0  # a daemon that is started again is back within


class NoEnd(Exception):
    """No end of the job was heard: what was seen, what to do."""


def ask(
    port: LineTrigger,
    recipe: int | None,
    timeout_s: float,
    tell: Callable[[str], None],
    now: Callable[[], float] = time.monotonic,
) -> str:
    """The line that ended our trigger, `DONE`, `FAIL` or `NAK`; raise NoEnd, TriggerUnavailable.

    tell: is told each line as it comes, but the signs of life. What is said of jobs that were never acknowledged to us
    is told and ends nothing: a daemon that comes back tells others' ends too.
    """
    port.write_line("TRIG" if recipe is None else f"TRIG recipe={recipe}")
    asked_at_s = heard_at_s = now()
    job, answered = "", False
    while True:
        asked_s, silent_s = now() - asked_at_s, now() - heard_at_s
        answer_in_s = timeout_s if answered else ANSWER_WITHIN_S - asked_s
        left_s = min(timeout_s - asked_s, GONE_AFTER_S - silent_s, answer_in_s)
        if left_s <= 0:
            raise NoEnd(_why(answered, silent_s, job, timeout_s))
        line = port.read_line(min(PING_EVERY_S, left_s))
        if line is None:
            port.write_line("PING")
            continue
        text = line.decode("ascii", "replace").strip()
        if not text:
            continue
        heard_at_s = now()
        if text == "PONG":
            continue
        tell(text)
        word, _, rest = text.partition(" ")
        if word == "NAK" and not job:
            return text
        if word == "WAIT":
            answered = True
        elif word == "ACK" and not job:
            job, answered = rest.strip(), True
        elif word in ("DONE", "FAIL") and job and rest.split()[:1] == [job]:
            return text


def _why(answered: bool, silent_s: float, job: str, timeout_s: float) -> str:
    look = f"`combtrace jobs show {job}` tells how it ended" if job else "`combtrace jobs` lists what was taken"
    if not answered:
        bound_s = min(ANSWER_WITHIN_S, timeout_s)
        return f"no ACK within {bound_s:g} s. Check that the daemon runs and serves this line; {look}"
    what = f"job {job}" if job else "the trigger that waits"
    if silent_s >= GONE_AFTER_S:
        return f"{what}: the daemon has been silent for {GONE_AFTER_S:g} s. Start it again; {look}"
    return f"{what} has not ended within {timeout_s:g} s; {look}"
