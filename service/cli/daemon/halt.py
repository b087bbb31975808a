"""`combtrace halt`: have the running daemon take no more triggers."""

from __future__ import annotations

import argparse

from service.cli.options.control import add_daemon_argument, commanded

HELP = "have the running daemon take no more triggers"
DESCRIPTION = """\
State Halted: no trigger is taken until `combtrace resume`, over restarts and
power cuts too. The running job comes to its own end; triggers that wait for
their turn are refused (161 aborted).
Exit status: 0 halted, 1 no daemon or no right, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, reason."""
    add_daemon_argument(parser)
    parser.add_argument("--reason", default="", metavar="TEXT", help="why, for whoever looks at the state")


def run(args: argparse.Namespace) -> int:
    """Halt."""
    from service.daemon.control import reason_text

    return commanded(args, command="halt", reason=reason_text(args.reason))
