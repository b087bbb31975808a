"""A journal of a year and half a million jobs: what adding it up takes, and what that costs a job beside it.

    python -m benchmarks.daemon.trends [--jobs 500000]

The journal's rows are made here, with reports as long as real ones; all else is the service's.
"""

from __future__ import annotations

import argparse
import json
import random
import sqlite3
import statistics
import tempfile
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

from service.low_priority import go_last
from service.reasons import Language, Outcome
from service.records.job import Progress, Terms, TriggerStamp
from service.records.journal import Journal
from service.records.journal_reader import reading
from service.trends.documents import trends_page
from service.trends.history import Span, history

SPANS_DAYS = (1, 7, 30, 365)
YEAR = timedelta(days=365)
PAIRS = 200
STAGES = ("mask", "trace", "quality", "simplify", "convert", "judge", "guard", "total")


def report(drawn: random.Random) -> str:
    """What the journal keeps of a job."""
    told = {
        "frame": "camera",
        "frame_ms": 91.2,
        "method": "wall-tips",
        "polarity": "bright",
        "pitch_px": 25.312,
        "vertices": 112,
        "area_mm2": round(drawn.gauss(52_000, 900), 3),
        "thickness_mm": 20.0,
        "uncertainty_mm": round(drawn.uniform(0.1, 0.3), 3),
        "quality": {"level": 190.1, "contrast": 120.1, "noise": 1.9, "blur_px": 1.2, "pitch_px": 25.31},
        "timings_ms": {name: round(50 * drawn.random(), 1) for name in STAGES},
        "pages_ms": 0.9,
        "transfer_ms": 210.1,
        "total_ms": round(drawn.gauss(600, 40), 1),
    }
    return json.dumps(told)


def fill(path: Path, jobs: int, end: datetime) -> None:
    """A journal of a year until then."""
    Journal(path).close()
    drawn = random.Random(976_100)

    def rows() -> Iterator[tuple[object, ...]]:
        for k in range(jobs):
            taken = (end - YEAR + k * YEAR / jobs).isoformat(timespec="milliseconds")
            ended = ("refused", 111) if drawn.random() < 0.04 else ("accepted", None)
            yield k + 1, taken, "controller", 9, k, 1, 20_000, *ended, taken, report(drawn), "sha256:00"

    with closing(sqlite3.connect(path)) as db, db:
        names = "job_id, taken_at, trigger_kind, trigger_session, trigger_counter, recipe, thickness_um, outcome,"
        names += " reason, settled_at, report, calibration"
        db.executemany(f"INSERT INTO jobs ({names}) VALUES ({', '.join('?' * 12)})", rows())


def added_up(path: Path, days: int, end: datetime) -> None:
    """Print what one look takes."""
    began, processor = time.perf_counter(), time.process_time()
    with reading(path) as journal:
        found = history(journal, Span(end - timedelta(days=days), end))
    looked = time.process_time() - processor
    size = len(trends_page(Language.ENGLISH, "auto", found, "").encode())
    jobs = sum(found.whole.outcomes.values())
    print(
        f"{days:4} days {jobs:7} jobs {len(found.buckets):4} buckets: processor {looked:.3f} s, "
        f"wall {time.perf_counter() - began:.2f} s, page {size / 1000:.0f} kB"
    )


def beside(path: Path, end: datetime) -> tuple[list[float], list[float]]:
    """Seconds of a job's two commits, without and with a year being added up all the while, by turns."""
    alone, watched = [], []
    stop, go = threading.Event(), threading.Event()

    def look() -> None:
        go_last()
        while not stop.is_set():
            go.wait()
            with reading(path) as journal:
                history(journal, Span(end - timedelta(days=7), end))

    with closing(Journal(path)) as journal, ThreadPoolExecutor(1) as thread:
        thread.submit(look)
        known = Progress(Terms({"number": 1}, "sha256:00"), json.loads(report(random.Random(1))))
        for _ in range(PAIRS):
            for times, watch in ((alone, False), (watched, True)):
                (go.set if watch else go.clear)()
                time.sleep(0.1)
                began = time.perf_counter()
                journal.settle(journal.take(TriggerStamp("serial")).job_id, Outcome.ACCEPTED, None, None, known)
                times.append(time.perf_counter() - began)
        stop.set()
        go.set()
    return alone, watched


def main() -> None:
    """Fill, add up, and look at a job beside it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=500_000)
    args = parser.parse_args()
    end = datetime.now(UTC)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "journal.sqlite"
        fill(path, args.jobs, end)
        print(f"{args.jobs} jobs: {path.stat().st_size / 1e6:.0f} MB")
        for days in SPANS_DAYS:
            added_up(path, days, end)
        alone, watched = (sorted(times) for times in beside(path, end))
        for name, times in (("alone", alone), ("beside it", watched)):
            median, late = 1000 * statistics.median(times), 1000 * times[int(0.95 * len(times))]
            print(f"a job's two commits {name}: median {median:.1f} ms, 95 % {late:.1f} ms")


if __name__ == "__main__":
    main()
