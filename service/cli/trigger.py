"""`combtrace trigger`: ask a running daemon for a job, over its control socket or a serial line as a panel would."""

from __future__ import annotations

import argparse
import time

from service.cli.control_options import add_daemon_argument
from service.cli.errors import EXIT_FAILED, EXIT_OK, EXIT_REFUSED, UserError

HELP = "ask a running daemon for a job"
DESCRIPTION = """\
Ask the daemon for a job, print its replies, and wait for the job's end: through its
control socket, or with --port over a serial line, by `TRIG` as a panel would.
Exit status: 0 DONE, 3 refused (NAK, or FAIL with a refusal), 1 failed or no reply."""


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
        from service.cli.trigger_at_socket import last_line

        ended = _status(last_line(args))
        assert ended is not None
        return ended
    if args.thickness_mm is not None:
        raise UserError("--thickness-mm cannot be told over a serial line; leave --port out, or name a --recipe")
    from drivers.trigger import TriggerUnavailable
    from drivers.trigger.serial import SerialLineTrigger

    port = SerialLineTrigger(args.port, args.baudrate)
    try:
        port.open()
        port.write_line("TRIG" if args.recipe is None else f"TRIG recipe={args.recipe}")
        give_up_at = time.monotonic() + args.timeout_s
        while (left := give_up_at - time.monotonic()) > 0:
            line = port.read_line(left)
            if line is None:
                break
            text = line.decode("ascii", "replace").strip()
            if not text:
                continue
            print(text, flush=True)
            status = _status(text)
            if status is not None:
                return status
    except TriggerUnavailable as error:
        raise UserError(str(error)) from error
    finally:
        port.close()
    raise UserError(
        f"{args.port}: no end of the job within {args.timeout_s:g} s, expected ACK and DONE or FAIL. "
        "Check that the daemon runs and serves this line",
        EXIT_FAILED,
    )


def _status(line: str) -> int | None:
    """The exit status that a reply means; None where the job goes on."""
    from service.reasons import Outcome, Reason

    word, _, rest = line.partition(" ")
    if word == "DONE":
        return EXIT_OK
    if word == "NAK":
        return EXIT_REFUSED
    if word == "FAIL":
        fields = rest.split()
        code = int(fields[1]) if len(fields) > 1 and fields[1].isdigit() else 0
        known = code in Reason.__members__.values()
        return EXIT_REFUSED if known and Reason(code).outcome is Outcome.REFUSED else EXIT_FAILED
    return None
