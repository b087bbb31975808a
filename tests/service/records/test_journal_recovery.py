"""A journal that is lost or damaged: nothing of it is thrown away, and no job number comes twice."""

from __future__ import annotations

import logging
import os
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.controller.mailbox.pages import Page
from service.reasons import Outcome
from service.records.job import Progress, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalDamaged, JournalError
from service.records.journal_reader import JobFilter, JournalUnreadable, reading
from service.records.journal_recovery import _move_aside, highest_archived, highest_job, open_journal, set_aside
from tests.support.service.journal_files import changed

PAGE = Page((1, 0, 7, 1, 1, 1, 4, *[0] * 24), (1, 2, 3, 4))
UNIX_S = 1_795_000_000


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where the journal is to lie."""
    return tmp_path / "journal.sqlite"


def filled(path: Path, jobs: int) -> None:
    """A journal of `jobs` settled jobs, then one of the controller's in flight, closed as after a clean stop."""
    journal = Journal(path)
    long = Progress(report={"text": "x" * 300})
    for _ in range(jobs):
        journal.settle(journal.take(TriggerStamp("serial")).job_id, Outcome.ACCEPTED, None, None, long)
    job = journal.take(TriggerStamp("controller", session=9, counter=5))
    journal.store_pages(job.job_id, 9, (PAGE,))
    journal.close()


def reopened(path: Path, *, ran_before: bool = True) -> Journal:
    return open_journal(path, path.parent / "archive", ran_before=ran_before, now=lambda: UNIX_S)


