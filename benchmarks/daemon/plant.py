"""What a plant takes of a cell, and its page: `python -m benchmarks.daemon.plant [--jobs N] [--write]`.

A job's time from its trigger to its end with telemetry against one without, in turns in one process, at a broker that
works, that is away, and that takes everything in and answers nothing. Its tracing is left out, so that nothing of it
hides the difference. Then the fleet page of fifty cells in Debian's Chromium: first paints, and how long after its last
word a cell is shown as silent.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import AsyncExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from textwrap import fill
from typing import Any

from playwright.sync_api import Browser, expect, sync_playwright

from benchmarks.daemon.figure import Figure
from benchmarks.page_section import put_section
from tests.support.interop.false_broker import CONNACK, SUBACK, FalseBroker
from tests.support.interop.mosquitto import Mosquitto
from tests.support.interop.said_cells import SaidCells, ready, said_cells
from tests.support.processes.page_panel import PANEL, chromium
from tests.support.processes.processes import Process, free_port, until
from tests.support.processes.wired_daemon import WiredDaemon, wired

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "plant.md"
DELAY_MS, PROCESSOR_MS, PAINT_MS, SILENT_S = 1.0, 10.0, 500.0, 5.0
CELLS, LOADS, SILENCES = 50, 9, 5
BETWEEN_S = 0.3  # jobs: what one leaves to do falls into none of the other daemon's
IN_MEMORY = Path("/dev/shm")  # a disk that others use would hide a millisecond
WARM_UP = 5
PAGE_WIDTH = 120


async def delay_ms(folder: Path, port: int, jobs: int) -> tuple[float, float]:
    """By how much a job is longer with telemetry to this port than the one after it without; and how much more of the
    processor it takes, all threads together, until it is told. Medians.
    """
    plain: dict[str, Any] = {"triggers": []}
    told = {**plain, "telemetry": {"port": port, "node": "cell-1"}}
    async with AsyncExitStack() as opened:
        cells = [
            await opened.enter_async_context(wired(folder / name, {"kind": "none"}, **sections))
            for name, sections in (("with", told), ("without", plain))
        ]
        taken = [[await _job_ms(cell) for cell in cells] for _ in range(jobs + WARM_UP)][WARM_UP:]
    longer, dearer = (median(one[k] - other[k] for one, other in taken) for k in (0, 1))
    return longer, dearer


async def _job_ms(cell: WiredDaemon) -> tuple[float, float]:
    await cell.ready()
    begun, busy = time.perf_counter(), time.process_time()
    await cell.job()
    taken = time.perf_counter() - begun
    await asyncio.sleep(BETWEEN_S)
    return taken * 1000, (time.process_time() - busy) * 1000


def delays(folder: Path, jobs: int) -> list[Figure]:
    """At each kind of broker."""
    broker, deaf = Mosquitto(folder), FalseBroker(CONNACK, SUBACK)
    broker.start()
    found = []
    try:
        for what, port in (("works", broker.port), ("is away", free_port()), ("is deaf", deaf.port)):
            with tempfile.TemporaryDirectory(dir=IN_MEMORY if IN_MEMORY.is_dir() else None) as here:
                found.append((what, *asyncio.run(delay_ms(Path(here), port, jobs))))
    finally:
        broker.kill()
        deaf.close()
    return [
        figure
        for what, longer, dearer in found
        for figure in (
            Figure(f"a job longer by telemetry, broker {what}, median of {jobs}", longer, "ms", DELAY_MS),
            Figure(f"processor time until it is told, broker {what}, median of {jobs}", dearer, "ms", PROCESSOR_MS),
        )
    ]


@contextmanager
def fleet(folder: Path) -> Iterator[tuple[SaidCells, str]]:
    """Fifty cells, and the address of their page."""
    broker, port = Mosquitto(folder), free_port()
    broker.start()
    (folder / "fleet.yaml").write_text(f"broker: {{port: {broker.port}}}\npage: {{port: {port}}}\n")
    service = Process(folder / "fleet.log", "fleet", "serve", "--config", folder / "fleet.yaml")
    try:
        with said_cells(broker.port, {number: ready(number) for number in range(CELLS)}) as said:
            until(lambda: "listening at" in service.text, what="the page")
            yield said, f"http://127.0.0.1:{port}/"
    finally:
        service.stop()
        broker.kill()


def paints_ms(browser: Browser, url: str) -> list[float]:
    """First contentful paints, each with an empty cache."""
    found = []
    for _ in range(LOADS + 1):
        page = browser.new_page(viewport=PANEL)
        page.goto(url)
        expect(page.locator("#cells tr")).to_have_count(CELLS)
        page.wait_for_timeout(500)
        found += page.evaluate("performance.getEntriesByName('first-contentful-paint').map(entry => entry.startTime)")
        page.close()
    return found[1:]  # the first also starts the browser's own processes


def silences_s(browser: Browser, url: str, said: SaidCells) -> list[float]:
    """From a cell's last word at the latest until it is shown as silent, one cell after another."""
    page = browser.new_page(viewport=PANEL, locale="en-GB")
    page.goto(url)
    found = []
    for number in range(SILENCES):
        row = page.locator(f"[id='plant/cell-{number}']")
        expect(row).to_contain_text("Ready")
        said.quiet.add(number)
        begun = time.monotonic()
        expect(row).to_contain_text("Silent", timeout=30_000)
        found.append(time.monotonic() - begun)
    page.close()
    return found


def measured(folder: Path, jobs: int) -> list[Figure]:
    """All figures."""
    figures = delays(folder, jobs)
    with sync_playwright() as playwright, fleet(folder) as (said, url):
        browser = chromium(playwright)
        paints, silences = paints_ms(browser, url), silences_s(browser, url, said)
        browser.close()
    figures.append(
        Figure(f"first paint of the page with {CELLS} cells, median of {LOADS}", median(paints), "ms", PAINT_MS)
    )
    figures.append(Figure(f"a cell shown as silent, the slowest of {SILENCES}", max(silences), "s", SILENT_S))
    return figures


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(prog="benchmarks.daemon.plant", description=__doc__)
    parser.add_argument("--jobs", type=int, default=60, metavar="N", help="of each daemon at each broker; default 60")
    parser.add_argument("--write", action="store_true", help="put the table into docs/how-to/plant.md")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        figures = measured(Path(folder), args.jobs)
    text = told(figures)
    print(text)
    if args.write:
        put_section("plant", text, PAGE)
    return 0 if all(figure.met for figure in figures) else 1


def told(figures: Sequence[Figure]) -> str:
    """The table, Markdown."""
    how = (
        f"{datetime.now(UTC):%Y-%m-%d}, on {os.cpu_count()} cores with a load of {os.getloadavg()[0]:.1f} at the end,"
        " `make bench-plant`; jobs without tracing, Mosquitto and Debian's Chromium on the same machine."
    )
    rows = "\n".join(str(figure) for figure in figures)
    return f"| what | measured | goal | met |\n|---|---|---|---|\n{rows}\n\n{fill(how, PAGE_WIDTH)}"


if __name__ == "__main__":
    sys.exit(main())
