"""What the commands to a running daemon have in common: which daemon, and how it is asked."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError


def add_daemon_argument(parser: argparse.ArgumentParser) -> None:
    """Which daemon."""
    parser.add_argument(
        "--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="the daemon's; default config.yaml"
    )
    parser.add_argument(
        "--state-dir", type=Path, metavar="FOLDER", help="the daemon's service.state_dir; then --config is not read"
    )


def asked(args: argparse.Namespace, **request: Any) -> dict[str, Any]:
    """The daemon's answer; raise UserError, 2 for a file that is none, 1 where it does not answer or refuses."""
    from service.config_file import ConfigError, state_dir_of
    from service.control import ControlError, ask

    try:
        folder = args.state_dir or state_dir_of(args.config)
    except ConfigError as error:
        raise UserError(f"{error}. Or name its state folder with --state-dir") from error
    try:
        return ask(folder, request)
    except ControlError as error:
        raise UserError(str(error), EXIT_FAILED) from error


def commanded(args: argparse.Namespace, **request: Any) -> int:
    """Ask for a change and print the state that follows."""
    print(f"state {asked(args, **request)['state']}")
    return EXIT_OK
