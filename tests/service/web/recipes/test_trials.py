"""One try at a time: its bounds in time and jobs, and what becomes of it when its process dies."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from multiprocessing import active_children
from pathlib import Path

import pytest

from service.config.recipe_keys import with_values
from service.config.recipes import Recipe
from service.daemon.control import CommandRefused
from service.reasons import Outcome
from service.records.job import Progress, Terms, TriggerStamp
from service.records.journal import Journal
from service.web.recipes.models import TrialState, TriedJob
from service.web.recipes.trial import Drawn
from service.web.recipes.trials import MOST_DRAWN_BYTES, Asked, Trials, _Run, last_jobs
from tests.support.processes.processes import until

RECIPE = Recipe(number=1, name="sheet")
CHANGED = with_values(RECIPE, {"tolerance_mm": 0.5})


def asked(count: int) -> Asked:
    """A try on jobs of which nothing is kept."""
    return Asked(RECIPE, CHANGED, tuple(range(1, count + 1)), "anna")


@pytest.fixture
def trials(tmp_path: Path) -> Iterator[Trials]:
    built = Trials(tmp_path)
    yield built
    built.close()
    until(lambda: (state := built.state()) is None or (state.state != "running" and not active_children()), what="end")


def ended(trials: Trials) -> TrialState:
    found = until(lambda: (state := trials.state()) and state.state != "running" and state, what="the end of a try")
    assert isinstance(found, TrialState)
    return found


def test_jobs_that_cannot_be_measured_again_are_left_out_and_nothing_is_adopted_by_them(trials: Trials) -> None:
    number = trials.begin(asked(2))
    state = ended(trials)
    assert (state.state, state.jobs, [one.job_id for one in state.left_out]) == ("done", [], [1, 2])
    assert "holds nothing of job 1" in state.left_out[0].why
    with pytest.raises(CommandRefused, match="not be tried on one job"):
        trials.tried(number)
    with pytest.raises(CommandRefused, match="not the last recipe that was tried"):
        trials.tried(number + 1)
    assert trials.begin(asked(1)) > number
    ended(trials)


def test_drawings_are_kept_as_long_as_there_is_room() -> None:
    run = _Run(1, asked(3))
    for number in range(3):
        job = TriedJob(
            job_id=number,
            taken_at="2026-11-23T12:00:00+00:00",
            code_before=0,
            code_after=0,
            text=None,
            flipped=False,
            distance=0.0,
            unit="mm",
            area_mm2_before=1.0,
            area_mm2_after=1.0,
        )
        run.add(Drawn(job, bytes(MOST_DRAWN_BYTES // 2)))
    assert [one.job_id for one in run.jobs] == [0, 1, 2]
    assert list(run.drawn) == [0, 1]


def test_a_try_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    trials = Trials(tmp_path, longest_s=0.01)
    number = trials.begin(asked(10**6))
    assert ended(trials).state == "too_long"
    with pytest.raises(CommandRefused, match="has not come to its end"):
        trials.tried(number)
    until(lambda: not active_children(), what="the end of its process")


def test_a_process_that_is_killed_is_told_and_the_next_try_begins_anew(trials: Trials) -> None:
    trials.begin(asked(10**6))
    (process,) = until(active_children, what="its process")
    with pytest.raises(CommandRefused, match="anna tries a recipe at this moment"):
        trials.begin(asked(1))
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    assert ended(trials).state == "failed"
    trials.begin(asked(1))
    assert ended(trials).state == "done"


def test_numbers_of_before_a_restart_never_come_again(tmp_path: Path) -> None:
    first, then = Trials(tmp_path), Trials(tmp_path)
    number = first.begin(asked(1))
    ended(first)
    time.sleep(0.002)
    assert then.begin(asked(1)) > number
    ended(then)
    until(lambda: not active_children(), what="the end of their processes")


def test_a_recipes_last_jobs_are_found_among_others_newest_first(tmp_path: Path) -> None:
    journal, archive = Journal(tmp_path / "journal.sqlite", otherwise_from=100), tmp_path / "archive"
    (archive / "0000000xxx").mkdir(parents=True)
    for turn in range(9):
        job = journal.take(TriggerStamp("page"))
        terms = Terms({"number": 1 + turn % 3}) if turn else None
        journal.settle(job.job_id, Outcome.REFUSED, None, None, Progress(terms))
        if turn != 6:
            (archive / "0000000xxx" / f"{job.job_id}-refused.json").touch()
    journal.close()
    path = tmp_path / "journal.sqlite"
    assert last_jobs(path, archive, 2, 50) == (107, 104, 101)
    assert last_jobs(path, archive, 2, 2) == (107, 104)
    assert last_jobs(path, archive, 1, 50) == (103,)
    assert last_jobs(path, archive, 9, 50) == ()
