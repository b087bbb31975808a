"""`combtrace reasons [REASON…]`: what a reject reason means and what to do next."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_OK, UserError

if TYPE_CHECKING:
    from service.reasons import Reason

HELP = "tell what a reject reason means"
DESCRIPTION = """\
Print reject reasons: code, name and outcome, what it means, and what to do next.
Without REASON, all of them.

Exit status: 0 printed, 2 there is no such reason."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which reasons, and in what language."""
    parser.add_argument("reasons", nargs="*", metavar="REASON", help="code or name, such as 111 or touches_border")
    parser.add_argument("--language", choices=("en", "ru"), default="en", help="language of the texts (default: en)")


def run(args: argparse.Namespace) -> int:
    """Print the chosen reasons."""
    from service.reasons import Language, Reason

    language = Language(args.language)
    for reason in [_reason(word) for word in args.reasons] or list(Reason):
        told = reason.explained(language)
        print(f"{int(reason)} {reason.label} ({reason.outcome})\n    {told.sentence}\n    {told.next_action}")
    return EXIT_OK


def _reason(word: str) -> Reason:
    from service.reasons import Reason

    found = next((reason for reason in Reason if word in (str(int(reason)), reason.label)), None)
    if found is None:
        raise UserError(f"{word}: there is no such reason. `combtrace reasons` lists all codes and names")
    return found
