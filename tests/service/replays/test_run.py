"""A run loses and doubles no row, whatever becomes of its workers, and goes on where it was."""

from __future__ import annotations

import os
import random
import signal
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

from service.cli.records.replay_progress import progress_line
from service.records.evidence import Flaw
from service.replays.errors import ReplayError
from service.replays.places import Place
from service.replays.rows import OF_THE_RUN, Row
from service.replays.run import Progress, Run
from service.replays.run_files import RunFiles
from service.replays.work import Done, JobName, Lost, Work, left_out
from service.replays.workers import Ended, Processes, Task, Workers
from tests.support.real_parts import CLUSTER, need_module
from tests.support.service.archives import write_archive

JOBS = 12
TERMS = {"set": []}
MEASURED: dict[JobName, Row] = {}  # once for all tests


@pytest.fixture(scope="module", autouse=True)
def parquet() -> None:
    """What tables are written with."""
    need_module("pyarrow", CLUSTER)


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Work:
    path = tmp_path_factory.mktemp("archives") / "cell-7"
    write_archive(path, JOBS)
    return Work((Place("cell-7", str(path)),))


def names(work: Work) -> list[JobName]:
    return [JobName(0, job, ended) for job, ended in sorted(work.places[0].jobs())]


def carried_out(work: Work, output: Path, workers: Workers, tell: Callable[[Progress], None]) -> list[Row]:
    with RunFiles(output, TERMS) as files:
        files.open(names(work))
        with workers:
            Run(work, files, workers, tell).carry_out()
        files.join({})
    return rows(output)


def rows(output: Path) -> list[Row]:
    """All rows, without what is another each time."""
    return [
        {key: value for key, value in row.items() if key not in OF_THE_RUN}
        for row in need_module("pyarrow.parquet", CLUSTER).read_table(output).to_pylist()
    ]


def quiet(_progress: Progress) -> None:
    """Nobody looks."""


