"""`combtrace trigger`: ask a running daemon for a job, over its control socket or a serial line as a panel would."""

from __future__ import annotations

import argparse

from service.cli.errors import EXIT_FAILED, EXIT_OK, EXIT_REFUSED, UserError
from service.cli.options.control import add_daemon_argument

HELP = "ask a running daemon for a job"
DESCRIPTION = """\
Ask the daemon for a job, print its replies, and wait for the job's end, also across a
restart of the daemon: through its control socket, or with --port over a serial line, by
`TRIG` as a panel would. A serial line is waited for 10 s for the acknowledgement, then
--timeout-s for the end, but no longer than a silence of 60 s.

Exit status: 0 DONE, 3 refused (NAK, or FAIL with a refusal), 1 failed or no end heard."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which daemon or port, recipe, thickness, bounds."""
    add_daemon_argument(parser)
    parser.add_argument("--port", metavar="DEVICE", help="over this serial port instead, for example /dev/ttyUSB0")
    parser.add_argument("--baudrate", type=int, default=9600, metavar="BAUD", help="default 9600")
    parser.add_argument("--recipe", type=int, metavar="N", help="recipe number; without it the daemon's default")
    parser.add_argument("--thickness-mm", type=float, metavar="H", help="the block's; without it the recipe's")
    parser.add_argument("--timeout-s", type=float, default=130.0, metavar="S", help="wait for the end; default 130")


def run(args: argparse.Namespace) -> int:
    """Trigger and wait."""
    if args.port is None:
        from service.cli.daemon.trigger_at_socket import last_line

        return _status(last_line(args))
    if args.thickness_mm is not None:
        raise UserError("--thickness-mm cannot be told over a serial line; leave --port out, or name a --recipe")
    from drivers.trigger import TriggerUnavailable
    from drivers.trigger.serial import SerialLineTrigger
    from service.jobs.serial_panel import NoEnd, ask

    port = SerialLineTrigger(args.port, args.baudrate)
    try:
        port.open()
        return _status(ask(port, args.recipe, args.timeout_s, lambda line: print(line, flush=True)))
    except NoEnd as error:
        raise UserError(f"{args.port}: {error}", EXIT_FAILED) from error
    except TriggerUnavailable as error:
        raise UserError(str(error)) from error
    finally:
        port.close()


def _status(line: str) -> int:
    """The exit status that the end means."""
    from service.reasons import Outcome, Reason

    word, _, rest = line.partition(" ")
    if word == "DONE":
        return EXIT_OK
    if word == "NAK":
        return EXIT_REFUSED
    fields = rest.split()
    code = int(fields[1]) if len(fields) > 1 and fields[1].isdigit() else 0
    known = code in Reason.__members__.values()
    return EXIT_REFUSED if known and Reason(code).outcome is Outcome.REFUSED else EXIT_FAILED
