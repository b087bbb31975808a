"""`combtrace register-map`: every register of the mailbox at the configured addresses."""

from __future__ import annotations

import argparse
from pathlib import Path

from service.cli.errors import EXIT_OK, UserError

HELP = "print every register at the configured addresses"
DESCRIPTION = """\
Print the register map for a configuration, as Markdown: address, 4xxxxx number,
name, type and meaning of every register, for the one who programs the controller."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The configuration."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")


def run(args: argparse.Namespace) -> int:
    """Print the map."""
    from service.config.config_file import ConfigError, load_config
    from service.link.register_map import register_map
    from service.wiring.devices import mailbox_layout

    try:
        config = load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    layout = mailbox_layout(config)
    if layout is None:
        raise UserError("controller.kind is none, so there are no registers. Set a controller of kind modbus-…")
    print(register_map(layout), end="")
    return EXIT_OK
