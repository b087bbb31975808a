"""`combtrace schema`: the JSON schema of config.yaml."""

from __future__ import annotations

import argparse
import json

from service.cli.errors import EXIT_OK

HELP = "print the JSON schema of the configuration"
DESCRIPTION = "Print the JSON schema of config.yaml, for editors that check while one types."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """No arguments."""


def run(_args: argparse.Namespace) -> int:
    """Print the schema."""
    from service.config_file import config_schema

    print(json.dumps(config_schema(), indent=2))
    return EXIT_OK
