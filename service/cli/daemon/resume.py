"""`combtrace resume`: end a halt of the running daemon."""

from __future__ import annotations

import argparse

from service.cli.options.control import add_daemon_argument, commanded

HELP = "end a halt of the running daemon"
DESCRIPTION = """\
Triggers are taken again as soon as all parts work.
Exit status: 0 resumed, 1 no daemon, no right or not halted, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration."""
    add_daemon_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Resume."""
    return commanded(args, command="resume")
