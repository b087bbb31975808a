"""The bench judges what it measured by its goals, and reckons a million from one."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.replays.__main__ import Cost, Measured, figures, on_paper, told
from benchmarks.replays.runs import Took

ONE = Took(2000, tracing_s=100.0, elapsed_s=101.0, busy_s=100.0, own_cpu_s=1.0)
TWO = Took(2000, 100.0, elapsed_s=52.0, busy_s=101.0, own_cpu_s=1.0, here_mb=[90.0, 90.0], worker_mb=[120.0, 121.0])
LARGE = Cost(trace_s=0.36, bucket_s=0.036, bytes=2.5e6, own_s=0.0005, dask_s=0.002)
FOUND = Measured(
    {"one": ONE, "two": TWO, "killed": replace(TWO, kills=10), "dask": replace(TWO, elapsed_s=54.0), "bucket": TWO},
    dict.fromkeys(("one", "two", "killed", "dask", "bucket"), True),
    LARGE,
)


def missed(found: Measured) -> list[str]:
    return [what for what, _, _, met in figures(found) if not met]


def test_runs_that_reach_their_goals_miss_none() -> None:
    assert missed(FOUND) == []
    assert "10 workers killed" in told(FOUND)


@pytest.mark.parametrize(
    ("name", "worse", "what"),
    [
        ("two", replace(TWO, elapsed_s=54.0), "two processes, times as fast as one"),
        ("dask", replace(TWO, elapsed_s=55.0), "a Dask cluster of two, times as fast as one"),
        ("dask", replace(TWO, own_cpu_s=2.1), "handing out and writing, a Dask cluster of two, of tracing"),
        ("two", replace(TWO, worker_mb=[100.0, 106.0]), "memory of a worker, two processes, from a fifth on"),
        ("two", replace(TWO, here_mb=[100.0, 106.0]), "memory of here, two processes, from a fifth on"),
    ],
)
def test_a_run_that_does_not_is_told(name: str, worse: Took, what: str) -> None:
    assert missed(replace(FOUND, took={**FOUND.took, name: worse})) == [what]


def test_rows_that_are_others_are_told() -> None:
    assert missed(replace(FOUND, same={**FOUND.same, "bucket": False})) == [
        "rows from a bucket, one read in 20 answered with 503, as one process's"
    ]


def test_a_million_is_reckoned_from_one() -> None:
    page = on_paper(LARGE)
    for expected in ("100 core-hours", "2.50 TB", "10 hours", "56 Mbit/s", "180 cores", "720 cores"):
        assert expected in page
