"""How fast a contour goes out: `python -m benchmarks.link [--write]` measures and compares in one run.

1,000 vertices, read-back off. Over loopback TCP to a libmodbus server, beside a C client and a bare pymodbus loop that
do the same writes; on a line of 115,200 baud beside what its bits and silences take; how long our heartbeat
stands while one of 9,600 is full; how soon the link is back; and what the link takes at rest. `--write` keeps the
table in docs/reports/link-speed.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.link.recovery import recoveries
from benchmarks.link.tcp_clients import CLIENTS, TURNS, Taken, Write, compare, send
from benchmarks.rest import medians_percent
from drivers.controller.mailbox.blocks import ServiceBlock
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.page_spans import page_starts, spans
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, micrometres
from drivers.controller.modbus.client import ModbusRtuController
from drivers.controller.modbus.requests import LONGEST_WRITE
from drivers.controller.modbus.serial_line import SerialLine
from service.link.link import Link, LinkSettings
from tests.support.interop.programs import libmodbus_rtu
from tests.support.processes.cell import Cell

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reports" / "link-speed.md"
VERTICES = 1000
BAUDRATE, SLOW_BAUDRATE = 115_200, 9600
BACK_S = 2.0
BEAT_S = 1.0  # the protocol's: a heartbeat changes at least once a second
TIMES_C, TIMES_PYMODBUS, WIRE_SHARE, REST_PERCENT = 4.0, 1.5, 95.0, 1.0
RTU_ROUNDS = 9
REST_S, REST_ROUNDS = 10.0, 5
PRIORITY = 10
LAYOUT = MailboxLayout()


@dataclass(frozen=True)
class Row:
    """One line of the table. goal: None where the figure is only for comparison."""

    what: str
    figure: str
    ratio: str
    goal: str | None
    met: bool


def contour_pages() -> tuple[Page, ...]:
    """A ring of 1,000 vertices, as the service would send it."""
    angles = np.linspace(0, 2 * np.pi, VERTICES, endpoint=False)
    ring = micrometres(np.stack([800 * np.cos(angles), 600 * np.sin(angles)], axis=1))
    area = round(VERTICES / 2 * 800 * 600 * np.sin(2 * np.pi / VERTICES))
    message = ContourMessage(1, (ring,), area, 200, 0, 1, False, False, 0, 9)
    return encode_pages(message, LAYOUT.payload_capacity, LAYOUT.word_order)


def writes_of(pages: Sequence[Page]) -> Iterator[Write]:
    """The writes of a transfer, as the protocol asks for them."""
    first = LAYOUT.contour_address
    for number, page in enumerate(pages, start=1):
        registers = (*page.header, *page.payload)
        yield 6, first, (0,)
        for offset, count in spans(page_starts(page.header, len(page.payload)), LONGEST_WRITE):
            yield 16, first + offset, registers[offset - 1 : offset - 1 + count]
        yield 6, first, (number,)


async def over_tcp() -> list[Row]:
    """The three clients, turn by turn, against one libmodbus server: a row each, in each placement."""
    pages = contour_pages()
    writes = list(writes_of(pages))
    return [row for taken in await compare(pages, writes, LAYOUT) for row in _rows(taken, len(writes))]


def _rows(taken: Taken, writes: int) -> list[Row]:
    us = {name: taken.us(name) for name in CLIENTS}
    to_c, to_pymodbus = us["combtrace"] / us["C"], us["combtrace"] / us["pymodbus"]
    where = taken.placement.said

    def took(client: str) -> str:
        return f"{us[client]:.0f} µs, {us[client] / writes:.0f} a write"

    def told(client: str) -> str:
        if len(taken.placement.client) == 1:
            return f"TCP, {where}: {client}"
        return f"TCP, {where}: {client} (beside the server in {taken.together[client]} of {TURNS} turns)"

    return [
        Row(told("C"), took("C"), "1", None, True),
        Row(told("pymodbus"), took("pymodbus"), f"{us['pymodbus'] / us['C']:.2f} × C", None, True),
        Row(
            told("combtrace"),
            took("combtrace"),
            f"{to_c:.2f} × C, {to_pymodbus:.2f} × pymodbus",
            f"at most {TIMES_C:g} × C, {TIMES_PYMODBUS:g} × pymodbus",
            to_c <= TIMES_C and to_pymodbus <= TIMES_PYMODBUS,
        ),
    ]


@contextmanager
def paced_line(baudrate: int) -> Iterator[tuple[str, str]]:
    """The devices of a line."""
    command = [sys.executable, "-m", "benchmarks.link.paced_line", str(baudrate)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        try:
            assert process.stdout is not None
            _, near, far = process.stdout.readline().split()
            yield near, far
        finally:
            process.kill()


@contextmanager
def before_all_else() -> Iterator[None]:
    """This process and those that it starts run before others where that is allowed: line and server play hardware."""
    normal = os.sched_getscheduler(0)
    try:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        yield
    finally:
        os.sched_setscheduler(0, normal, os.sched_param(0))


def wire_limit_s(writes: Sequence[Write], line: SerialLine) -> float:
    """The time of all bits and of the silence before each request; the server's own silence is not counted."""
    longest = 0.0
    for function_code, _, values in writes:
        request = 8 if function_code == 6 else 9 + 2 * len(values)
        longest += (request + 8) * line.byte_s + line.silence_s
    return longest


