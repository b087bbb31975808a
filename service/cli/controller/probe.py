"""`combtrace probe`: what the controller on the other end can do, and what to change so that both sides meet."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_FAILED, EXIT_OK, UserError

if TYPE_CHECKING:
    from drivers.controller.modbus.client import ModbusController
    from service.check_result import CheckResult
    from service.config.config import Config

HELP = "find out what the controller can do and how it numbers its registers"
DESCRIPTION = """\
For the one who connects the controller: look at its registers and say in plain
words what to change in the configuration, as a section to paste. Round trip,
readable registers, the longest request, the device id that it answers as, whether
its program runs, where its registers are numbered otherwise, the order of words.

Registers are only read, unless --write is given. Then the service block and,
under transfer = 0, the contour block are written too, which also shows whether
32-bit values are ever half written; what stood there is put back. Nothing outside
the configured blocks is written, nor anything while another service is alive on
this controller. Nothing moves by it: no contour is committed.

With --restart it waits for you to restart the controller's program, and tells
whether `session` changes by it. With --apply the changed keys are put into the
configuration's file; its comments and all else in it stay.

Exit status: 0 nothing to change, 1 something to change or no controller,
2 bad configuration."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The configuration, and whether registers are written."""
    parser.add_argument("--config", type=Path, default=Path("config.yaml"), metavar="FILE", help="default config.yaml")
    parser.add_argument("--write", action="store_true", help="also write, and put back what stood there")
    parser.add_argument("--restart", action="store_true", help="also watch a restart of the controller's program")
    parser.add_argument("--apply", action="store_true", help="put what is to be changed into the configuration's file")


def run(args: argparse.Namespace) -> int:
    """Probe, print, and tell by the exit status."""
    from service.config.config_file import ConfigError, load_config
    from service.config.controllers import NoController

    try:
        config = load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if isinstance(config.controller, NoController):
        raise UserError("controller.kind is none, so there is nothing to probe. Set a controller of kind modbus-…")
    return asyncio.run(_probe(config, args))


async def _probe(config: Config, args: argparse.Namespace) -> int:
    from drivers.controller import ControllerError
    from service.check_result import fault
    from service.config.controllers import NoController
    from service.daemon.lock import LockError, Locks, NameLock
    from service.probing.probe import Probe
    from service.wiring.devices import controller_names, make_controller

    controller = make_controller(config)
    assert controller is not None
    assert not isinstance(config.controller, NoController)
    write: bool = args.write
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
        async for result in probe.results(write=write):
            _print(result)
            well = well and result.well
        if args.restart:
            well = await _restarted(controller) and well
    except ControllerError as error:
        _print(fault("controller", str(error)))
        well = False
    finally:
        await controller.close()
        locks.release()
    if probe.changes:
        _print_section(config, probe.changes)
        if args.apply:
            _apply(args.config, probe.changes)
    if not write:
        print("Not written to. With --write: writable registers, the longest write, and the word order by test_echo.")
    return EXIT_OK if well else EXIT_FAILED


def _print(result: CheckResult) -> None:
    print(f"{result.level.label:<5} {result.part:<13} {result.text}", flush=True)


async def _restarted(controller: ModbusController) -> bool:
    from service.check_result import fault, ok
    from service.daemon.restart_watch import RESTART_WAIT_S, RestartWatch

    watch = RestartWatch(controller)
    session = await watch.begin()
    print(f"Session {session}. Restart the controller's program now, within {RESTART_WAIT_S:g} s", flush=True)
    well, text = await watch.end()
    _print((ok if well else fault)("session", text))
    return well


def _print_section(config: Config, changes: Mapping[str, Any]) -> None:
    """The section as it should be, to paste; what is changed has its old value beside it."""
    import yaml

    section: dict[str, Any] = config.controller.model_dump(mode="json", exclude_unset=True)
    print("\nThe configuration's section as it should be (--apply changes it in the file)\ncontroller:")
    for line in yaml.safe_dump({**section, **changes}, sort_keys=False).splitlines():
        key = line.partition(":")[0]
        print(f"  {line}" + (f"  # was {getattr(config.controller, key)}" if key in changes else ""))


def _apply(path: Path, changes: Mapping[str, Any]) -> None:
    from service.atomic_file import write_whole
    from service.config.keys import KeysNotSet, with_keys

    try:
        write_whole(path, with_keys(path.read_text(encoding="utf-8"), "controller", changes).encode())
    except (KeysNotSet, OSError) as error:
        raise UserError(f"{path}: not changed: {error}", EXIT_FAILED) from error
    print(f"{path}: {', '.join(changes)} changed. Probe again")