def test_a_sound_journal_is_opened_as_it_is(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    filled(path, 3)
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial")).job_id == 5
    journal.close()
    assert caplog.records == []


def test_the_first_journal_of_all_begins_with_job_1(tmp_path: Path) -> None:
    journal = reopened(tmp_path / "journal.sqlite", ran_before=False)
    assert journal.take(TriggerStamp("serial")).job_id == 1
    journal.close()


def test_a_lost_journal_begins_at_the_unix_time_and_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    journal = reopened(tmp_path / "journal.sqlite")
    assert journal.take(TriggerStamp("serial")).job_id == UNIX_S
    assert journal.take(TriggerStamp("serial")).job_id == UNIX_S + 1
    journal.close()
    (record,) = caplog.records
    assert record.levelno == logging.CRITICAL
    assert "the journal is lost" in record.message


def test_an_emptied_file_is_a_lost_journal(path: Path) -> None:
    path.touch()
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial")).job_id == UNIX_S
    journal.close()


def test_a_lost_journal_goes_on_above_the_controllers_last_job(tmp_path: Path) -> None:
    journal = reopened(tmp_path / "journal.sqlite")
    assert journal.take(TriggerStamp("serial"), above=41).job_id == 42
    journal.close()


def test_what_was_moved_aside_counts_also_where_the_controller_knows_less(path: Path) -> None:
    filled(path, 60)
    path.write_bytes(bytes(100) + path.read_bytes()[100:])
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial"), above=5).job_id == 62
    journal.close()


def test_a_lost_journal_goes_on_above_the_archive(tmp_path: Path) -> None:
    for name in ("17", "18.json", "notes.txt", "0", "99999999999"):
        (tmp_path / "archive" / "2026" / name).mkdir(parents=True)
    assert highest_archived(tmp_path / "archive") == 2026
    (tmp_path / "archive" / "2027-contour.json").touch()
    journal = reopened(tmp_path / "journal.sqlite")
    assert journal.take(TriggerStamp("serial")).job_id == 2028
    journal.close()


@pytest.mark.parametrize(
    "damage",
    ["header gone", "middle gone", "cut off", "all but the last page gone"],
)
def test_a_damaged_journal_is_moved_aside_whole_and_numbers_go_on_above_it(
    path: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    filled(path, 60)
    content = bytearray(path.read_bytes())
    if damage == "header gone":
        content[:100] = bytes(100)
    elif damage == "middle gone":
        content[4096 * 2 : 4096 * 3] = b"\xa5" * 4096
    elif damage == "cut off":
        del content[len(content) - 4096 :]
    else:
        content[: len(content) - 4096] = b"\xa5" * (len(content) - 4096)
    path.write_bytes(content)
    with pytest.raises(JournalDamaged):
        Journal(path)
    journal = reopened(path)
    (kept,) = set_aside(path)
    assert kept.read_bytes() == content
    job = journal.take(TriggerStamp("serial"))
    assert job.job_id == 62 if damage != "cut off" else job.job_id > 30
    journal.close()
    assert [record.levelno for record in caplog.records if record.levelno > logging.INFO] == [logging.CRITICAL]


class Killed(BaseException):
    """The end of the process."""


@pytest.mark.parametrize("steps", range(4))
def test_killed_while_it_is_moved_aside_nothing_is_lost_and_no_number_comes_twice(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, steps: int
) -> None:
    filled(path, 60)
    content, wal = bytes(100) + path.read_bytes()[100:], b"\xa5" * 100
    path.write_bytes(content)
    path.with_name("journal.sqlite-wal").write_bytes(wal)
    left = steps

    def step(act: Callable[..., None]) -> Callable[..., None]:
        def counted(*args: object, **more: object) -> None:
            nonlocal left
            if left == 0:
                raise Killed
            left -= 1
            act(*args, **more)

        return counted

    with monkeypatch.context() as patched:
        patched.setattr(os, "link", step(os.link))
        patched.setattr(Path, "unlink", step(Path.unlink))
        with pytest.raises(Killed):
            _move_aside(path, UNIX_S)
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial")).job_id == 62
    journal.close()
    kept = set_aside(path)[-1]
    assert kept.read_bytes() == content
    assert "damaged" in caplog.text
    if steps >= 2:  # before that SQLite itself puts a log away that is none
        assert kept.with_name(kept.name + "-wal").read_bytes() == wal


def test_what_had_not_ended_is_brought_over_where_it_can_be_read(path: Path) -> None:
    filled(path, 60)
    content = bytearray(path.read_bytes())
    # An index that says nothing true: SQLite's check finds it, its rows are still there.
    root = next(
        page
        for page in range(2, len(content) // 4096)
        if content[page * 4096] == 0x0A and content[page * 4096 + 4] == 1
    )
    content[root * 4096 + 4] = 0
    path.write_bytes(content)
    journal = reopened(path)
    in_flight = journal.unsettled()
    if in_flight:  # the damaged index may be the one that the query uses
        assert [(job.job_id, job.pages, job.session) for job in in_flight] == [(61, (PAGE,), 9)]
    assert journal.take(TriggerStamp("serial")).job_id == 62
    journal.close()


def test_the_last_trigger_is_not_taken_again_after_a_journal_was_brought_over(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    journal.restore([(61, "2026-11-21T08:00:00", "controller", None, 9, 5, 0, 0, None, None, None, None)], (9, 5))
    assert journal.last_controller_trigger() == (9, 5)
    assert [job.job_id for job in journal.unsettled()] == [61]
    journal.close()


@pytest.mark.parametrize(
    "damage",
    [
        "UPDATE jobs SET reason = 999 WHERE job_id = 3",
        "UPDATE jobs SET report = '{broken' WHERE job_id = 3",
        "UPDATE jobs SET report = '[1]' WHERE job_id = 3",
        "UPDATE jobs SET settled_at = 'yesterday' WHERE job_id = 3",
        "UPDATE jobs SET withdraw_reason = 5 WHERE job_id = 4",
        "UPDATE jobs SET taken_at = 'yesterday' WHERE job_id = 4",
        "ALTER TABLE jobs DROP COLUMN transfer",
        "DELETE FROM meta",
        "UPDATE meta SET value = 'nobody' WHERE key = 'owner'",
        "UPDATE meta SET value = '99999999' WHERE key = 'owner'",
        "PRAGMA user_version = 0",
    ],
)
def test_content_that_no_journal_can_hold_is_damage_though_the_database_is_sound(
    path: Path, damage: str, caplog: pytest.LogCaptureFixture
) -> None:
    filled(path, 3)
    changed(path, damage)
    journal = reopened(path)
    assert [(job.job_id, job.pages, job.session) for job in journal.unsettled()] == [(4, (PAGE,), 9)]
    assert journal.last_controller_trigger() == (9, 5)
    assert journal.take(TriggerStamp("serial")).job_id == 5
    journal.close()
    assert len(set_aside(path)) == 1
    assert any(record.levelno == logging.CRITICAL and "is damaged (" in record.message for record in caplog.records)


def test_a_detail_that_is_no_text_any_more_is_no_reason_to_begin_anew(path: Path) -> None:
    filled(path, 3)
    changed(path, "UPDATE jobs SET detail = CAST(x'e4' AS TEXT) WHERE job_id = 3")
    journal = reopened(path)
    last = journal.last_settled()
    assert last is not None
    assert last.detail == "�"
    journal.close()
    assert set_aside(path) == []


def test_a_damaged_row_of_long_ago_is_left_out_of_lists_and_told(path: Path) -> None:
    filled(path, 3)
    changed(path, "UPDATE jobs SET reason = 999 WHERE job_id = 2")
    reopened(path).close()
    assert set_aside(path) == []
    with reading(path) as reader:
        assert [job.job_id for job in reader.jobs(JobFilter())] == [1, 3, 4]
        assert reader.damaged == ["job 2 in it cannot be read: 999 is not a valid Reason"]
        with pytest.raises(JournalUnreadable, match="job 2 in it cannot be read"):
            reader.find(2)


@pytest.mark.parametrize("table", ["customers", "jobs"])
def test_another_programs_database_is_refused_and_stays_as_it_is(path: Path, table: str) -> None:
    changed(path, f"CREATE TABLE {table} (name)", f"INSERT INTO {table} VALUES ('kept')")
    before = path.read_bytes()
    with pytest.raises(JournalError, match=rf"a database of another program \(tables {table}\)"):
        reopened(path)
    assert path.read_bytes() == before
    assert set_aside(path) == []


def test_a_pipe_or_folder_is_no_journal_and_holds_nobody_up(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for name in ("pipe", "folder"):
        with pytest.raises(JournalError, match="is no file"):
            reopened(tmp_path / name)
        with pytest.raises(JournalUnreadable, match="is no file"), reading(tmp_path / name):
            pass


def test_a_damaged_journal_without_any_number_begins_at_the_unix_time(path: Path) -> None:
    path.write_bytes(b"\xa5" * 9000)
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial")).job_id == UNIX_S
    journal.close()


def test_a_strange_file_where_the_service_never_ran_is_refused_and_stays(path: Path) -> None:
    path.write_bytes(b"somebody's notes" * 100)
    with pytest.raises(JournalDamaged):
        reopened(path, ran_before=False)
    assert path.read_bytes() == b"somebody's notes" * 100


def test_a_second_loss_remembers_what_was_moved_aside_at_the_first(path: Path) -> None:
    filled(path, 40)
    path.write_bytes(bytes(100) + path.read_bytes()[100:])
    reopened(path).close()
    for part in ("", "-wal", "-shm"):
        path.with_name(path.name + part).unlink(missing_ok=True)
    journal = reopened(path)
    assert journal.take(TriggerStamp("serial")).job_id == 42
    journal.close()


def test_two_journals_moved_aside_in_one_second_of_a_clock_that_went_back_are_both_kept(path: Path) -> None:
    contents = []
    for jobs in (3, 40):
        path.unlink(missing_ok=True)
        filled(path, jobs)
        changed(path, "DELETE FROM meta")
        contents.append(path.read_bytes())
        reopened(path).close()
    assert sorted(kept.read_bytes() for kept in set_aside(path)) == sorted(contents)


def test_numbers_that_stand_in_the_write_ahead_log_alone_are_found(tmp_path: Path, path: Path) -> None:
    journal = Journal(path)
    for _ in range(5):
        journal.take(TriggerStamp("serial"))
    copy = tmp_path / "copy.sqlite"
    copy.write_bytes(b"\xa5" * 8192)
    copy.with_name("copy.sqlite-wal").write_bytes(path.with_name("journal.sqlite-wal").read_bytes())
    journal.close()
    assert highest_job(copy) == 5


@given(st.binary(max_size=9000))
@settings(max_examples=200)
def test_no_damage_makes_the_search_for_numbers_fail(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("damaged") / "journal.sqlite"
    path.write_bytes(b"\x0d" + content)
    assert highest_job(path) == 0


@pytest.mark.parametrize("last", [0xFFFFFFFF, 0xFFFFFFFF + 5])
def test_after_the_last_number_that_a_register_holds_no_job_is_taken(tmp_path: Path, last: int) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    with pytest.raises(JournalError, match="the last number that a register can hold"):
        journal.take(TriggerStamp("serial"), above=last)
    journal.close()


def test_a_locked_or_unreadable_file_is_no_damaged_one(path: Path) -> None:
    filled(path, 1)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("PRAGMA locking_mode = EXCLUSIVE")
    other.execute("BEGIN EXCLUSIVE")
    try:
        with pytest.raises(JournalError) as locked:
            reopened(path)
        assert not isinstance(locked.value, JournalDamaged)
        assert set_aside(path) == []
    finally:
        other.close()
