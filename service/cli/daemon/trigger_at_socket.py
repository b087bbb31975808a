"""`combtrace trigger` without a serial line: by the daemon's control socket, and across its restart."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from service.cli.errors import EXIT_FAILED, UserError
from service.cli.options.control import state_folder

if TYPE_CHECKING:
    from pathlib import Path

RETRY_S = 0.25


def last_line(args: argparse.Namespace) -> str:
    """Trigger, print the daemon's lines, and give the one that ended it: `DONE`, `FAIL` or `NAK`; raise UserError."""
    request = {"command": "trigger", "recipe": args.recipe or 0, "thickness_um": _thickness_um(args.thickness_mm)}
    line = ""
    for answer in _until_the_end(state_folder(args), request, time.monotonic() + args.timeout_s):
        line = str(answer["line"])
        print(line, flush=True)
        if answer.get("why"):
            print(f"combtrace trigger: {answer['why']}", file=sys.stderr)
    if line.startswith(("DONE", "FAIL", "NAK")):
        return line
    if line.startswith("ACK"):
        job = line.removeprefix("ACK ")
        look = f"`combtrace jobs show {job}` tells how it ended"
        raise UserError(f"job {job} has not ended within {args.timeout_s:g} s, as far as is known; {look}", EXIT_FAILED)
    raise UserError("the daemon ended before it took the trigger. Start it, and trigger again", EXIT_FAILED)


def _until_the_end(folder: Path, request: dict[str, Any], give_up_at_s: float) -> Iterator[dict[str, Any]]:
    """The daemon's answers; where it goes after the acknowledgement, those of the one that is started next."""
    from service.daemon.control import ControlError, answers

    acknowledged: int | None = None
    while (left_s := give_up_at_s - time.monotonic()) > 0:
        try:
            for answer in answers(folder, request, left_s):
                acknowledged = answer.get("job", acknowledged)
                yield answer
                if not str(answer["line"]).startswith(("ACK", "WAIT")):
                    return
        except ControlError as error:
            if acknowledged is None:
                raise UserError(str(error), EXIT_FAILED) from error
        if acknowledged is None:
            return
        request = {"command": "end", "job": acknowledged}
        time.sleep(RETRY_S)


def _thickness_um(thickness_mm: float | None) -> int:
    if thickness_mm is None:
        return 0
    if not 0 < thickness_mm <= 10_000:
        raise UserError(f"--thickness-mm {thickness_mm:g}: expected above 0, to 10000")
    return max(round(1000 * thickness_mm), 1)
