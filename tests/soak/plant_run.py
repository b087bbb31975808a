"""Fifty cells at one broker that is killed and started again a hundred times: `python -m tests.soak.plant_run`.

Cells are real but for their pictures; a reader that others wrote, their primary host, notes all that arrives. In each
tenth round some cells are killed with the broker up. At the end, what the journals hold is what arrived.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.support.interop.mosquitto import Mosquitto
from tests.support.interop.programs import sparkplug_reader
from tests.support.interop.sparkplug_read import faults
from tests.support.processes.processes import jobs, until

ROOT = Path(__file__).parents[2]
HOST = "reader"
KILL_CELLS_EVERY = 10
BOUND_S = 120.0


@dataclass
class Toll:
    """What came of it. again: jobs that arrived more than once, which is allowed; wrong: what is not."""

    cells: int = 0
    broker_kills: int = 0
    cell_kills: int = 0
    births: int = 0
    deaths: int = 0
    jobs: int = 0
    again: int = 0
    changes: int = 0
    wrong: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return (
            f"{self.cells} cells, broker killed {self.broker_kills} times, processes of cells {self.cell_kills}:"
            f" {self.births} births, {self.deaths} deaths, {self.jobs} jobs ({self.again} told again),"
            f" {self.changes} changes of state; {len(self.wrong)} violations"
        )


class Lines:
    """What the reader has written, read as it grows."""

    def __init__(self, file: Path) -> None:
        self._file, self._at, self._left = file, 0, 0
        self.all: list[dict[str, Any]] = []

    def newer(self) -> list[dict[str, Any]]:
        """All lines so far, the newest among them."""
        if self._file.exists():
            with self._file.open("rb") as file:
                file.seek(self._at)
                text = file.read()
            whole = text[: text.rfind(b"\n") + 1]
            self._at += len(whole)
            self.all += [json.loads(line) for line in whole.splitlines()]
        return self.all

    def _connections(self) -> list[int]:
        """Where the reader says that it has connected."""
        return [k for k, line in enumerate(self.newer()) if line["kind"] == "connected"]

    def leave(self) -> None:
        """Its present connection is about to end."""
        self._left = len(self._connections())

    def born_since_connected(self) -> set[str]:
        """Nodes that the reader saw born on its present connection."""
        begins = self._connections()
        if len(begins) <= self._left:
            return set()
        return {line["node"] for line in self.all[begins[-1] :] if line["kind"] == "NBIRTH"}


class Plant:
    """The cells, in some processes."""

    def __init__(self, folder: Path, port: int, cells: int, processes: int, period_s: float) -> None:
        self.folder, self._port, self._period_s = folder, port, period_s
        self._each = cells // processes
        self.killed: set[str] = set()
        self._running = [self._start(k) for k in range(processes)]

    def _start(self, k: int) -> subprocess.Popen[bytes]:
        words = [self._port, self.folder, k * self._each, self._each, self._period_s, HOST]
        command = [sys.executable, "-m", "tests.support.processes.plant_cells", *map(str, words)]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        with (self.folder / f"cells-{k}.log").open("ab") as log:
            return subprocess.Popen(command, cwd=ROOT, stdout=log, stderr=log, env=environment)

    def kill_some(self, k: int) -> set[str]:
        """kill -9 one process, but for the last, and start it again; its cells."""
        k %= len(self._running) - 1
        self._running[k].kill()
        self._running[k].wait()
        names = {f"cell-{number}" for number in range(k * self._each, (k + 1) * self._each)}
        self.killed |= names
        self._running[k] = self._start(k)
        return names

    def stop(self) -> None:
        """In order."""
        for process in self._running:
            process.send_signal(signal.SIGTERM)
        for process in self._running:
            process.wait(60)

    def end(self) -> None:
        """Whatever still runs."""
        for process in self._running:
            process.kill()
            process.wait()


def run(
    folder: Path,
    *,
    cells: int,
    kills: int,
    period_s: float = 2.0,
    up_s: float = 1.0,
    kill_cells_every: int = KILL_CELLS_EVERY,
) -> Toll:
    """The broker is up for `up_s` after all cells were born, then killed, `kills` times."""
    toll = Toll(cells=cells)
    nodes = {f"cell-{number}" for number in range(cells)}
    broker = Mosquitto(folder, "allow_anonymous true\nmax_queued_messages 0\n")
    with ExitStack() as opened:
        broker.start()
        opened.callback(broker.kill)
        opened.enter_context(sparkplug_reader(broker.port, folder / "read.jsonl", HOST))
        lines = Lines(folder / "read.jsonl")
        plant = Plant(folder, broker.port, cells, max(2, cells // 10), period_s)
        opened.callback(plant.end)
        for number in range(kills):
            until(lambda: lines.born_since_connected() >= nodes, BOUND_S, "a birth of each", 0.1)
            time.sleep(up_s)
            if number % kill_cells_every == kill_cells_every - 1:
                _kill_some(plant, number // kill_cells_every, lines)
                toll.cell_kills += 1
            lines.leave()
            broker.kill()
            toll.broker_kills += 1
            time.sleep(up_s / 2)
            broker.start()
        until(lambda: lines.born_since_connected() >= nodes, BOUND_S, "a birth of each", 0.1)
        until(lambda: not _owed(folder, nodes, lines), BOUND_S, "all jobs", 0.5)
        before = len(lines.newer())
        plant.stop()
        until(lambda: _deaths(lines, before) >= nodes, BOUND_S, "the deaths of all", 0.1)
        _judge(toll, folder, nodes, lines.newer(), plant.killed)
    return toll


def _kill_some(plant: Plant, k: int, lines: Lines) -> None:
    """Cells, whose deaths the broker then tells by their wills."""
    before = len(lines.newer())
    names = plant.kill_some(k)
    until(lambda: _deaths(lines, before) >= names, BOUND_S, "the deaths of those killed", 0.1)


def _deaths(lines: Lines, before: int) -> set[str]:
    return {line["node"] for line in lines.newer()[before:] if line["kind"] == "NDEATH"}


def _owed(folder: Path, nodes: set[str], lines: Lines) -> bool:
    """Whether a job that was settled a while ago has not arrived."""
    told = _told_jobs(lines.newer())
    return any(
        {job["job_id"] for job in jobs(folder / node / "journal.sqlite")[:-5] if job["outcome"]} - set(told[node])
        for node in nodes
    )


def _told_jobs(lines: list[dict[str, Any]]) -> dict[str, Counter[int]]:
    found: dict[str, Counter[int]] = defaultdict(Counter)
    for line in lines:
        for one in line.get("metrics", []) if line["kind"] == "NDATA" else []:
            if one["name"] == "Job/Number":
                found[line["node"]][one["value"]] += 1
    return found


def _judge(toll: Toll, folder: Path, nodes: set[str], lines: list[dict[str, Any]], killed: set[str]) -> None:
    """Every birth and death right, and all that happened told."""
    begins = [k for k, line in enumerate(lines) if line["kind"] == "connected"]
    for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True):
        for node in nodes:
            toll.wrong += [
                f"{node}: {text}" for text in faults([one for one in lines[begin:end] if one["node"] == node])
            ]
    toll.births = sum(line["kind"] == "NBIRTH" for line in lines)
    toll.deaths = sum(line["kind"] == "NDEATH" for line in lines)
    told = _told_jobs(lines)
    for node in nodes:
        done = {job["job_id"] for job in jobs(folder / node / "journal.sqlite") if job["outcome"]}
        toll.jobs += len(done)
        toll.again += sum(told[node].values()) - len(told[node])
        toll.wrong += [f"{node}: job {number} was never told" for number in done - set(told[node])]
        toll.wrong += [f"{node}: job {number} was told and never done" for number in set(told[node]) - done]
        births = [line["metrics"][0]["value"] for line in lines if (line["kind"], line["node"]) == ("NBIRTH", node)]
        pairs = itertools.pairwise(births)
        toll.wrong += [f"{node}: bdSeq {new} after {old}" for old, new in pairs if not 1 <= (new - old) % 256 <= 3]
        if node not in killed:  # what a process has in memory dies with it
            toll.wrong += _changes_wrong(toll, folder / node / "changes.json", node, lines)


def _changes_wrong(toll: Toll, file: Path, node: str, lines: list[dict[str, Any]]) -> list[str]:
    """Changes of state in the order in which they were made, but for those told again."""
    made = [state for _, state in json.loads(file.read_text())]
    seen: dict[int, list[str]] = {}
    for line in lines:
        if line["kind"] == "NDATA" and line["node"] == node:
            here: dict[int, list[str]] = {}
            for one in line["metrics"]:
                if one["name"] == "State/Name":
                    here.setdefault(one["at"], []).append(one["value"])
            for at, states in here.items():
                seen[at] = max(seen.get(at, []), states, key=len)
    toll.changes += len(made)
    told = [state for at in sorted(seen) for state in seen[at]]
    return [] if told == made else [f"{node}: {len(made)} changes made, {len(told)} told"]


def main() -> int:
    """1 where anything was wrong."""
    parser = argparse.ArgumentParser(prog="tests.soak.plant_run", description=__doc__)
    parser.add_argument("--cells", type=int, default=50)
    parser.add_argument("--kills", type=int, default=100)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        toll = run(Path(folder), cells=args.cells, kills=args.kills)
    print(toll)
    print("\n".join(toll.wrong[:40]))
    return 1 if toll.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