async def over_rtu() -> list[Row]:
    """Our driver on a line of 115,200 baud with a libmodbus server at its end."""
    pages = contour_pages()
    with before_all_else(), paced_line(BAUDRATE) as (near, far), libmodbus_rtu(far, baudrate=BAUDRATE):
        line = SerialLine(near, BAUDRATE)
        controller = ModbusRtuController(line, layout=LAYOUT)
        await controller.connect()
        took = []
        for _ in range(RTU_ROUNDS):
            begun = time.perf_counter()
            await send(controller, pages)
            took.append(time.perf_counter() - begun)
        await controller.close()
    limit_s = wire_limit_s(list(writes_of(pages)), line)
    share = 100 * limit_s / min(took)
    return [
        Row(f"RTU at {BAUDRATE} baud: the wire's limit", f"{1000 * limit_s:.0f} ms", "100 %", None, True),
        Row(
            "RTU: combtrace",
            f"{1000 * min(took):.0f} ms",
            f"{share:.1f} % of the limit",
            f"at least {WIRE_SHARE:g} %",
            share >= WIRE_SHARE,
        ),
    ]


async def heartbeat_on_a_slow_line() -> list[Row]:
    """The longest that the service's heartbeat stands while pages go out one after the other."""
    beats: list[float] = []

    class Watched(ModbusRtuController):
        async def write_service(self, block: ServiceBlock) -> None:
            await super().write_service(block)
            beats.append(time.perf_counter())

    with before_all_else(), paced_line(SLOW_BAUDRATE) as (near, far), libmodbus_rtu(far, baudrate=SLOW_BAUDRATE):
        controller = Watched(SerialLine(near, SLOW_BAUDRATE), layout=LAYOUT)
        link = Link(controller, LinkSettings())
        keeping = asyncio.ensure_future(link.run())
        await link.wait_connected()
        while not beats:
            await asyncio.sleep(0.05)
        begun = time.perf_counter()
        await send(controller, contour_pages())
        took = time.perf_counter() - begun
        keeping.cancel()
        await asyncio.wait([keeping])
    longest = max(after - before for before, after in pairwise(beats))
    return [
        Row(
            f"RTU at {SLOW_BAUDRATE} baud, the contour goes out in {took:.1f} s: longest between two heartbeats",
            f"{1000 * longest:.0f} ms",
            "",
            f"at most {1000 * BEAT_S:.0f} ms",
            longest <= BEAT_S,
        ),
    ]


async def back_again() -> list[Row]:
    """How soon contours can be sent again after the controller's return."""
    return [
        Row(
            f"link back after the return, {found.said}, {len(found.seconds)} times",
            f"median {found.median:.2f} s, longest {found.longest:.2f} s",
            "",
            f"at most {BACK_S:g} s",
            found.longest <= BACK_S,
        )
        for found in await recoveries()
    ]


def at_rest() -> list[Row]:
    """The link's processor time while it waits for triggers from a simulated controller, beside a bare loop's."""
    with tempfile.TemporaryDirectory() as folder:
        cell = Cell(Path(folder), trigger_every_s=None)
        try:
            cell.ready()
            cell.service.stop()
            link, bare = medians_percent(["link", "bare"], cell.port, REST_S, REST_ROUNDS)
        finally:
            cell.stop()
    return [
        Row(
            "link at rest, beside a bare loop that reads as often",
            f"{link:.2f} % of a core beside {bare:.2f} %",
            f"{link / bare:.2f} × bare",
            f"below {REST_PERCENT:g} %",
            link < REST_PERCENT,
        ),
    ]


def table(rows: Sequence[Row]) -> str:
    """The rows as Markdown."""
    lines = ["| what | took | ratio | goal | |", "|---|---:|---:|---|---|"]
    for row in rows:
        verdict = "" if row.goal is None else "met" if row.met else "missed"
        lines.append(f"| {row.what} | {row.figure} | {row.ratio} | {row.goal or ''} | {verdict} |")
    return "\n".join(lines) + "\n"


HEAD = f"""\
# How fast the link is

Measured by `make bench-link`, which writes this page: a contour of {VERTICES:,} vertices, read-back off, medians. The
three TCP clients do the same writes to one libmodbus server on loopback, turn by turn, in three placements: server and
client on one processor, on two different ones, and wherever the scheduler puts them.

The placement decides more than the client does. On one processor a reply is there when the client goes on; on two, each
request and each reply has to wake a processor that has fallen asleep, which a C client pays as we do. So clients can be
compared only within a placement, and the goals are those rows'. Left to the scheduler the clients need not be placed
alike: where a short-lived C client stays on the server's processor and ours is put on the other one, the ratio is that
of two placements, not of two clients. That row is told all the same, with its verdict, for it is what a user gets on
such a machine; a controller at the end of a cable is never on our processor.

The serial line is a pair of pseudo-terminals that carry each byte at the line's pace; its limit counts all bits of
requests and replies and 3.5 characters of silence before each request, and the best of {RTU_ROUNDS} rounds counts: line
and server are programs here, which others of the machine disturb.

The link is back when nothing keeps a contour from being sent: connected, answered, the controller's heartbeat seen to
move, its test echo right. The controller is a process that is killed and started, or stopped in its tracks and let go
on, away for 0.5 to 2.5 s; the return counts from when it listens or goes on.

"""


def main() -> int:
    """Measure, print, and tell by the exit status whether all goals are met."""
    parser = argparse.ArgumentParser(description="measure the link")
    parser.add_argument("--write", action="store_true", help="keep the table in docs/reports/link-speed.md")
    parser.add_argument(
        "--without-rest", action="store_true", help="leave out the link at rest, which takes two minutes"
    )
    args = parser.parse_args()
    busy = f"Other programs' load at the start: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.\n\n"
    rows = asyncio.run(over_tcp()) + asyncio.run(over_rtu()) + asyncio.run(heartbeat_on_a_slow_line())
    rows += asyncio.run(back_again())
    rows += [] if args.without_rest else at_rest()
    print(table(rows), end="")
    if args.write:
        PAGE.write_text(HEAD + busy + table(rows), encoding="utf-8")
    return 0 if all(row.met for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
