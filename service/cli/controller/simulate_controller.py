"""`combtrace simulate-controller`: a cutting machine's controller to test against, on a real socket or serial line."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from service.atomic_file import write_whole
from service.cli.errors import EXIT_OK, UserError

if TYPE_CHECKING:
    from drivers.controller.mailbox.layout import MailboxLayout
    from drivers.controller.mailbox.words import WordOrder
    from drivers.controller.simulated.contour import AcceptedContour
    from drivers.controller.simulated.controller import SimulatedController
    from drivers.controller.simulated.scenario import Scenario

HELP = "play the cutting machine's controller"
DESCRIPTION = """\
Serve the contour mailbox as a controller does, and check the client against the
protocol meanwhile. Ends on SIGTERM or SIGINT. The verdict is written at the start,
every two seconds and at the end. docs/reference/simulated-controller.md explains scenarios.

The addresses are those of the default layout; --layout gives others."""

VERDICT_PERIOD_S = 2.0
RANGES = {
    "device_id": (0, 255),
    "scan_ms": (0.1, 10_000),
    "trigger_every": (0.01, 86_400),
    "recipe": (0, 65_535),
    "baudrate": (300, 4_000_000),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where it listens, what it writes, how it behaves."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--tcp", metavar="HOST:PORT", help="listen there; port 0 takes a free one and prints it")
    where.add_argument("--rtu-over-tcp", metavar="HOST:PORT", help="the same with RTU frames, as a serial server")
    where.add_argument("--rtu", metavar="PORT", help="serve on this serial port, 8N1")
    parser.add_argument("--baudrate", type=int, default=115200, metavar="BAUD", help="of --rtu; default 115200")
    parser.add_argument("--log", type=Path, metavar="FILE", help="append accepted contours as JSON Lines")
    parser.add_argument("--verdict", type=Path, metavar="FILE", help="write what the client did against the protocol")
    parser.add_argument("--events", type=Path, metavar="FILE", help="append what happens, as it happens, as JSON Lines")
    parser.add_argument("--scenario", type=Path, metavar="FILE", help="what the machine does and what befalls the line")
    parser.add_argument("--memory", type=Path, metavar="FILE", help="retained memory that outlives a restart")
    parser.add_argument("--device-id", type=int, default=1, metavar="N", help="Modbus device id; default 1")
    parser.add_argument("--scan-ms", type=float, metavar="MS", help="period of the program; default 10")
    parser.add_argument("--word-order", choices=("big", "little"), default="big", help="default big (ABCD)")
    parser.add_argument(
        "--layout",
        metavar="LINK,SERVICE,CONTOUR,CAPACITY[,PART,CAPACITY]",
        default="0,16,32,1984",
        help="addresses of the blocks and registers of payload; default 0,16,32,1984, without a part block",
    )
    parser.add_argument("--trigger-every", type=float, metavar="S", help="request a measurement every S seconds")
    parser.add_argument("--recipe", type=int, default=0, metavar="N", help="recipe of those requests; default 0")
    parser.add_argument("--refuse", action="store_true", help="refuse every contour, as an operator would (answer 7)")


def run(args: argparse.Namespace) -> int:
    """Serve until stopped."""
    _check_ranges(args)
    return asyncio.run(_serve(args))


def _check_ranges(args: argparse.Namespace) -> None:
    for name, (low, high) in RANGES.items():
        value = getattr(args, name)
        if value is not None and not low <= value <= high:
            raise UserError(f"--{name.replace('_', '-')} {value:g}: expected {low:g} to {high:g}")


async def _serve(args: argparse.Namespace) -> int:
    from drivers.controller import ControllerError

    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    scenario = _scenario(args)
    with ExitStack() as files:
        log, events = (_open_log(files, option, getattr(args, option)) for option in ("log", "events"))
        try:
            controller = _build(args, scenario, log)
            if events is not None:
                controller.verdict.on_event = lambda event: _write_line(events, event)
            if args.verdict is not None:
                _write_verdict(args.verdict, controller)  # now, so that a path that cannot be written is known now
            await controller.start()
            print(f"simulated controller on {_where(args, controller)}", flush=True)
            try:
                await _until_stopped(controller, scenario, stop, args)
            finally:
                await controller.stop()
                if args.verdict is not None:
                    _write_verdict(args.verdict, controller)
        except ControllerError as error:
            raise UserError(str(error)) from error
    print(controller.verdict, flush=True)
    return EXIT_OK


def _scenario(args: argparse.Namespace) -> Scenario:
    from drivers.controller.simulated.scenario import Scenario
    from service.commissioning.scenario_file import load_scenario
    from service.config.config_file import ConfigError

    if args.scenario is None:
        return Scenario()
    try:
        return load_scenario(args.scenario)
    except ConfigError as error:
        raise UserError(str(error)) from error


def _build(args: argparse.Namespace, scenario: Scenario, log: TextIO | None) -> SimulatedController:
    from drivers.controller.simulated.controller import SimulatedController
    from drivers.controller.simulated.scenario import machine_options

    logged = _last_logged(args.log)

    def accepted(contour: AcceptedContour) -> None:
        if contour.job_id == logged:  # killed between this log and the memory's mark: it is handed on once more
            return
        points = sum(len(ring) for ring in contour.rings)
        print(f"job {contour.job_id} accepted: {points} vertices, {contour.area_mm2} mm²", flush=True)
        if log is not None:
            _write_line(log, contour.as_json())
            os.fsync(log.fileno())

    options: dict[str, Any] = {
        **machine_options(scenario),
        "layout": _layout(args.layout, args.word_order),
        "device_id": args.device_id,
        "memory_path": args.memory,
        "on_accepted": accepted,
    }
    if args.scan_ms is not None:
        options["scan_s"] = args.scan_ms / 1000
    if args.rtu is not None:
        controller = SimulatedController.on_serial(args.rtu, args.baudrate, **options)
    elif args.tcp is not None:
        controller = SimulatedController(*_address("--tcp", args.tcp), **options)
    else:
        controller = SimulatedController(*_address("--rtu-over-tcp", args.rtu_over_tcp), framing="rtu", **options)
    if args.refuse:
        controller.judge = lambda _contour: 7
    return controller


def _where(args: argparse.Namespace, controller: SimulatedController) -> str:
    address: str | None = args.tcp or args.rtu_over_tcp
    return f"{address.rpartition(':')[0]}:{controller.port}" if address else str(args.rtu)


async def _until_stopped(
    controller: SimulatedController, scenario: Scenario, stop: asyncio.Event, args: argparse.Namespace
) -> None:
    from drivers.controller.simulated.scenario import Play

    waiting = [asyncio.ensure_future(stop.wait()), asyncio.ensure_future(controller.wait())]
    if scenario.events:
        waiting.append(asyncio.ensure_future(Play(controller, scenario).play_for_ever()))
    if args.trigger_every:
        waiting.append(asyncio.ensure_future(_trigger(controller, args.trigger_every, args.recipe)))
    if args.verdict is not None:
        waiting.append(asyncio.ensure_future(_keep_verdict(args.verdict, controller)))
    try:
        done, _ = await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in waiting:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


async def _keep_verdict(path: Path, controller: SimulatedController) -> None:
    """Write the verdict now and then, so that a killed process leaves one."""
    while True:
        await asyncio.sleep(VERDICT_PERIOD_S)
        _write_verdict(path, controller)


async def _trigger(controller: SimulatedController, period_s: float, recipe: int) -> None:
    while True:
        await asyncio.sleep(period_s)
        if controller.can_request:
            print(f"trigger {controller.request_measurement(recipe)}", flush=True)


def _write_line(file: TextIO, line: dict[str, object]) -> None:
    file.write(json.dumps(line) + "\n")
    file.flush()


def _open_log(files: ExitStack, option: str, path: Path | None) -> TextIO | None:
    if path is None:
        return None
    try:
        return files.enter_context(path.open("a", encoding="utf-8"))
    except OSError as error:
        raise UserError(f"--{option} {path}: cannot be written: {error.strerror}. Name another file") from error


def _last_logged(path: Path | None) -> int | None:
    """The job of the log's last whole line."""
    if path is None or not path.exists():
        return None
    whole = [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
    try:
        return int(json.loads(whole[-1])["job_id"]) if whole else None
    except (ValueError, KeyError, TypeError):
        return None


def _write_verdict(path: Path, controller: SimulatedController) -> None:
    """Replace the verdict's file as a whole: who reads it never sees half of one."""
    try:
        write_whole(path, (json.dumps(controller.verdict.as_json(), indent=2) + "\n").encode())
    except OSError as error:
        raise UserError(f"--verdict {path}: cannot be written: {error.strerror}. Name another file") from error


def _address(option: str, text: str) -> tuple[str, int]:
    host, colon, port = text.rpartition(":")
    if not colon or not host or not port.isdigit() or int(port) > 65535:
        raise UserError(f"{option} {text}: expected HOST:PORT, for example 127.0.0.1:5020")
    return host.strip("[]"), int(port)


def _layout(text: str, word_order: WordOrder) -> MailboxLayout:
    from drivers.controller.mailbox.layout import MailboxLayout

    fields = text.split(",")
    if len(fields) not in (4, 6) or not all(field.strip().isdigit() for field in fields):
        raise UserError(f"--layout {text}: expected four numbers, or six, for example 0,16,32,1984,2048,2000")
    link, service, contour, capacity, *part = (int(field) for field in fields)
    address, room = part or (None, 0)
    return MailboxLayout(link, service, contour, capacity, word_order, address, room)
