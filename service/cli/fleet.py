"""`combtrace fleet serve`: one page over all cells of a plant."""

from __future__ import annotations

import argparse
from contextlib import suppress
from pathlib import Path

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError

HELP = "serve one read-only page over all cells of a plant"
DESCRIPTION = """\
Listen to a plant's broker, to which cells with `telemetry` tell what they do, and serve a
page and a REST interface over all of them until stopped: who is ready, who is not and why,
how figures drift, whose calibration, recipes or version differ. Nothing is ordered there.
Exit status: 0 stopped, 1 it cannot be served, 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What to do, by which configuration."""
    parser.add_argument("action", choices=("serve",), help="serve the page until stopped")
    parser.add_argument("--config", type=Path, default=Path("fleet.yaml"), metavar="FILE", help="default fleet.yaml")


def run(args: argparse.Namespace) -> int:
    """Serve."""
    import logging

    from service.config.config_file import ConfigError
    from service.logs import start_logging

    try:
        from service.fleet.server import FleetError, serve
        from service.fleet.settings import load_fleet
    except ModuleNotFoundError as error:
        raise UserError(f"{error.name} is not installed. Install combtrace[mqtt,page]") from error
    try:
        settings = load_fleet(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    start_logging(logging.INFO)
    try:
        with suppress(KeyboardInterrupt):
            serve(settings)
    except FleetError as error:
        raise UserError(str(error), EXIT_FAILED) from error
    return EXIT_OK
