"""Whole archives done again from the command line: from a bucket, on a cluster, against another version."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from service.replays.rows import OF_THE_RUN
from tests.support.processes.processes import COMBTRACE, ENVIRONMENT, called, combtrace, until
from tests.support.real_parts import CLUSTER, need_module
from tests.support.service.archives import changed_document, frame_of, write_archive
from tests.support.service.bucket_server import BUCKET, bucket
from tests.support.service.dask_cluster import cluster

JOBS = 12
DAMAGED = {3: "frame_damaged", 8: "later_version"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Good jobs and two that cannot be done."""
    need_module("pyarrow", CLUSTER)
    path = tmp_path_factory.mktemp("archives") / "cell-7"
    write_archive(path, JOBS)
    frame = frame_of(path, 3)
    frame.write_bytes(frame.read_bytes()[:400])
    changed_document(path, 8, version=2)
    return path


@pytest.fixture(scope="module")
def serial(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The table that one process wrote from the folder."""
    output = tmp_path_factory.mktemp("serial") / "rows.parquet"
    done = called("replay", "--archive", archive, "--output", output)
    assert done.returncode == 2, done.stderr
    return output


def rows(output: Path) -> list[dict[str, Any]]:
    """The rows, without what is another each time, and without where a message says that a file lies."""
    found = need_module("pyarrow.parquet", CLUSTER).read_table(output).to_pylist()
    return [{key: row[key] for key in row if key not in (*OF_THE_RUN, "left_out_text")} for row in found]


def test_damaged_jobs_among_good_ones_are_counted_by_kind_and_in_the_exit_status(archive: Path, serial: Path) -> None:
    found = rows(serial)
    assert {row["job_id"]: row["left_out"] for row in found if row["left_out"] is not None} == DAMAGED
    assert all(row["identical"] for row in found if row["left_out"] is None)
    told = called("replay", "--archive", archive, "--output", serial)
    assert told.returncode == 2
    assert f"{serial}: is whole, and told as it is. To have all done again, delete it" in told.stderr
    for kind in DAMAGED.values():
        assert f"left out: 1 {kind}, e.g. cell-7 " in told.stderr
    assert f"{JOBS} jobs, 0 not as before" in told.stdout


def test_a_bucket_that_fails_now_and_then_gives_the_same_rows(archive: Path, serial: Path, tmp_path: Path) -> None:
    with bucket(archive, fails_every=4) as variables:
        done = combtrace(
            *("replay", "--archive", f"s3://{BUCKET}/cell-7", "--output", tmp_path / "rows.parquet"),
            variables=variables,
        )
    assert done.returncode == 2, done.stderr
    assert rows(tmp_path / "rows.parquet") == rows(serial)


def test_a_cluster_gives_the_same_rows_with_a_worker_killed_and_one_of_another_opencv_left_out(
    archive: Path, serial: Path, tmp_path: Path
) -> None:
    output = tmp_path / "rows.parquet"
    with cluster(tmp_path) as dask:
        words = ["replay", "--archive", str(archive), "--output", str(output), "--scheduler", dask.url]
        dask.add_worker(another_opencv=True)
        alone = combtrace(*words)
        assert alone.returncode == 2
        assert "no worker has the versions of here" in alone.stderr
        workers = [dask.add_worker() for _ in range(2)]
        with subprocess.Popen([*COMBTRACE, *words], stderr=subprocess.PIPE, env=ENVIRONMENT, text=True) as run:
            until(lambda: list(tmp_path.glob("*.parts/batch-*")) or output.exists(), what="the first rows")
            workers[0].kill()
            _, said = run.communicate(timeout=120)
    assert run.returncode == 2, said
    assert rows(output) == rows(serial)
    assert "opencv 4.13.0, expected combtrace" in said


def test_against_this_very_version_nothing_differs_and_conditions_pass(archive: Path, tmp_path: Path) -> None:
    environment = tmp_path / "environment"
    (environment / "bin").mkdir(parents=True)
    (environment / "bin" / "python").write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    (environment / "bin" / "python").chmod(0o755)
    done = called(
        *("replay", "1", "2", "5", "--archive", archive, "--output", tmp_path / "rows.parquet"),
        *("--against", environment, "--fail-on", "changed>0", "--report", tmp_path / "report.html"),
    )
    assert done.returncode == 0, done.stderr
    assert "passes changed>0: changed is 0" in done.stderr
    assert "environment" in (tmp_path / "report.html").read_text()
    failing = called(
        *("replay", "1", "2", "5", "--archive", archive, "--output", tmp_path / "rows.parquet"),
        *("--against", environment, "--fail-on", "jobs>=3"),
    )
    assert failing.returncode == 3
    assert "FAILS jobs>=3: jobs is 3" in failing.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--workers", "2"), "--workers needs --output FILE.parquet"),
        (("--fail-on", "flips>0"), "--fail-on needs --output"),
        (("--output", "rows.csv"), "expected a file that ends in .parquet"),
        (("--output", "r.parquet", "--json"), "exclude each other"),
        (("--output", "r.parquet", "--workers", "0"), "'0' is no number of processes"),
        (("--output", "r.parquet", "--workers", "2", "--scheduler", "tcp://x:1"), "exclude each other"),
        (("--output", "r.parquet", "--archive", "nowhere"), "nowhere: cannot be listed: No such file"),
        (("--output", "r.parquet", "--archive", "odd://x"), "odd://x: Protocol not known: odd"),
        (("--output", "r.parquet", "--archive", "s3://me:word@plant/a"), "an address with a user or password"),
        (("--output", "r.parquet", "--archive", "a", "--archive", "b/a"), "there is a cell 'a' already"),
        (("--output", "r.parquet", "--archive", "a", "--since", "1d"), "those are for a journal"),
        (("--output", "r.parquet", "--archive", "a", "--limit", "-1"), "--limit -1: expected 0 or more"),
        (("--output", "r.parquet", "--archive", "a"), "no jobs: the archives hold none"),
        (("--output", "r.parquet", "--archive", "a", "--fail-on", "flip>0"), "did you mean flips?"),
        (("--output", "r.parquet", "--archive", "a", "--against", "nowhere"), "expected a wheel (.whl) or the folder"),
        (("--output", "r.parquet", "--archive", "a", "--against", __file__), "expected a wheel (.whl) or the folder"),
    ],
)
def test_a_wrong_question_is_answered_by_what_is_expected(
    words: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a").mkdir()
    answer = called("replay", *words)
    assert answer.returncode == 2
    assert told in answer.stderr
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("pyarrow", ("--archive", "a")),
        ("fsspec.core", ("--archive", "s3://plant/a")),
        ("distributed", ("--archive", "{archive}", "--scheduler", "tcp://127.0.0.1:9")),
    ],
)
def test_without_the_extra_it_says_how_to_install_it(
    module: str, words: tuple[str, ...], archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    given = [word.format(archive=archive) for word in words]
    answer = called("replay", "--output", tmp_path / "rows.parquet", *given)
    assert answer.returncode == 2
    assert "which is not here. Install: pip install 'combtrace[cluster]'" in answer.stderr


@pytest.mark.parametrize("address", ["somewhere://x", "nonsense"])
def test_without_a_scheduler_it_says_what_was_expected(
    address: str, archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed = need_module("distributed", CLUSTER)
    # It would wait 20 s at its end for what it never began.
    monkeypatch.setattr(distributed, "Client", lambda *_, **__: pytest.fail("a client of a scheduler that cannot be"))
    words = ("--archive", archive, "--output", tmp_path / "rows.parquet", "--scheduler", address)
    answer = called("replay", *words)
    assert answer.returncode == 2
    assert "no Dask scheduler answers there" in answer.stderr
