"""What OPC UA shows and takes: `python -m benchmarks.daemon.opcua [--jobs N] [--rounds N] [--write]`.

A real daemon on small drawn pictures, a simulated controller and node-opcua, all on this machine. First: is each of N
jobs told once, and how long after a change of state did the client see it? Then what a client that watches costs a job,
and one that nobody trusts and that floods the port; in rounds without that one the same flood goes to another daemon,
so that the machine is as busy.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles
from textwrap import fill

from asyncua import Client

from benchmarks.daemon.figure import Figure
from benchmarks.daemon.page import PAGE_WIDTH, Cost, viewers_cost
from tests.support.interop.opcua import AUTOMATIC, Identity, NodeClient, identity
from tests.support.processes.cell import Cell
from tests.support.processes.processes import free_port, until

SEEN_MS, COST_PERCENT, FLOOD_PERCENT = 100.0, 2.0, 10.0
EVERY_S, PACE_S = 0.2, 1.0
AT_ONCE = 20  # requests of a flood that are under way
PAGE = Path(__file__).parents[2] / "docs" / "reports" / "opcua.md"


def url(port: int) -> str:
    """Where a daemon of this machine serves."""
    return f"opc.tcp://127.0.0.1:{port}"


@contextmanager
def served(folder: Path, every_s: float | None) -> Iterator[tuple[Cell, int, Identity]]:
    """A cell with OPC UA, its port, and a client that it trusts."""
    client, port = identity(folder / "client"), free_port()
    trusted = folder / "state" / "opcua" / "trusted"
    trusted.mkdir(parents=True)
    shutil.copy(client.certificate, trusted / "client.pem")
    cell = Cell(folder, trigger_every_s=every_s, more=f"opcua: {{port: {port}}}\n")
    try:
        until(lambda: "opcua: opc.tcp" in cell.service.text, 60, "OPC UA")
        yield cell, port, client
    finally:
        cell.stop()


class Watcher:
    """node-opcua, subscribed to states and events; it has learnt the specification's types already."""

    def __init__(self, port: int, shown: Identity) -> None:
        self.client = NodeClient(url(port), shown)
        self.client.watch()
        until(lambda: bool(self.client.events("job ")), 60, "a first event")

    def close(self) -> None:
        """End it."""
        self.client.close()


class Flood:
    """A client without a certificate that asks for endpoints as fast as it can, in a thread."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._closed = False
        self.answered = 0
        self._thread = threading.Thread(target=lambda: asyncio.run(self._ask()))
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._closed = True
        self._thread.join()

    async def _ask(self) -> None:
        while not self._closed:
            client = Client(url(self._port))
            with suppress(Exception):
                await client.connect_socket()
                await client.send_hello()
                await client.open_secure_channel()
                while not self._closed:
                    await asyncio.gather(*[client.get_endpoints() for _ in range(AT_ONCE)])
                    self.answered += AT_ONCE
            client.disconnect_socket()


@dataclass(frozen=True)
class Watched:
    """How often each job's result was told, and after how many ms each change of state was seen."""

    jobs: int
    told: Counter[str]
    missing: int
    seen_ms: list[float]


def watched(folder: Path, jobs: int) -> Watched:
    """That many jobs, one after the other."""
    with served(folder, EVERY_S) as (cell, port, shown):
        watcher = Watcher(port, shown)
        begin = len(watcher.client.told)
        first = int(watcher.client.events(" accepted")[0]["JobId"]["id"]) if watcher.client.events(" accepted") else 0
        until(lambda: len(watcher.client.events(" accepted")) >= jobs, 3600, f"{jobs} results")
        told = Counter(event["JobId"]["id"] for event in watcher.client.events(" accepted"))
        changes = [one for one in watcher.client.told[begin:] if one.get("node") == AUTOMATIC]
        watcher.close()
        first, last = first or min(map(int, told)), max(map(int, told))
        kept = {str(job["job_id"]) for job in cell.settled() if first <= int(str(job["job_id"])) <= last}
    return Watched(len(told), told, len(kept - set(told)), [float(one["at"] - one["since"]) for one in changes])


def costs(folder: Path, rounds: int) -> tuple[Cost, Cost]:
    """Of a watcher, and of a flood."""
    with (
        served(folder / "cell", PACE_S) as (cell, port, shown),
        served(folder / "other", None) as (_, other, _),
    ):
        cell.goes_on(2)
        watching = viewers_cost(cell, port, rounds, lambda its_port: Watcher(its_port, shown))
        flooded = viewers_cost(cell, port, rounds, Flood, lambda _port: Flood(other))
    return watching, flooded


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(prog="benchmarks.daemon.opcua", description=__doc__)
    parser.add_argument("--jobs", type=int, default=1000, metavar="N", help="of which each result is told")
    parser.add_argument("--rounds", type=int, default=8, metavar="N", help="with a client, and as many without")
    parser.add_argument("--write", action="store_true", help=f"write docs/reports/{PAGE.name}")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        found = watched(Path(folder) / "watched", args.jobs)
        watching, flooded = costs(Path(folder), args.rounds)
    often = sum(count - 1 for count in found.told.values())
    late = 100 * sum(ms > SEEN_MS for ms in found.seen_ms) / len(found.seen_ms)
    shown = [
        Figure(f"of {found.jobs} jobs results that were not told", found.missing, "", 0),
        Figure("results that were told again", often, "", 0),
        Figure("a change of state was seen after, median", median(found.seen_ms), "ms", SEEN_MS),
        Figure("and 99 of 100 after", quantiles(found.seen_ms, n=100)[98], "ms", SEEN_MS),
        Figure("a job a second takes longer with a client that watches by", watching.percent, "%", COST_PERCENT),
        Figure("a job a second takes longer with a flood by", flooded.percent, "%", FLOOD_PERCENT),
    ]
    told = (
        f"Of {len(found.seen_ms)} changes {late:.1f} % were seen later than {SEEN_MS:g} ms, at a publishing interval of"
        f" 50 ms; the load was {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores. The watcher's cost has a standard"
        f" error of {watching.standard_error:.1f} %, the flood's of {flooded.standard_error:.1f} %; for a job the"
        f" daemon takes {watching.processor_ms:.0f} and {flooded.processor_ms:.0f} ms of processor more."
    )
    head = ["| what | measured | goal | met |", "|---|---|---|---|"]
    text = "\n".join([*head, *map(str, shown), "", fill(told, PAGE_WIDTH)])
    print(text)
    if args.write:
        said = "Written by `python -m benchmarks.daemon.opcua --write`."
        PAGE.write_text(f"# What OPC UA shows and takes\n\n{said}\n\n{text}\n", encoding="utf-8")
    return 0 if all(figure.met for figure in shown) else 1


if __name__ == "__main__":
    sys.exit(main())
