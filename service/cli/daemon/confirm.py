"""`combtrace confirm`: a person's word for what the running daemon must not decide alone."""

from __future__ import annotations

import argparse

from service.cli.errors import EXIT_OK
from service.cli.options.control import add_daemon_argument, asked

HELP = "tell the running daemon that a person has looked at the controller"
DESCRIPTION = """\
Where the daemon waits in Error for a person's word, this is it:
- another service wrote to the controller, and one of the two was stopped: the
  controller is watched anew, and written to if no other service is seen;
- the controller's last_job is far above all job numbers known, and it is right:
  jobs are numbered above it.
Exit status: 0 confirmed, 1 no daemon, no right or nothing to confirm, 2 bad
configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration."""
    add_daemon_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Confirm, and print what."""
    for text in asked(args, command="confirm")["confirmed"]:
        print(text)
    return EXIT_OK
