"""The journal keeps what it promised: durable jobs, ids that rise, one settlement each."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from drivers.controller.mailbox.pages import Page
from service.reasons import Outcome, Reason
from service.records.job import Progress, Terms, TriggerStamp
from service.records.journal import Journal, JournalConflict
from service.records.journal_file import JournalError, JournalFull
from service.records.journal_reader import reading
from tests.support.service.journal_files import changed

PAGE = Page(tuple(range(31)), (1, 2, 3, 4, 0xFFFF, 0))


@pytest.fixture
def journal(tmp_path: Path):
    opened = Journal(tmp_path / "var" / "journal.sqlite")
    yield opened
    opened.close()


def test_job_ids_rise_above_the_journal_and_above_what_the_controller_knows(journal: Journal) -> None:
    assert journal.take(TriggerStamp("interval")).job_id == 1
    assert journal.take(TriggerStamp("interval"), above=400).job_id == 401
    assert journal.take(TriggerStamp("interval"), above=7).job_id == 402


def test_a_job_ends_whatever_characters_its_detail_holds(journal: Journal) -> None:
    job = journal.take(TriggerStamp("interval"))
    assert journal.settle(job.job_id, Outcome.FAILED, Reason.NO_FRAME, "bild-\udce4.png").detail == "bild-\\udce4.png"


def test_a_taken_job_is_unsettled_until_it_is_settled(journal: Journal) -> None:
    job = journal.take(TriggerStamp("serial", recipe=3))
    assert [found.job_id for found in journal.unsettled()] == [job.job_id]
    settled = journal.settle(
        job.job_id, Outcome.REFUSED, Reason.NO_BLOCK_FOUND, "empty", Progress(report={"total_ms": 1.5})
    )
    assert (settled.outcome, settled.reason, settled.detail) == (Outcome.REFUSED, Reason.NO_BLOCK_FOUND, "empty")
    assert settled.report == {"total_ms": 1.5}
    assert journal.unsettled() == ()
    assert journal.last_settled() == settled


def test_a_job_settles_once(journal: Journal) -> None:
    job = journal.take(TriggerStamp("serial"))
    journal.settle(job.job_id, Outcome.ACCEPTED, None, None)
    with pytest.raises(JournalConflict, match="has ended already"):
        journal.settle(job.job_id, Outcome.FAILED, Reason.EXPIRED, "late")
    found = journal.find(job.job_id)
    assert found is not None
    assert found.outcome is Outcome.ACCEPTED


def test_pages_come_back_register_for_register(journal: Journal) -> None:
    job = journal.take(TriggerStamp("controller", 2, 20_000, session=9, counter=5))
    journal.store_pages(job.job_id, 9, (PAGE, PAGE))
    (found,) = journal.unsettled()
    assert found.pages == (PAGE, PAGE)
    assert found.session == 9
    assert found.sent
    assert found.trigger == TriggerStamp("controller", 2, 20_000, 9, 5)


def test_the_first_reason_of_a_withdrawal_stands(journal: Journal) -> None:
    job = journal.take(TriggerStamp("serial"))
    journal.store_withdrawal(job.job_id, Reason.EXPIRED)
    journal.store_withdrawal(job.job_id, Reason.CONTROLLER_TIMEOUT)
    assert journal.unsettled()[0].withdraw_reason is Reason.EXPIRED


def test_the_controllers_last_trigger_is_that_of_the_newest_job_it_asked_for(journal: Journal) -> None:
    assert journal.last_controller_trigger() == (0, 0)
    journal.take(TriggerStamp("controller", session=9, counter=5))
    journal.take(TriggerStamp("serial"))
    assert journal.last_controller_trigger() == (9, 5)


def test_owner_is_drawn_once_and_is_not_zero(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    first = Journal(path)
    owner = first.owner
    first.close()
    again = Journal(path)
    assert again.owner == owner
    assert 1 <= owner <= 0xFFFF
    again.close()


def test_a_killed_process_leaves_its_taken_job_behind(tmp_path: Path) -> None:
    """kill -9 right after `take` returned: the job is there. (A power cut needs a real disk.)"""
    path = tmp_path / "journal.sqlite"
    code = f"""
        import os
        from pathlib import Path
        from service.records.job import TriggerStamp
        from service.records.journal import Journal
        job = Journal(Path({str(path)!r})).take(TriggerStamp("serial", recipe=4))
        print(job.job_id, flush=True)
        os.kill(os.getpid(), 9)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False)
    assert done.returncode == -9, done.stderr
    journal = Journal(path)
    (job,) = journal.unsettled()
    journal.close()
    assert str(job.job_id) == done.stdout.strip()
    assert job.trigger.recipe == 4


def test_every_commit_reaches_the_disk(journal: Journal) -> None:
    """WAL without synchronous=FULL (2) would lose the last commits at a power cut."""
    assert journal._file.db.execute("PRAGMA journal_mode").fetchone()[0] == "wal"
    assert journal._file.db.execute("PRAGMA synchronous").fetchone()[0] == 2


