"""`combtrace check`: the one page of all checks, each with what is wrong and what to do."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from service.cli.colour import Colour, painted
from service.cli.errors import EXIT_FAILED, EXIT_OK, EXIT_UNUSABLE

if TYPE_CHECKING:
    from service.check_result import CheckResult

HELP = "say what is wrong with configuration, devices and machine"
DESCRIPTION = """\
Check everything there is to check: configuration, calibration, table, camera,
controller, serial ports, permissions, state folder, journal, archive, disks, clock.
Each line says ok, warn or FAULT, what was seen, and under it what to do.

Nothing is disturbed: devices that a running service has are told as in use, the
controller's registers are read and none is written, waiting files stay waiting.

Exit status, also for monitoring: 0 all well, warnings included; 1 a fault, or with
--strict a warning; 2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Configuration, devices, output."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--no-devices", action="store_true", help="check the files only, open no device")
    parser.add_argument("--strict", action="store_true", help="exit status 1 for warnings too")
    parser.add_argument("--json", metavar="FILE", help="the same as a JSON object; - is standard output")


def run(args: argparse.Namespace) -> int:
    """Check, print, and tell by the exit status."""
    from service.check_result import Level
    from service.cli.text_output import text_output

    with text_output(args.json) as write:
        text = sys.stderr if args.json == "-" else sys.stdout
        found = []
        unusable = False
        for result in _results(args):
            _print(result, text)
            found.append(result)
            unusable = unusable or (result.part == "config" and result.level is Level.FAULT)
        worst = max(result.level for result in found)
        write(json.dumps(_document(args.config, found, worst), ensure_ascii=False, indent=1) + "\n")
    if unusable:
        return EXIT_UNUSABLE
    return EXIT_FAILED if worst is Level.FAULT or (args.strict and worst is Level.WARNING) else EXIT_OK


def _results(args: argparse.Namespace) -> Iterator[CheckResult]:
    """All that can be checked, part by part; after a bad configuration nothing more."""
    from service.check_result import fault, ok, warning
    from service.config.config_file import ConfigError, load_config

    try:
        config = load_config(args.config)
    except ConfigError as error:
        for line in str(error).splitlines():
            yield fault("config", line)
        return
    from service.commissioning.checkup.devices import check_devices
    from service.commissioning.checkup.files import check_files, summary
    from service.commissioning.checkup.listening import check_listening
    from service.commissioning.checkup.running import hidden, running_service
    from service.commissioning.checkup.storage import check_storage

    yield ok("config", f"{args.config}: {summary(config)}")
    running, unseen = running_service(config), hidden(config)
    if unseen:
        text = f"{config.service.state_dir}: may not be entered, so whether the service runs is not known"
        yield warning("service", f"{text}; no device is opened", "Run this as the service's user or one of its group")
    else:
        yield ok("service", "does not run" if running is None else f"runs as process {running}")
    yield from check_files(config)
    yield from check_listening(config, running)
    if not args.no_devices and not unseen:
        yield from check_devices(config, running)
    yield from check_storage(config, running=running is not None)


def _print(result: CheckResult, to: TextIO) -> None:
    colour = (Colour.GOOD, Colour.DOUBTFUL, Colour.BAD)[result.level]
    print(f"{painted(f'{result.level.label:<5}', colour, to)} {result.part:<12} {result.text}", file=to)
    if result.next_step:
        print(f"{'':<18} -> {result.next_step}", file=to)
    to.flush()


def _document(config: Path, found: list[CheckResult], worst: int) -> dict[str, object]:
    """What `--json` gives."""
    names = ("ok", "warning", "fault")
    return {
        "status": names[worst],
        "config": str(config),
        "findings": [
            {"part": one.part, "level": names[one.level], "text": one.text, "next_step": one.next_step or None}
            for one in found
        ],
    }
