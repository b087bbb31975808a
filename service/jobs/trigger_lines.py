"""The text protocol of the serial trigger: what a line asks for, and what is answered.

A line is ASCII, ended by CR, LF or CRLF, 80 characters at most; capitals and small letters are the same.

    TRIG [recipe=N]   ACK <job> once the job is durable, later
                      DONE <job> <vertices> <area mm²> or FAIL <job> <code> <name>
                      WAIT <place> first, where others are before it and it may wait; then ACK or NAK
    STAT              a status line
    PING              PONG
    anything else     NAK <code> <name>

The codes of FAIL and NAK are the reject reasons, 100 to 190. None of them fits a line that is not understood: 120
(busy) and 121 (not ready) would have it sent again, 190 (internal error) would blame the service. It gets 400
bad_request, which lies apart from them all. A recipe that no number can be is answered as any other one that does not
exist, with 122 unknown_recipe. `recipe=0` is the default, as it is in the registers.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

LONGEST = 80
LARGEST_RECIPE = 65_535
BAD_REQUEST = (400, "bad_request")
UNKNOWN_RECIPE = (122, "unknown_recipe")


@dataclass(frozen=True)
class TriggerRequest:
    """A job is asked for; recipe None = the configured default."""

    recipe: int | None = None


@dataclass(frozen=True)
class StatusRequest:
    """The status line is asked for."""


@dataclass(frozen=True)
class PingRequest:
    """A sign of life is asked for."""


@dataclass(frozen=True)
class Malformed:
    """A line that asks for nothing known: code and name of the NAK."""

    code: int
    name: str


SerialRequest = TriggerRequest | StatusRequest | PingRequest | Malformed


_WORDS: dict[bytes, SerialRequest] = {b"TRIG": TriggerRequest(), b"STAT": StatusRequest(), b"PING": PingRequest()}


def parse_line(line: bytes) -> SerialRequest | None:
    """What a line asks for; None for one that is empty or blank, which is not answered. Never raises."""
    words = line.upper().split()
    if len(line) > LONGEST:
        return Malformed(*BAD_REQUEST)
    match words:
        case []:
            return None
        case [word] if word in _WORDS:
            return _WORDS[word]
        case [b"TRIG", argument] if argument.startswith(b"RECIPE="):
            return _trigger(argument.removeprefix(b"RECIPE="))
    return Malformed(*BAD_REQUEST)


def _trigger(number: bytes) -> SerialRequest:
    if not re.fullmatch(rb"[0-9]+", number) or int(number) > LARGEST_RECIPE:
        return Malformed(*UNKNOWN_RECIPE)
    return TriggerRequest(int(number) or None)


def ack(job: int) -> str:
    """The job is durable in the journal."""
    return f"ACK {job}"


def wait(place: int) -> str:
    """The trigger waits for its turn, 1 = the next; ACK or NAK follows."""
    return f"WAIT {place}"


def done(job: int, vertices: int, area_mm2: float) -> str:
    """The job ended well; the area as a whole number of mm², as in the register `area`."""
    if not math.isfinite(area_mm2) or area_mm2 < 0:
        raise ValueError(f"area_mm2 is {area_mm2}, expected a finite number from 0 on")
    return f"DONE {job} {vertices} {area_mm2:.0f}"


def fail(job: int, code: int, name: str) -> str:
    """The job ended without a contour in the machine, and the reason."""
    return f"FAIL {job} {code} {name}"


def nak(code: int, name: str) -> str:
    """The line begins no job, and the reason."""
    return f"NAK {code} {name}"


def pong() -> str:
    """The sign of life."""
    return "PONG"