@pytest.fixture(scope="module")
def alone(work: Work, tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    """The rows of one process, one job after the other: this one."""
    return carried_out(work, tmp_path_factory.mktemp("alone") / "rows.parquet", Played(work), quiet)


class Played:
    """Workers in this process, which fail as they are told to."""

    def __init__(self, work: Work, fails: Callable[[Task], bool] = lambda _: False) -> None:
        self._work = work
        self._fails = fails
        self._tasks: deque[Task] = deque()
        self.begun: list[Task] = []
        self.left_out: dict[str, str] = {}
        self.room = 3

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._tasks.clear()

    def begin(self, task: Task) -> None:
        self.begun.append(task)
        self._tasks.append(task)

    def ended(self, at_most_s: float) -> Ended | None:
        task = self._tasks.popleft()
        if self._fails(task):
            return Ended(task, None)
        for name in task.names:
            if name not in MEASURED:
                MEASURED[name] = self._work.row(name)
        return Ended(task, Done([{**MEASURED[name], "worker": "played"} for name in task.names], "played", 0.1, 50.0))


def test_the_table_has_each_job_once_by_number(alone: list[Row]) -> None:
    assert [row["job_id"] for row in alone] == list(range(1, JOBS + 1))
    assert all(row["identical"] for row in alone)


def test_two_processes_one_of_them_killed_at_random_moments_give_the_same_rows(
    work: Work, alone: list[Row], tmp_path: Path
) -> None:
    kills = 2
    moments = random.Random(18)

    def kill(progress: Progress) -> None:
        nonlocal kills
        if kills and progress.done >= 4 - kills and moments.random() < 0.8:
            kills -= 1
            victim = moments.choice([int(name.rpartition(":")[2]) for name in progress.workers])
            try:
                os.kill(victim, signal.SIGKILL)
            except ProcessLookupError:
                kills += 1  # it was killed before: another

    assert carried_out(work, tmp_path / "rows.parquet", Processes(work, 2), kill) == alone
    assert kills == 0


def test_a_run_that_is_broken_off_goes_on_where_it_was(work: Work, alone: list[Row], tmp_path: Path) -> None:
    output = tmp_path / "rows.parquet"

    def break_off(progress: Progress) -> None:
        if progress.done == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        carried_out(work, output, Played(work), break_off)
    assert not output.exists()
    (tmp_path / "rows.parquet.parts" / ".batch-0000007.parquet.new").write_bytes(b"cut short")
    again = Played(work)
    assert carried_out(work, output, again, quiet) == alone
    assert sorted(task.batch for task in again.begun) == list(range(5, JOBS))
    assert not (tmp_path / "rows.parquet.parts").exists()


def test_a_job_that_always_ends_its_worker_is_left_out_and_the_others_of_its_batch_are_not(
    work: Work, alone: list[Row], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.replays.run_files.BATCHES", 3)
    found = carried_out(
        work, tmp_path / "rows.parquet", Played(work, lambda task: any(name.job_id == 6 for name in task.names)), quiet
    )
    assert found[5]["left_out"] == Lost.WORKER_ENDED
    assert (found[5]["cell"], found[5]["job_id"]) == ("cell-7", 6)
    assert found[:5] + found[6:] == alone[:5] + alone[6:]


def test_a_storage_that_answers_later_is_asked_again_and_one_that_never_does_is_told(
    work: Work, alone: list[Row], tmp_path: Path
) -> None:
    class Unsteady(Played):
        def ended(self, at_most_s: float) -> Ended | None:
            found = super().ended(at_most_s)
            assert found is not None
            assert found.done is not None
            (name,) = found.task.names
            if name.job_id == 9 or (name.job_id == 2 and found.task.tries < 2):
                row = {**found.done.rows[0], **left_out(Flaw.STORAGE, "503")}
                return Ended(found.task, replace(found.done, rows=[row]))
            return found

    asked = Unsteady(work)
    found = carried_out(work, tmp_path / "rows.parquet", asked, quiet)
    assert [row["job_id"] for row in found if row["left_out"] is not None] == [9]
    assert found[1] == alone[1]
    assert [task.tries for task in asked.begun if task.names[0].job_id == 9] == [0, 1, 2]


def test_rows_of_another_run_stay_as_they_are(work: Work, alone: list[Row], tmp_path: Path) -> None:
    output = tmp_path / "rows.parquet"
    carried_out(work, output, Played(work), quiet)
    before = output.read_bytes()
    with pytest.raises(ReplayError, match=r"is of another run: set was \[\], is \['recipe"):
        RunFiles(output, {"set": ["recipe.tolerance_mm=1"]})
    output.write_bytes(b"PAR1 by somebody else")
    with pytest.raises(ReplayError, match="is no table of `combtrace replay`"):
        RunFiles(output, TERMS)
    output.write_bytes(before)
    with RunFiles(output, TERMS) as files:
        assert files.complete


def test_two_runs_do_not_write_one_table_at_a_time(work: Work, tmp_path: Path) -> None:
    with RunFiles(tmp_path / "rows.parquet", TERMS) as first, RunFiles(tmp_path / "rows.parquet", TERMS) as second:
        first.open(names(work))
        with pytest.raises(ReplayError, match="another run writes it"):
            second.open(names(work))


def test_a_run_that_another_has_ended_meanwhile_leaves_the_table(work: Work, alone: list[Row], tmp_path: Path) -> None:
    output = tmp_path / "rows.parquet"
    with RunFiles(output, TERMS) as late:
        assert carried_out(work, output, Played(work), quiet) == alone
        with pytest.raises(ReplayError, match="another run has ended meanwhile"):
            late.open([])
    assert rows(output) == alone


def test_parts_of_a_run_whose_plan_was_taken_away_are_not_taken_for_this_ones(work: Work, tmp_path: Path) -> None:
    with RunFiles(tmp_path / "rows.parquet", {"set": ["another"]}) as files:
        files.open(names(work))
        files.put(0, [{}] * files.size(0))
        (files.parts / "plan.parquet").unlink()
    with RunFiles(tmp_path / "rows.parquet", TERMS) as files:
        files.open(names(work))
        assert files.missing() == list(files.batches)


def test_a_damaged_part_is_named_and_done_again_once_it_is_deleted(
    work: Work, alone: list[Row], tmp_path: Path
) -> None:
    output = tmp_path / "rows.parquet"
    with RunFiles(output, TERMS) as files:
        files.open(names(work))
        part = files.parts / "batch-0000000.parquet"
        part.write_bytes(b"PAR1 but for a few bytes")
    with pytest.raises(ReplayError, match=r"batch-0000000.parquet: cannot be read: .*Delete it"):
        carried_out(work, output, Played(work), quiet)
    part.unlink()
    assert carried_out(work, output, Played(work), quiet) == alone


def test_a_run_without_a_worker_says_that_it_waits_for_one(work: Work, tmp_path: Path) -> None:
    class Late(Played):
        """There from the third look on."""

        def ended(self, at_most_s: float) -> Ended | None:
            looks.append(self.room)
            self.room = 3 if len(looks) > 2 else 0
            return super().ended(at_most_s) if self.begun else None

    looks: list[int] = []
    told: list[str] = []
    late = Late(work)
    late.room = 0
    carried_out(work, tmp_path / "rows.parquet", late, lambda progress: told.append(progress_line(progress, 0)))
    assert "0/12 jobs, no worker is there: waiting for one" in told[0]
    assert "no worker" not in told[-1]


def test_time_left_follows_the_pace_of_this_run_alone() -> None:
    progress = Progress(jobs=100, before=40, done=20, elapsed_s=10.0)
    assert progress.left_s == 20.0
    assert progress.jobs_a_second == 2.0
    assert Progress(jobs=100, before=40).left_s is None
