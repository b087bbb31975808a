"""What waits for a broker: in order, again after a loss, within its bound, and counted where it is let go."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from service.reasons import Outcome
from service.records.job import TriggerStamp
from service.records.journal import Journal
from service.telemetry.kept import KEPT_FILE, Kept, load_kept, save_kept
from service.telemetry.unsent import Changes, Jobs


def settled(journal: Journal, count: int) -> list[int]:
    numbers = []
    for _ in range(count):
        job = journal.take(TriggerStamp("manual"))
        journal.settle(job.job_id, Outcome.ACCEPTED, None, None)
        numbers.append(job.job_id)
    return numbers


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


def numbers(jobs: Jobs, most: int = 100) -> list[int]:
    return [job.job_id for job in jobs.unsent(most)]


def test_jobs_come_in_order_once_and_again_until_confirmed(path: Path) -> None:
    journal = Journal(path)
    done = settled(journal, 5)
    jobs = Jobs(path, 100, confirmed=0)
    assert numbers(jobs, 3) == done[:3]
    jobs.confirm(jobs.mark())
    assert numbers(jobs) == done[3:]
    assert numbers(jobs) == []
    jobs.again()
    assert numbers(jobs) == done[3:]
    assert (jobs.confirmed, jobs.dropped) == (done[2], 0)
    journal.close()


def test_no_job_is_told_before_one_that_is_still_executed(path: Path) -> None:
    journal = Journal(path)
    first = settled(journal, 1)
    running = journal.take(TriggerStamp("manual"))
    jobs = Jobs(path, 100, confirmed=0)
    assert numbers(jobs) == first
    journal.settle(running.job_id, Outcome.REFUSED, None, None)
    assert numbers(jobs) == [], "nobody has said that there is one"
    jobs.due = True
    assert numbers(jobs) == [running.job_id]
    journal.close()


def test_of_more_jobs_than_are_kept_the_oldest_go_and_are_counted_once(path: Path) -> None:
    journal = Journal(path)
    done = settled(journal, 12)
    jobs = Jobs(path, 5, confirmed=0)
    assert numbers(jobs) == done[-5:]
    jobs.again()
    assert numbers(jobs) == done[-5:]
    assert jobs.dropped == 7
    journal.close()


def test_a_damaged_row_keeps_no_other_job_back(path: Path) -> None:
    journal = Journal(path)
    done = settled(journal, 3)
    journal.close()
    with sqlite3.connect(path) as database:
        database.execute("UPDATE jobs SET report = '{' WHERE job_id = ?", (done[1],))
    database.close()
    jobs = Jobs(path, 100, confirmed=0)
    assert numbers(jobs) == [done[0], done[2]]


def test_without_a_journal_there_is_nothing_to_tell(path: Path) -> None:
    assert numbers(Jobs(path, 100, confirmed=0)) == []


def test_changes_come_in_order_once_and_again_until_confirmed() -> None:
    changes = Changes(100)
    for at_ms in range(5):
        changes.add(at_ms, {})
    assert [one.at_ms for one in changes.unsent(3)] == [0, 1, 2]
    changes.confirm(changes.mark())
    assert [one.at_ms for one in changes.unsent(100)] == [3, 4]
    changes.again()
    assert [one.at_ms for one in changes.unsent(100)] == [3, 4]
    assert changes.dropped == 0


def test_of_more_changes_than_are_kept_the_oldest_go_and_are_counted_once() -> None:
    changes = Changes(3)
    for at_ms in range(10):
        changes.add(at_ms, {})
    for _ in range(2):
        assert [one.at_ms for one in changes.unsent(100)] == [7, 8, 9]
        assert changes.dropped == 7
        changes.again()


def test_what_is_remembered_is_read_again_and_nonsense_is_begun_anew(tmp_path: Path) -> None:
    kept = Kept(7, 41)
    assert kept.first_seen("version", "1", 100) == kept.first_seen("version", "1", 200) == 100
    assert kept.first_seen("version", "2", 300) == 300
    save_kept(tmp_path, kept)
    assert load_kept(tmp_path) == kept
    for nonsense in ("", "[]", '{"births": "x"}', '{"births": 1, "confirmed": 1, "since": {"a": 1}}'):
        (tmp_path / KEPT_FILE).write_text(nonsense)
        assert load_kept(tmp_path) == Kept()
