"""`combtrace pin`: make a person's line for `page.people_file`."""

from __future__ import annotations

import argparse
import getpass
import sys

from service.cli.errors import EXIT_OK, UserError

HELP = "make a person's line for page.people_file from a PIN"
DESCRIPTION = """\
Ask for a PIN of 4 to 12 digits, twice, or read it from standard input where that
is no terminal, and print the line that belongs into the file: the person's name
and a hash of the PIN, from which the PIN cannot be read. It asks no daemon.
Exit status: 0 done, 2 no PIN, or no name."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The name."""
    parser.add_argument("name", metavar="NAME", help="who: A-Z a-z 0-9 _ . @ -, as it will stand in the journal")


def run(args: argparse.Namespace) -> int:
    """Print the line."""
    from service.web.people.pins import line_of

    pin = _asked() if sys.stdin.isatty() else sys.stdin.readline().strip()
    try:
        print(line_of(args.name, pin))
    except ValueError as error:
        raise UserError(str(error)) from error
    return EXIT_OK


def _asked() -> str:
    pin = getpass.getpass("PIN: ")
    if getpass.getpass("Again: ") != pin:
        raise UserError("the two are not alike")
    return pin
