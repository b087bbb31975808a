"""`combtrace simulate-service`: the service's side of the mailbox with given contours; no camera, no calibration."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli.errors import UserError

if TYPE_CHECKING:
    from service.commissioning.given_contours import GivenContour
    from service.config.config import Config
    from service.wiring.daemon import StandIns

log = logging.getLogger("combtrace.daemon")

STATE = Path("var/simulate-service")
SHAPES = ("rectangle", "corner", "holes", "circle", "gear", "crossing")

HELP = "play the service's side to a controller, with given contours"
DESCRIPTION = """\
Be the service to a controller, for whoever writes the controller's program: the
daemon itself, with journal, link and transfer, but contours come from files or by
name instead of a camera, in turn, one a job. Every write and every change of what
the controller says is logged. All contours are marked as not from a live camera
(bit 0 of flags). Contours are held against the recipe's limits as traced ones are.

Jobs begin when the controller asks (trigger_counter), until stopped; --every and
--once begin them from here. docs/reference/simulated-service.md says what it does not play.

Exit status of --once: 0 accepted or written, 3 refused, 1 failed, 2 bad
configuration, contours or usage; without it 0 when stopped."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """To whom, what, and when."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--controller", metavar="HOST:PORT", help="a controller over Modbus TCP, all else as by default")
    where.add_argument(
        "--config", type=Path, metavar="FILE", help="controller, recipes and work area as `run` has them"
    )
    parser.add_argument("--device-id", type=int, metavar="N", help="of --controller; default 1")
    parser.add_argument("--word-order", choices=("big", "little"), help="of --controller; default big (ABCD)")
    parser.add_argument(
        "--layout",
        metavar="LINK,SERVICE,CONTOUR,CAPACITY",
        help="of --controller: addresses of the blocks and registers of payload; default 0,16,32,1984",
    )
    parser.add_argument("--contours", type=Path, action="append", default=[], metavar="FILE", help="JSON or JSON Lines")
    parser.add_argument(
        "--shape", choices=SHAPES, action="append", default=[], help="a built-in contour; default rectangle"
    )
    parser.add_argument(
        "--at",
        nargs=2,
        type=float,
        default=(0.0, 0.0),
        metavar=("X", "Y"),
        help="where the shapes' lower left corners are, mm; default 0 0",
    )
    parser.add_argument(
        "--aligned", action="store_true", help="say that coordinates are the machine's (bit 3 of flags)"
    )
    when = parser.add_mutually_exclusive_group()
    when.add_argument("--once", action="store_true", help="one job, at once, then end")
    when.add_argument("--every", type=float, metavar="S", help="a job every S seconds, whatever the controller asks")
    parser.add_argument("--state", type=Path, default=STATE, metavar="DIR", help=f"journal and lock; default {STATE}")
    parser.add_argument("--registers", action="store_true", help="log every page word by word")


def run(args: argparse.Namespace) -> int:
    """Run."""
    from service.logs import start_logging

    config = simulated_config(args)
    contours = _contours(args)
    start_logging(logging.INFO, config.log.format)
    return asyncio.run(_run(args, config, contours))


async def _run(args: argparse.Namespace, config: Config, contours: tuple[GivenContour, ...]) -> int:
    from service.cli.daemon.run import serve, summary, version
    from service.wiring.daemon import build
    from service.wiring.errors import WiringError

    try:
        parts = build(config, stand_ins=_stand_ins(args, config, contours))
    except WiringError as error:
        raise UserError(str(error)) from error
    told = summary(config).partition(", ")[2]
    log.info("%s simulate-service, process %d: %d contours, %s", version(), os.getpid(), len(contours), told)
    return await serve(parts, config.controller.ready_timeout_s, once=args.once)


