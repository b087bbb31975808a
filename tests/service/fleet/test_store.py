"""What is kept of jobs: once each, added up by shift, day and week; and files that are none."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest

from service.fleet.cells import Cell
from service.fleet.listener import shift_begin
from service.fleet.store import DAY_MS, Store, StoreError
from service.telemetry.payload import Value

NAME = ("plant", "cell-1")
NOW_MS = 1_795_000_000_000
SHIFTS = ("06:00", "14:00", "22:00")


def job(
    number: int, age_ms: int, outcome: str = "accepted", uncertainty_mm: Value | None = 0.1
) -> dict[str, Value | None]:
    return {
        "Job/Number": number,
        "Job/Settled": NOW_MS - age_ms,
        "Job/Outcome": outcome,
        "Job/Uncertainty mm": uncertainty_mm,
        "Job/Blur px": 1.0,
    }


def test_a_job_told_twice_counts_once(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    told = [job(1, 1000), job(1, 1000), job(2, 500, "refused"), job(3, DAY_MS)]
    for _ in range(2):
        store.keep([], [(NAME, one) for one in told], 0)
    assert store.figures(NOW_MS - 2000, NOW_MS)[NAME].outcomes == {"accepted": 1, "refused": 1}
    store.close()


def test_a_day_is_held_against_the_week_before(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    today = [job(k, 1000 + k, uncertainty_mm=0.15) for k in range(20)]
    week = [job(100 + k, 3 * DAY_MS + k, uncertainty_mm=0.1) for k in range(20)]
    store.keep([], [(NAME, one) for one in [*today, *week]], 0)
    figures = store.figures(NOW_MS, NOW_MS)[NAME]
    assert figures.uncertainty.mean == pytest.approx(0.15)
    assert figures.uncertainty.worse_percent == pytest.approx(50)
    assert figures.blur.worse_percent == pytest.approx(0)
    store.close()


def test_of_a_few_jobs_no_drift_is_told(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    store.keep([], [(NAME, job(1, 1000)), (NAME, job(2, 3 * DAY_MS))], 0)
    assert store.figures(NOW_MS, NOW_MS)[NAME].uncertainty.worse_percent is None
    store.close()


@pytest.mark.parametrize("odd", [float("nan"), "text", True, 2**64 - 1, None])
def test_figures_that_are_none_are_kept_as_not_known(tmp_path: Path, odd: Value | None) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    store.keep([], [(NAME, job(2**64 - 1, 10, uncertainty_mm=odd))], 0)
    assert store.figures(0, NOW_MS)[NAME].outcomes == {"accepted": 1}
    store.close()


def test_cells_are_known_again_and_old_jobs_go(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    store.keep([Cell(NAME, {"State/Name": "Ready"}, heard_ms=5)], [(NAME, job(1, DAY_MS)), (NAME, job(2, 10))], 0)
    store.keep([], [(NAME, job(3, 5))], NOW_MS - 1000)
    store.close()
    store = Store(tmp_path / "fleet.sqlite")
    (cell,) = store.cells()
    assert (cell.name, cell.values, cell.heard_ms, cell.born) == (NAME, {"State/Name": "Ready"}, 5, False)
    assert store.figures(0, NOW_MS)[NAME].outcomes == {"accepted": 2}
    store.close()


@pytest.mark.parametrize("content", [b"no database at all, but longer than a header" * 9, None])
def test_a_file_that_is_none_is_named(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "fleet.sqlite"
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(StoreError, match=r"fleet\.sqlite: cannot be used"):
        Store(path)


def test_what_a_full_disk_refused_is_written_once_there_is_room(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    many = [(NAME, job(number, 10)) for number in range(1, 5000)]
    store._database.execute("PRAGMA max_page_count = 20")
    with pytest.raises(StoreError, match="full"):
        store.keep([], many, 0)
    store._database.execute("PRAGMA max_page_count = 100000")
    store.keep([], many, 0)
    assert store.figures(0, NOW_MS)[NAME].outcomes == {"accepted": 4999}
    store.close()


def test_a_file_that_was_damaged_is_named_whatever_is_asked_of_it(tmp_path: Path) -> None:
    store = Store(tmp_path / "fleet.sqlite")
    store._database.execute("DROP TABLE jobs")
    with pytest.raises(StoreError, match=r"fleet\.sqlite: cannot be read: no such table"):
        store.figures(0, NOW_MS)
    store._database.execute("INSERT INTO cells VALUES ('plant', 'cell-1', '{', 0)")
    with pytest.raises(StoreError, match=r"fleet\.sqlite: is damaged"):
        store.cells()
    store.close()


@pytest.mark.parametrize(
    ("now", "begin"), [("05:59", "22:00"), ("06:00", "06:00"), ("13:59", "06:00"), ("23:10", "22:00")]
)
def test_a_shift_begins_when_it_is_said_to(now: str, begin: str) -> None:
    moment = datetime.fromisoformat(f"2026-11-23T{now}").astimezone()
    found = shift_begin(SHIFTS, moment)
    assert found.strftime("%H:%M") == begin
    assert found <= moment
