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


def state_folder(args: argparse.Namespace) -> Path:
    """Where the daemon's socket is; raise UserError where the configuration is none."""
    from service.config.config_file import ConfigError, state_dir_of

    try:
        return Path(args.state_dir or state_dir_of(args.config))
    except ConfigError as error:
        raise UserError(f"{error}. Or name its state folder with --state-dir") from error


def asked(args: argparse.Namespace, **request: Any) -> dict[str, Any]:
    """The daemon's answer; raise UserError, 2 for a file that is none, 1 where it does not answer or refuses."""
    from service.daemon.control import ControlError, ask

    try:
        return ask(state_folder(args), request)
    except ControlError as error:
        raise UserError(str(error), EXIT_FAILED) from error


def commanded(args: argparse.Namespace, **request: Any) -> int:
    """Ask for a change and print the state that follows."""
    print(f"state {asked(args, **request)['state']}")
    return EXIT_OK
