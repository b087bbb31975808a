"""Colour for words that a person looks for first: on a terminal only, and not where NO_COLOR is set."""

from __future__ import annotations

import os
import sys
from enum import Enum
from typing import TextIO


class Colour(Enum):
    """By what it says, as the terminal's code."""

    GOOD = "32"
    DOUBTFUL = "33"
    BAD = "31"


def painted(text: str, colour: Colour, stream: TextIO | None = None) -> str:
    """The text in its colour where `stream`, standard output unless named, is a terminal that may show it."""
    return f"\x1b[{colour.value}m{text}\x1b[0m" if obeys_codes(stream) and not os.environ.get("NO_COLOR") else text


def obeys_codes(stream: TextIO | None = None) -> bool:
    """True for a terminal that takes codes for colour and place."""
    return (stream or sys.stdout).isatty() and os.environ.get("TERM", "dumb") != "dumb"