def _stand_ins(args: argparse.Namespace, config: Config, contours: tuple[GivenContour, ...]) -> StandIns:
    from service.commissioning.given_contours import GivenContours, NoCamera
    from service.link.wire_log import LoggedController
    from service.wiring.daemon import StandIns
    from service.wiring.devices import mailbox_layout
    from service.wiring.plan import work_area

    layout = mailbox_layout(config)
    assert layout is not None
    return StandIns(
        NoCamera(),
        GivenContours(contours, aligned=args.aligned, work_area_mm=work_area(config)),
        lambda controller: LoggedController(controller, layout, registers=args.registers),
    )


def simulated_config(args: argparse.Namespace) -> Config:
    """The configuration that the options name, without camera and calibration, with a state of its own."""
    from pydantic import ValidationError

    from service.config.config import Config
    from service.config.config_file import ConfigError, default_config, load_config
    from service.config.controllers import NoController

    try:
        config = default_config() if args.config is None else load_config(args.config)
    except ConfigError as error:
        raise UserError(str(error)) from error
    if isinstance(config.controller, NoController):
        raise UserError(
            f"{args.config}: controller.kind is none, expected one to talk to. Name it, or use --controller"
        )
    controller = config.controller.model_dump()
    controller |= _controller_options(args)
    try:
        return Config.model_validate(
            {
                **{key: config.model_dump()[key] for key in ("default_recipe", "recipes", "work_area_mm", "log")},
                "camera": default_config().camera,
                "calibration": default_config().calibration,  # a controller needs one; nothing reads it here
                "controller": controller,
                "triggers": _triggers(args, controller["handshake"]),
                "service": {"state_dir": args.state},
                "journal": {"path": args.state / "journal.sqlite"},
                "archive": {"path": args.state / "archive", "max_bytes": 0},
            }
        )
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UserError(f"{where}: {first['msg']}. Correct the option or the configuration") from error


def _controller_options(args: argparse.Namespace) -> dict[str, object]:
    given = {"device_id": args.device_id, "word_order": args.word_order, "layout": args.layout}
    if args.controller is None:
        named = next((name for name, value in given.items() if value is not None), None)
        if named is not None:
            raise UserError(f"--{named.replace('_', '-')} belongs to --controller; with --config the file says it")
        return {}
    options: dict[str, object] = {key: given[key] for key in ("device_id", "word_order") if given[key] is not None}
    host, colon, port = args.controller.rpartition(":")
    if not colon or not host or not port.isdigit():
        raise UserError(f"--controller {args.controller}: expected HOST:PORT, for example 192.168.0.10:502")
    if args.layout is not None:
        keys = ("link_address", "service_address", "contour_address", "payload_capacity")
        fields = args.layout.split(",")
        if len(fields) != len(keys) or not all(field.strip().isdigit() for field in fields):
            raise UserError(f"--layout {args.layout}: expected four numbers, for example 0,16,32,1984")
        options |= dict(zip(keys, map(int, fields), strict=True))
    return {**options, "host": host.strip("[]"), "port": int(port)}


def _triggers(args: argparse.Namespace, handshake: str) -> list[dict[str, object]]:
    if args.once:
        return []
    if args.every is not None:
        return [{"kind": "interval", "period_s": args.every}]
    if handshake == "none":
        raise UserError("a controller with handshake none cannot ask for a measurement. Give --every S or --once")
    return [{"kind": "controller"}]


def _contours(args: argparse.Namespace) -> tuple[GivenContour, ...]:
    """Shapes, then files, in the order of the options."""
    from service.commissioning.given_contours import GivenContoursError, read_contours
    from service.commissioning.given_shapes import shape

    x, y = args.at
    if not (abs(x) < 1e6 and abs(y) < 1e6):
        raise UserError(f"--at {x:g} {y:g}: expected millimetres, less than 1 km")
    names = args.shape or ([] if args.contours else ["rectangle"])
    try:
        read = [contour for path in args.contours for contour in read_contours(path)]
    except GivenContoursError as error:
        raise UserError(str(error)) from error
    return (*(shape(name, (x, y)) for name in names), *read)
