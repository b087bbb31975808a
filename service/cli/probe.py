"""`combtrace probe`: what the controller on the other end can do, and what to change so that both sides meet."""

from __future__ import annotations

import argparse
import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError

if TYPE_CHECKING:
    from service.config import Config

HELP = "find out what the controller can do and how it numbers its registers"
DESCRIPTION = """\
For the one who connects the controller: look at its registers and say in plain
words what to change in the configuration. Round trip, readable registers, the
longest request, whether its program runs, the numbering of registers (from 0 or
from 1), the order of words.

Registers are only read, unless --write is given. Then the service block and,
under transfer = 0, the contour block are written too, and what stood there is put
back; nothing outside the configured blocks is written, nor anything while another
service is alive on this controller. Nothing moves by it: no contour is committed.

Exit status: 0 nothing to change, 1 something to change or no controller,
2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The configuration, and whether registers are written."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--write", action="store_true", help="also write, and put back what stood there")


def run(args: argparse.Namespace) -> int:
    """Probe, print, and tell by the exit status."""
    from service.config import NoController
    from service.config_file import ConfigError, load_config

    try:
        config = load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if isinstance(config.controller, NoController):
        raise UserError("controller.kind is none, so there is nothing to probe. Set a controller of kind modbus-…")
    return asyncio.run(_probe(config, write=args.write))


async def _probe(config: Config, *, write: bool) -> int:
    from drivers.controller import ControllerError
    from service.config import NoController
    from service.lock import LockError, Locks, NameLock
    from service.probing import Finding, Probe
    from service.wiring import controller_names, make_controller

    controller = make_controller(config)
    assert controller is not None
    assert not isinstance(config.controller, NoController)
    if write and config.controller.mode == "observe":
        raise UserError("controller.mode is observe: another process writes there. Probe without --write")
    locks = Locks()
    try:
        for name in controller_names(config) if write else ():
            locks.add(NameLock(name))
    except LockError as error:
        locks.release()
        raise UserError(f"nothing is written while a service runs here: {error}") from error
    probe = Probe(controller, config.controller.timeout_s)
    well = True
    try:
        async for finding in probe.findings(write=write):
            _print(finding)
            well = well and finding.well
    except ControllerError as error:
        _print(Finding("controller", False, str(error)))
        well = False
    finally:
        await controller.close()
        locks.release()
    _print_changes(probe.changes)
    if not write:
        print("Not written to. With --write: writable registers, the longest write, and the word order by test_echo.")
    return EXIT_OK if well else EXIT_FAILED


def _print(finding: object) -> None:
    from service.probing import Finding

    assert isinstance(finding, Finding)
    print(f"{'ok   ' if finding.well else 'FAULT'} {finding.part:<13} {finding.text}", flush=True)


def _print_changes(changes: dict[str, object]) -> None:
    if not changes:
        return
    print("\nChange under `controller:` in the configuration")
    for key, value in changes.items():
        print(f"  {key}: {value}")
