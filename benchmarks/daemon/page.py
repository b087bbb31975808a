"""What the operator's page takes: `python -m benchmarks.daemon.page [--rounds N] [--write]`.

First paint and weight in Debian's Chromium; and what a viewer, and one of the live view, cost a job. A viewer asks for
what the page asks for at the page's pace: the list, the drawing, the frame at both sizes, beside the events. There is a
job a second; and, to tell the worst, one after the other without a pause: all of it falls into the next job. Rounds
with and without a viewer alternate, and a job is compared with jobs of the same picture, for other load on the machine
comes and goes.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import random
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median, stdev
from textwrap import fill
from typing import Protocol

from playwright.sync_api import Response, sync_playwright

from benchmarks.daemon.figure import Figure
from benchmarks.rest import processor_s
from service.records.journal_reader import JobFilter, reading
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import Client
from tests.support.processes.processes import free_port, until
from tests.support.real_parts import need_program

PAINT_MS, WEIGHT_KB, COST_PERCENT, LIVE_PERCENT = 300.0, 200.0, 2.0, 10.0
LOADS = 9
LOOKS_AT_ONCE, LOOK_S = 2.0, 0.5  # then one each LOOK_S, as static/page.js has it
LIVE_PAUSE_S = 0.3  # as static/live.js has it
PACE_S = 1.0  # from trigger to trigger; faster than any cell cuts
JOBS_A_ROUND = 12  # three of each picture
JOBS_BEFORE = 4  # which do not count: a viewer who has just come looks at all at once
DRAWN = 400
PAGE_WIDTH = 120
PAGE = Path(__file__).parents[2] / "docs" / "reports" / "page-speed.md"


@dataclass(frozen=True)
class Loading:
    """First contentful paints of the page and of one with a line of text, ms; kilobytes but frames and events."""

    paints: list[float]
    bare_paints: list[float]
    weight_kb: float


def loading(url: str) -> Loading:
    """Each load with an empty cache, the page and the bare one in turns: both see the same other load."""
    paints: dict[str, list[float]] = {url: [], f"{url}nowhere": []}
    weights: dict[str, int] = {}

    def weigh(response: Response) -> None:
        if not any(part in response.url for part in ("/frames/", "/events", "/nowhere")):
            weights[response.url] = len(response.body())

    with sync_playwright() as playwright:
        path = need_program("chromium", "apt-get install chromium")
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        for _ in range(LOADS + 1):
            for address, found in paints.items():
                page = browser.new_page(viewport={"width": 1280, "height": 800})
                page.on("response", weigh)
                page.goto(address)
                page.wait_for_timeout(1000)
                entries = "performance.getEntriesByName('first-contentful-paint').map(entry => entry.startTime)"
                found.extend(page.evaluate(entries))
                page.close()
        browser.close()
    full, bare = (found[1:] for found in paints.values())  # the first also starts the browser's own processes
    return Loading(full, bare, sum(weights.values()) / 1000)


class Viewer:
    """Asks for what the page asks for, in a thread, until `close`."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._closed = False
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def close(self) -> None:
        """End it."""
        self._closed = True
        self._thread.join()

    def _watch(self) -> None:
        events = http.client.HTTPConnection("127.0.0.1", self._port)
        events.request("GET", "/api/v1/events")
        stream = events.getresponse()
        client, seen, shown = Client(self._port), "", 0
        left, counted_at = LOOKS_AT_ONCE, time.monotonic()
        while not self._closed:
            line = stream.readline()
            if not line.startswith(b"data: "):
                continue
            state = json.loads(line[6:])
            key = f"{state['settled_job']} {state['disk']['archive_jobs']}"
            now = time.monotonic()
            left, counted_at = min(left + (now - counted_at) / LOOK_S, LOOKS_AT_ONCE), now
            if key == seen or left < 1:
                continue
            seen, left = key, left - 1
            newest = client.get("/api/v1/jobs?limit=16").json["jobs"]
            kept = [one["job_id"] for one in newest if "frame.png" in one["files"] and one["job_id"] > shown]
            if kept:
                client.get(f"/api/v1/jobs/{kept[0]}/drawing")
                client.get(f"/api/v1/frames/{kept[0]}?width=1600")
                shown = kept[0]
            for job in kept:
                client.get(f"/api/v1/frames/{job}?width=320")
        events.close()


class LiveViewer(Viewer):
    """Asks for look after look and its picture, as the page's live view does."""

    def _watch(self) -> None:
        client, newest = Client(self._port), 0
        while not self._closed:
            look = client.get(f"/api/v1/live{f'?after={newest}' if newest else ''}").json["look"]
            if look is not None:
                newest = look["number"]
                client.get(f"/api/v1/live/{newest}")
            time.sleep(LIVE_PAUSE_S)


@dataclass(frozen=True)
class Cost:
    """Percent that a job takes longer with a viewer, how sure that is, and milliseconds of processor more a job."""

    percent: float
    standard_error: float
    processor_ms: float


class Beside(Protocol):
    """Who is there during a round."""

    def close(self) -> None:
        """End it."""


Comes = Callable[[int], Beside]


