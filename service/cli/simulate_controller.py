"""`combtrace simulate-controller`: a cutting machine's controller to test against, on a real socket or serial line."""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from service.cli.errors import EXIT_OK, UserError

if TYPE_CHECKING:
    from drivers.controller.simulated import AcceptedContour, SimulatedController

HELP = "play the cutting machine's controller"
DESCRIPTION = """\
Serve the contour mailbox as a controller does, and check the client against the
protocol meanwhile. Ends on SIGTERM or SIGINT; then the verdict is written.

The addresses are those of the default layout; --layout gives others."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where it listens, what it writes, how it behaves."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--tcp", metavar="HOST:PORT", help="listen there; port 0 takes a free one and prints it")
    where.add_argument("--rtu", metavar="PORT", help="serve on this serial port, 8N1")
    parser.add_argument("--baudrate", type=int, default=115200, metavar="BAUD", help="of --rtu; default 115200")
    parser.add_argument("--log", type=Path, metavar="FILE", help="append accepted contours as JSON Lines")
    parser.add_argument("--verdict", type=Path, metavar="FILE", help="write what the client did against the protocol")
    parser.add_argument("--events", type=Path, metavar="FILE", help="append what happens, as it happens, as JSON Lines")
    parser.add_argument("--memory", type=Path, metavar="FILE", help="retained memory that outlives a restart")
    parser.add_argument("--scan-ms", type=float, default=10.0, metavar="MS", help="period of the program; default 10")
    parser.add_argument("--word-order", choices=("big", "little"), default="big", help="default big (ABCD)")
    parser.add_argument(
        "--layout",
        metavar="LINK,SERVICE,CONTOUR,CAPACITY",
        default="0,16,32,1984",
        help="addresses of the blocks and registers of payload; default 0,16,32,1984",
    )
    parser.add_argument("--trigger-every", type=float, metavar="S", help="request a measurement every S seconds")
    parser.add_argument("--recipe", type=int, default=0, metavar="N", help="recipe of those requests; default 0")
    parser.add_argument("--refuse", action="store_true", help="refuse every contour, as an operator would (answer 7)")


def run(args: argparse.Namespace) -> int:
    """Serve until stopped."""
    return asyncio.run(_serve(args))


async def _serve(args: argparse.Namespace) -> int:
    from drivers.controller import ControllerError

    stop = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    log, events = _open_log("--log", args.log), _open_log("--events", args.events)
    try:
        controller = _build(args, log)
        if events is not None:
            controller.verdict.on_event = lambda event: _write_line(events, event)
        await controller.start()
        where = f"{args.tcp.rpartition(':')[0]}:{controller.port}" if args.tcp else args.rtu
        print(f"simulated controller on {where}", flush=True)
        try:
            await _until_stopped(controller, stop, args)
        finally:
            await controller.stop()
    except ControllerError as error:
        raise UserError(str(error)) from error
    finally:
        for file in (log, events):
            if file is not None:
                file.close()
    if args.verdict is not None:
        _write_verdict(args.verdict, controller)
    print(controller.verdict, flush=True)
    return EXIT_OK


def _build(args: argparse.Namespace, log: TextIO | None) -> SimulatedController:
    from drivers.controller.mailbox import MailboxLayout
    from drivers.controller.simulated import SimulatedController

    logged = _last_logged(args.log)

    def accepted(contour: AcceptedContour) -> None:
        if contour.job_id == logged:  # killed between this log and the memory's mark: it is handed on once more
            return
        points = sum(len(ring) for ring in contour.rings)
        print(f"job {contour.job_id} accepted: {points} vertices, {contour.area_mm2} mm²", flush=True)
        if log is not None:
            _write_line(log, contour.as_json())
            os.fsync(log.fileno())

    options = {
        "layout": MailboxLayout(*_numbers(args.layout), word_order=args.word_order),
        "scan_s": args.scan_ms / 1000,
        "memory_path": args.memory,
        "on_accepted": accepted,
    }
    if args.tcp is not None:
        host, port = _address(args.tcp)
        controller = SimulatedController(host, port, **options)
    else:
        controller = SimulatedController.on_serial(args.rtu, args.baudrate, **options)
    if args.refuse:
        controller.judge = lambda _contour: 7
    return controller


async def _until_stopped(controller: SimulatedController, stop: asyncio.Event, args: argparse.Namespace) -> None:
    waiting = [asyncio.ensure_future(stop.wait()), asyncio.ensure_future(controller.wait())]
    if args.trigger_every:
        waiting.append(asyncio.ensure_future(_trigger(controller, args.trigger_every, args.recipe)))
    try:
        done, _ = await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in waiting:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task


async def _trigger(controller: SimulatedController, period_s: float, recipe: int) -> None:
    while True:
        await asyncio.sleep(period_s)
        if controller.can_request:
            print(f"trigger {controller.request_measurement(recipe)}", flush=True)


def _write_line(file: TextIO, line: dict[str, object]) -> None:
    file.write(json.dumps(line) + "\n")
    file.flush()


def _open_log(option: str, path: Path | None) -> TextIO | None:
    if path is None:
        return None
    try:
        return path.open("a", encoding="utf-8")
    except OSError as error:
        raise UserError(f"{option} {path}: cannot be written: {error.strerror}. Name another file") from error


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
    try:
        path.write_text(json.dumps(controller.verdict.as_json(), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        print(f"--verdict {path}: cannot be written: {error.strerror}", file=sys.stderr)


def _address(text: str) -> tuple[str, int]:
    host, colon, port = text.rpartition(":")
    if not colon or not host or not port.isdigit() or int(port) > 65535:
        raise UserError(f"--tcp {text}: expected HOST:PORT, for example 127.0.0.1:5020")
    return host.strip("[]"), int(port)


def _numbers(text: str) -> tuple[int, int, int, int]:
    fields = text.split(",")
    if len(fields) != 4 or not all(field.strip().isdigit() for field in fields):
        raise UserError(f"--layout {text}: expected four numbers, for example 0,16,32,1984")
    link, service, contour, capacity = (int(field) for field in fields)
    return link, service, contour, capacity
