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


def asked(args: argparse.Namespace, **request: Any) -> dict[str, Any]:
    """The daemon's answer; raise UserError, 2 for a bad configuration, 1 where it does not answer or refuses."""
    from service.config_file import ConfigError, load_config
    from service.control import ControlError, ask

    try:
        folder = load_config(args.config).service.state_dir
    except ConfigError as error:
        raise UserError(str(error)) from error
    try:
        return ask(folder, request)
    except ControlError as error:
        raise UserError(str(error), EXIT_FAILED) from error


def commanded(args: argparse.Namespace, **request: Any) -> int:
    """Ask for a change and print the state that follows."""
    print(f"state {asked(args, **request)['state']}")
    return EXIT_OK
