"""`combtrace reset`: have the running daemon start all its parts anew."""

from __future__ import annotations

import argparse

from service.cli.options.control import add_daemon_argument, commanded

HELP = "have the running daemon open camera, ports and connection anew"
DESCRIPTION = """\
Preoperational, then as at the start: camera, serial ports and the connection to
the controller are opened anew, and what waits for its next attempt is tried at
once. Refused while a job is executed. A halt stays.
Exit status: 0 done, 1 no daemon, no right or a job is executed, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration."""
    add_daemon_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Reset."""
    return commanded(args, command="reset")
