"""`combtrace schema`: the JSON schema of config.yaml, or of a scenario of the simulated controller."""

from __future__ import annotations

import argparse
import json

from service.cli.errors import EXIT_OK

HELP = "print the JSON schema of the configuration"
DESCRIPTION = "Print the JSON schema of config.yaml, for editors that check while one types."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which schema."""
    parser.add_argument("--scenario", action="store_true", help="of a scenario for simulate-controller instead")


def run(args: argparse.Namespace) -> int:
    """Print the schema."""
    from service.commissioning.scenario_file import scenario_schema
    from service.config.config_file import config_schema

    print(json.dumps(scenario_schema() if args.scenario else config_schema(), indent=2))
    return EXIT_OK
