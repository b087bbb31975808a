"""What a journal keeps beside jobs: missed triggers by ten minutes, checks from another process, neither for ever."""

from __future__ import annotations

import sqlite3
from collections import Counter
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from service.cli.main import main
from service.daemon.missed_watch import MissedWatch
from service.records.journal import Journal
from service.trends.kept import KEPT_FOR
from tests.support.service.journal_files import changed

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
BEGIN = datetime(2026, 3, 1, 6, 7, tzinfo=UTC)


def rows(path: Path, query: str) -> list[tuple[Any, ...]]:
    database = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    try:
        return database.execute(query).fetchall()
    finally:
        database.close()


def test_missed_triggers_are_kept_by_ten_minutes_kind_and_reason_each_once(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    counts: Counter[tuple[str, str]] = Counter({("interval", "busy"): 2, ("interval", "taken"): 9})
    now = [BEGIN]
    watch = MissedWatch(journal, counts, now=lambda: now[0])
    watch.keep()
    watch.keep()
    counts["interval", "busy"] += 1
    now[0] += timedelta(minutes=2)
    watch.keep()
    counts["serial", "not_ready"] += 4
    now[0] += timedelta(minutes=2)
    watch.keep()
    assert rows(path, "SELECT * FROM missed ORDER BY at") == [
        ("2026-03-01T06:00:00.000+00:00", "interval", "busy", 3),
        ("2026-03-01T06:10:00.000+00:00", "serial", "not_ready", 4),
    ]
    now[0] += KEPT_FOR
    counts["serial", "not_ready"] += 1
    watch.keep()
    assert [row[3] for row in rows(path, "SELECT * FROM missed")] == [1]
    journal.close()


def test_what_the_journal_refuses_is_added_once_it_takes_it(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    watch = MissedWatch(journal, Counter({("serial", "busy"): 5}), now=lambda: BEGIN)
    changed(path, "CREATE TRIGGER broken BEFORE INSERT ON missed BEGIN SELECT RAISE(ABORT, 'no'); END")
    watch.keep()
    assert rows(path, "SELECT * FROM missed") == []
    changed(path, "DROP TRIGGER broken")
    watch.keep()
    assert [row[3] for row in rows(path, "SELECT * FROM missed")] == [5]
    journal.close()


@pytest.fixture
def verify(tmp_path: Path) -> list[str]:
    """A check of a sample against its own outline, by a configuration."""
    config, master = tmp_path / "config.yaml", tmp_path / "master.json"
    config.write_text(
        f"camera: {{kind: files, path: {SAMPLES}}}\ncalibration: {{file: {SAMPLES / 'calibration.yaml'}}}\n"
        "controller: {kind: none}\njournal: {path: journal.sqlite}\n"
    )
    picture = str(SAMPLES / "2-l-shape.jpg")
    assert main(["trace", picture, "--config", str(config), "--json", str(master)]) == 0
    return ["verify", "--outline", str(master), "--config", str(config), picture]


def test_a_check_is_kept_in_the_configurations_journal_while_the_daemon_has_it_open(
    verify: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    assert main(verify) == 0
    ((kind, pictures, worst_mm, limit_mm, verdict),) = rows(
        path, "SELECT kind, pictures, worst_mm, limit_mm, verdict FROM checks"
    )
    assert (kind, pictures, limit_mm, verdict) == ("verify", 1, 0.3, "pass")
    assert 0 <= worst_mm < 0.001
    journal.probe()
    journal.close()


def test_a_check_without_a_journal_of_this_version_passes_and_says_that_it_is_not_kept(
    verify: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "journal.sqlite"
    assert main(verify) == 0
    assert "the check is not kept" in capsys.readouterr().err
    assert not path.exists(), "a journal is the daemon's to begin"
    Journal(path).close()
    changed(path, "PRAGMA user_version = 4")
    assert main(verify) == 0
    assert "schema version 4, expected 5. Start the daemon of this version once" in capsys.readouterr().err
