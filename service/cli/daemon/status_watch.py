"""`combtrace status --watch`: the status followed until Ctrl-C."""

from __future__ import annotations

import argparse
import json
import shutil
import time
from typing import Any, NoReturn

from service.cli.colour import obeys_codes
from service.cli.daemon.status_page import lines, page
from service.cli.errors import EXIT_FAILED, UserError
from service.cli.options.control import asked

PERIOD_S = 0.5
AGES = ("uptime_s", "since_s")  # they change at every look
SHOWN = ("job", "last job", "fault", "warning", "part")


def watch(args: argparse.Namespace) -> NoReturn:
    """Follow it for ever: a page drawn anew on a terminal, else a line, or JSON object, a change.

    A daemon that goes is told, and waited for.
    """
    live = obeys_codes() and not args.json
    before = ""
    while True:
        status, trouble = _look(args)
        if live:
            print(_screen(page(status) if status else trouble), end="", flush=True)
        else:
            told = _json(status, trouble) if args.json else _sentence(status, trouble)
            if told != before:
                print(told if args.json else f"{time.strftime('%Y-%m-%d %H:%M:%S')} {told}", flush=True)
            before = told
        time.sleep(PERIOD_S)


def _look(args: argparse.Namespace) -> tuple[dict[str, Any], str]:
    """The status, or why there is none; raise UserError where there will be none."""
    try:
        return asked(args, command="status"), ""
    except UserError as error:
        if error.exit_status != EXIT_FAILED:
            raise
        return {}, str(error)


def _screen(text: str) -> str:
    """The text instead of what stood on the terminal, as much as it holds."""
    height = shutil.get_terminal_size().lines
    head = f"combtrace status, {time.strftime('%H:%M:%S')}, Ctrl-C ends it"
    shown = [head, "", *text.splitlines()][: height - 1]
    return "\x1b[H" + "".join(f"{line}\x1b[K\n" for line in shown) + "\x1b[J"


def _sentence(status: dict[str, Any], trouble: str) -> str:
    """One line without what changes at every look."""
    if not status:
        return trouble
    reason = f": {status['reason']}" if status["reason"] else ""
    return "; ".join([status["state"] + reason, *(f"{name} {text}" for name, text in lines(status) if name in SHOWN)])


def _json(status: dict[str, Any], trouble: str) -> str:
    told = {name: value for name, value in status.items() if name not in AGES}
    return json.dumps(told or {"state": None, "error": trouble}, ensure_ascii=False)
