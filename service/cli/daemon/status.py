"""`combtrace status`: how the running daemon is."""

from __future__ import annotations

import argparse
import json

from service.cli.daemon.status_page import WELL, page
from service.cli.daemon.status_watch import watch
from service.cli.errors import EXIT_FAILED, EXIT_OK
from service.cli.options.control import add_daemon_argument, asked

HELP = "tell how the running daemon is"
DESCRIPTION = """\
State, job, triggers, faults, and what was started again.
Exit status: 0 ready or executing a job, 1 in any other state or no daemon, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, form."""
    add_daemon_argument(parser)
    parser.add_argument("--json", action="store_true", help="all of it, as one JSON object")
    parser.add_argument(
        "--watch", action="store_true", help="go on until Ctrl-C: drawn anew on a terminal, else a line a change"
    )


def run(args: argparse.Namespace) -> int:
    """Print the status, or follow it."""
    if args.watch:
        return watch(args)
    status = asked(args, command="status")
    if args.json:
        print(json.dumps(status, ensure_ascii=False))
    else:
        print(page(status))
    return EXIT_OK if status["state"] in WELL else EXIT_FAILED