def viewers_cost(cell: Cell, port: int, rounds: int, viewer: Comes = Viewer, instead: Comes | None = None) -> Cost:
    """From jobs of the same picture, in rounds with a viewer and in those without beside them, each first in turn.

    instead: who is there in rounds without a viewer.
    The median of the ratios of every such two jobs; its standard error by drawing rounds anew.
    """
    ratios, used = list[list[float]](), list[float]()
    for number in range(rounds):
        with_viewer = [number % 2 == 1, number % 2 == 0]
        found = {watched: _round(cell, port, viewer if watched else instead) for watched in with_viewer}
        (seen, seen_ms), (alone, alone_ms) = found[True], found[False]
        ratios.append([one / other for name in seen for one in seen[name] for other in alone.get(name, ())])
        used.append(seen_ms - alone_ms)
    draw = random.Random(1)
    drawn = [_cost(draw.choices(ratios, k=rounds)) for _ in range(DRAWN)]
    return Cost(_cost(ratios), stdev(drawn), median(used))


def _cost(ratios: list[list[float]]) -> float:
    return 100 * (median(ratio for of_round in ratios for ratio in of_round) - 1)


def _round(cell: Cell, port: int, viewer: Comes | None) -> tuple[dict[str, list[float]], float]:
    """Total times of jobs by picture, ms, and processor that the daemon took for one.

    viewer: who watches at the page's port.
    """
    watching = None if viewer is None else viewer(port)
    try:
        cell.goes_on(JOBS_BEFORE)
        return _jobs(cell)
    finally:
        if watching is not None:
            watching.close()


def _jobs(cell: Cell) -> tuple[dict[str, list[float]], float]:
    before, begun = len(cell.settled()), processor_s(cell.service.process_id)
    until(lambda: len(cell.settled()) > before + JOBS_A_ROUND, 120, "jobs")
    processor_ms = (processor_s(cell.service.process_id) - begun) * 1000 / (len(cell.settled()) - before)
    with reading(cell.journal) as journal:
        ended = journal.jobs(JobFilter(), JOBS_A_ROUND)  # the first that was seen to end began in the round before
    took: defaultdict[str, list[float]] = defaultdict(list)
    for job in ended:
        if "frame" in job.report:
            took[job.report["frame"]].append(job.report["total_ms"])
    return took, processor_ms


def figures(folder: Path, rounds: int) -> tuple[list[Figure], str]:
    """All of them, and what belongs to them in words."""
    with _jobs_each(folder / "paced", PACE_S) as (cell, port):
        paced = viewers_cost(cell, port, rounds)
        live = viewers_cost(cell, port, rounds, LiveViewer)
        cell.controller.stop()
        time.sleep(2)
        loaded = loading(f"http://127.0.0.1:{port}/")
    with _jobs_each(folder / "pressed", 0.02) as (cell, port):
        pressed = viewers_cost(cell, port, rounds)
    shown = [
        Figure(f"first paint, empty cache, median of {LOADS}", median(loaded.paints), "ms", PAINT_MS),
        Figure("all that is loaded, without the frame", loaded.weight_kb, "kB", WEIGHT_KB),
        Figure("a job a second takes longer with a viewer by", paced.percent, "%", COST_PERCENT),
        Figure("a job a second takes longer with one of the live view by", live.percent, "%", LIVE_PERCENT),
    ]
    told = (
        f"A page of one line, loaded in turns with it, painted after {median(loaded.bare_paints):.0f} ms; the load was"
        f" {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores at the end. The viewer's cost has a standard error of"
        f" {paced.standard_error:.1f} %, the live view's of {live.standard_error:.1f} %. Where jobs follow one another"
        f" without a pause, five a second, it is {pressed.percent:.1f} ± {pressed.standard_error:.1f} %:"
        " then both cores are busy all the time,"
        f" and of the processor the daemon takes {pressed.processor_ms:.0f} ms more for a job that is looked at."
    )
    return shown, fill(told, PAGE_WIDTH)


@contextmanager
def _jobs_each(folder: Path, every_s: float) -> Iterator[tuple[Cell, int]]:
    """A service with a page that has a trigger each `every_s`, and the page's port."""
    folder.mkdir()
    port = free_port()
    cell = Cell(folder, camera=ON_SAMPLES, trigger_every_s=every_s, more=f"page: {{port: {port}}}\n")
    try:
        cell.ready()
        cell.goes_on(2)
        yield cell, port
    finally:
        cell.service.kill()
        cell.stop()


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(prog="benchmarks.daemon.page", description=__doc__)
    parser.add_argument("--rounds", type=int, default=12, metavar="N", help="with a viewer, and as many without")
    parser.add_argument("--write", action="store_true", help=f"write docs/reports/{PAGE.name}")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        shown, told = figures(Path(folder), args.rounds)
    text = "\n".join(["| what | measured | goal | met |", "|---|---|---|---|", *map(str, shown), "", told])
    print(text)
    if args.write:
        PAGE.write_text(f"# What the page takes\n\nWritten by `python -m benchmarks.daemon.page --write`.\n\n{text}\n")
    return 0 if all(figure.met for figure in shown) else 1


if __name__ == "__main__":
    sys.exit(main())