def test_a_file_that_is_no_journal_is_an_error_and_stays_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    path.write_bytes(b"not a database, but somebody's notes" * 40)
    before = path.read_bytes()
    with pytest.raises(JournalError, match=r"journal\.sqlite: cannot use the journal"):
        Journal(path)
    assert path.read_bytes() == before


def test_a_journal_of_another_version_is_refused_by_its_number(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    Journal(path).close()
    changed(path, "PRAGMA user_version = 99")
    with pytest.raises(JournalError, match="schema version 99, expected 1 to 5"):
        Journal(path)


def test_a_path_below_a_file_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(JournalError, match="cannot use the journal"):
        Journal(tmp_path / "file" / "journal.sqlite")


def test_a_commit_that_fails_leaves_nothing_begun_and_invents_no_job(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    journal._file.db.executescript(
        "PRAGMA foreign_keys = ON;"
        "CREATE TABLE late (job INTEGER REFERENCES jobs (job_id) DEFERRABLE INITIALLY DEFERRED);"
        "CREATE TEMP TRIGGER fail AFTER INSERT ON jobs BEGIN INSERT INTO late VALUES (999); END;"
    )
    with pytest.raises(JournalError, match="FOREIGN KEY"):
        journal.take(TriggerStamp("serial"))
    journal._file.db.execute("DROP TRIGGER fail")
    assert journal.last_taken() is None
    assert journal.take(TriggerStamp("serial")).job_id == 1
    assert [job.job_id for job in journal.unsettled()] == [1]
    journal.close()


def test_a_full_disk_is_called_so_and_the_journal_works_again_once_there_is_room(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "journal.sqlite")
    pages = journal._file.db.execute("PRAGMA page_count").fetchone()[0]
    journal._file.db.execute(f"PRAGMA max_page_count = {pages}")

    def fill() -> None:
        while True:
            job = journal.take(TriggerStamp("serial"))
            journal.settle(job.job_id, Outcome.ACCEPTED, None, None, Progress(report={"x": "y" * 500}))

    with pytest.raises(JournalFull, match="disk is full"):
        fill()
    journal._file.db.execute("PRAGMA max_page_count = 1000000")
    before = journal.last_taken()
    assert journal.take(TriggerStamp("serial")).job_id == (before.job_id if before else 0) + 1
    journal.close()


def test_a_job_is_settled_and_read_back_in_one_step(journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Were its reading to fail after the commit, trying again would meet a job that has ended already."""
    job = journal.take(TriggerStamp("serial"))

    def unreadable(*_: object) -> None:
        raise JournalError("disk I/O error")

    monkeypatch.setattr(journal, "_jobs", unreadable)
    assert journal.settle(job.job_id, Outcome.ACCEPTED, None, None).outcome is Outcome.ACCEPTED


@pytest.mark.parametrize("stored", ["no hexadecimal digits", "0001", "0" * 4 * 40, ""])
def test_pages_that_cannot_be_read_any_more_are_none(journal: Journal, stored: str) -> None:
    """A damaged disk may change a text that SQLite does not check; the job must be found all the same."""
    job = journal.take(TriggerStamp("serial"))
    journal.store_pages(job.job_id, 9, (PAGE,))
    journal._file.db.execute("UPDATE jobs SET pages = ?", (stored,))
    (found,) = journal.unsettled()
    assert (found.pages, found.sent) == ((), True)


# --- versions ---------------------------------------------------------------------------------------------------

VERSION_1 = """
PRAGMA journal_mode = WAL;
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE jobs (
    job_id INTEGER PRIMARY KEY CHECK (job_id > 0),
    taken_at TEXT NOT NULL,
    trigger_kind TEXT NOT NULL,
    trigger_session INTEGER,
    trigger_counter INTEGER,
    recipe INTEGER NOT NULL,
    thickness_um INTEGER NOT NULL,
    session INTEGER,
    pages TEXT,
    withdraw_reason INTEGER,
    outcome TEXT CHECK (outcome IN ('accepted', 'written', 'refused', 'failed')),
    reason INTEGER,
    detail TEXT,
    settled_at TEXT,
    report TEXT
) STRICT;
CREATE INDEX jobs_unsettled ON jobs (job_id) WHERE outcome IS NULL;
CREATE INDEX jobs_by_controller ON jobs (job_id) WHERE trigger_counter IS NOT NULL;
INSERT INTO meta VALUES ('owner', '4711'), ('above', '0'), ('otherwise_from', '1'), ('adopted_job', '3');
INSERT INTO jobs VALUES (5, '2026-01-02T03:04:05.678+00:00', 'controller', 9, 6, 2, 20000, 9, NULL, NULL,
    'refused', 110, 'empty', '2026-01-02T03:04:06.000+00:00', '{"total_ms": 71.5}');
INSERT INTO jobs VALUES (6, '2026-01-02T03:05:05.678+00:00', 'controller', 9, 7, 0, 0, 9, '00', 156,
    NULL, NULL, NULL, NULL, NULL);
PRAGMA user_version = 1;
"""


def version_1(path: Path) -> Path:
    """A journal as version 0.1.0 left it: one job ended, one in flight."""
    database = sqlite3.connect(path)
    database.executescript(VERSION_1)
    database.close()
    return path


def test_a_journal_of_version_1_opens_with_all_it_held_and_goes_on(tmp_path: Path) -> None:
    journal = Journal(version_1(tmp_path / "journal.sqlite"))
    ended = journal.find(5)
    assert ended is not None
    assert (ended.outcome, ended.reason, ended.report, ended.terms) == (
        Outcome.REFUSED,
        Reason.NO_BLOCK_FOUND,
        {"total_ms": 71.5},
        None,
    )
    (in_flight,) = journal.unsettled()
    assert (in_flight.job_id, in_flight.sent, in_flight.withdraw_reason) == (6, True, Reason.EXPIRED)
    assert (journal.owner, journal.last_controller_trigger()) == (4711, (9, 7))
    assert journal.take(TriggerStamp("serial")).job_id == 7
    terms = Terms({"number": 1}, "sha256:00")
    assert journal.settle(7, Outcome.ACCEPTED, None, None, Progress(terms)).terms == terms
    journal.close()
    again = Journal(tmp_path / "journal.sqlite")
    assert again.last_taken() is not None
    again.close()


def test_notes_of_who_asked_for_what_last_and_only_the_newest_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.records.journal.MOST_NOTES", 3)
    path = version_1(tmp_path / "journal.sqlite")
    with reading(path) as reader:
        assert reader.notes(10) == []
    journal = Journal(path)
    for k in range(5):
        number = journal.note("anna" if k else None, "192.0.2.7", "halt", f"blade {k}")
    journal.note_result(number, "Halted")
    journal.close()
    with reading(path) as reader:
        notes = reader.notes(10)
    assert [note.detail for note in notes] == ["blade 4", "blade 3", "blade 2"]
    assert (notes[0].who, notes[0].address, notes[0].action, notes[0].result) == ("anna", "192.0.2.7", "halt", "Halted")
    assert notes[1].result is None


def test_a_migration_that_fails_leaves_the_old_journal_as_it_was(tmp_path: Path) -> None:
    path = version_1(tmp_path / "journal.sqlite")
    changed(path, "CREATE TABLE recipe_settings (somebody TEXT)")
    with pytest.raises(JournalError, match="recipe_settings already exists"):
        Journal(path)
    database = sqlite3.connect(path)
    assert database.execute("PRAGMA user_version").fetchone() == (1,)
    assert len(database.execute("SELECT * FROM jobs").description) == 15
    database.close()


# --- terms, transfer, bounds ------------------------------------------------------------------------------------


def test_a_job_keeps_the_whole_settings_it_was_carried_out_with_once_for_all_jobs_alike(journal: Journal) -> None:
    terms = [Terms({"number": 1, "tolerance_mm": value}, "sha256:aa") for value in (0.1, 0.1, 0.2)]
    for one in terms:
        job = journal.take(TriggerStamp("serial"))
        journal.store_pages(job.job_id, 9, (PAGE,), Progress(one))
        settled = journal.settle(job.job_id, Outcome.ACCEPTED, None, None, Progress(one, transfer={"pages": 1}))
        assert (settled.terms, settled.transfer) == (one, {"pages": 1})
    assert journal._file.db.execute("SELECT COUNT(*) FROM recipe_settings").fetchone()[0] == 2


def test_a_job_that_a_restart_found_in_flight_knows_its_settings(journal: Journal) -> None:
    job = journal.take(TriggerStamp("serial"))
    journal.store_pages(job.job_id, 9, (PAGE,), Progress(Terms({"number": 3})))
    assert journal.unsettled()[0].terms == Terms({"number": 3})
    assert journal.settle(job.job_id, Outcome.FAILED, Reason.SERVICE_RESTARTED, "").terms == Terms({"number": 3})


def test_pruning_lets_the_oldest_go_and_keeps_what_numbers_and_triggers_go_on_from(journal: Journal) -> None:
    journal.take(TriggerStamp("serial"))  # never ends
    journal.settle(journal.take(TriggerStamp("controller", session=9, counter=5)).job_id, Outcome.ACCEPTED, None, None)
    for _ in range(30):
        journal.settle(journal.take(TriggerStamp("serial")).job_id, Outcome.ACCEPTED, None, None)
    while journal.prune(10):
        pass
    assert [job.job_id for job in journal._jobs("ORDER BY job_id")] == [1, 2, *range(23, 33)]
    assert journal.last_controller_trigger() == (9, 5)
    assert journal.take(TriggerStamp("serial")).job_id == 33
