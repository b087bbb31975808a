"""A job's row says what came of it, and of a damaged one which kind of damage; none ends the others."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from service.records.archive import document_of
from service.records.archived_job import load_archived
from service.records.evidence import EvidenceError, Flaw
from service.records.replay import Settings, replay
from service.replays.places import Place
from service.replays.rows import COLUMNS, OF_THE_RUN, Row
from service.replays.work import JobName, Lost, Work
from tests.support.processes.processes import ROOT
from tests.support.service.archives import changed_document, frame_of, write_archive


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Jobs 1 to 5; the last was refused."""
    path = tmp_path / "cell-7"
    write_archive(path, 5)
    return path


def row(archive: Path, job_id: int, settings: Settings | None = None, ended: str = "accepted") -> Row:
    work = Work((Place("cell-7", str(archive)),), settings or Settings())
    return work.row(JobName(0, job_id, ended))


def test_a_job_that_comes_out_as_it_was_says_so_of_both_sides(archive: Path) -> None:
    found = row(archive, 2)
    kept = load_archived(archive, 2).document
    assert list(found) == list(COLUMNS)
    assert (found["cell"], found["job_id"], found["recipe"], found["recipe_name"]) == ("cell-7", 2, 1, "core")
    assert found["taken_at"].isoformat(timespec="milliseconds") == kept["job"]["taken_at"]
    assert found["outcome_before"] == found["outcome_after"] == "accepted"
    assert found["reason_before"] is found["reason_after"] is found["left_out"] is None
    assert found["identical"]
    assert not found["flipped"]
    assert found["distance_mm"] == 0
    assert found["area_mm2_before"] == found["area_mm2_after"] == kept["measurement"]["area_mm2"]
    assert found["opencv_before"] == found["opencv_after"] == kept["opencv"]


def test_another_limit_flips_the_verdict_and_leaves_the_outline(archive: Path) -> None:
    found = row(archive, 1, Settings(recipe={"max_area_mm2": 1000}))
    assert (found["outcome_before"], found["outcome_after"]) == ("accepted", "refused")
    assert (found["reason_before"], found["reason_after"]) == (None, 112)
    assert found["flipped"]
    assert found["distance_mm"] == 0
    assert "1 000" in found["text_after"] or "1000" in found["text_after"]


def test_a_coarser_polygon_is_as_far_away_as_replay_says(archive: Path) -> None:
    settings = Settings(recipe={"tolerance_mm": 2.0})
    apart = replay(load_archived(archive, 2), settings).apart
    assert apart is not None
    found = row(archive, 2, settings)
    assert found["distance_mm"] == apart.distance > 0
    assert not found["identical"]


def test_what_the_controller_answered_to_a_contour_is_taken_for_given(archive: Path) -> None:
    job = json.loads((document_of(archive, 1) or Path()).read_text())["job"]
    changed_document(archive, 1, job={**job, "outcome": "failed", "reason": 142})
    found = row(archive, 1)
    assert (found["outcome_before"], found["reason_before"]) == ("failed", 142)
    assert (found["outcome_after"], found["reason_after"]) == ("failed", 142)
    assert not found["flipped"]


def test_a_refused_job_that_would_be_sent_now_is_told_as_accepted(archive: Path) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], "max_area_mm2": 1000.0})
    refused = row(archive, 1)
    kept = load_archived(archive, 1).document
    reasons = [{"code": 112, "text": refused["text_after"]}]
    changed_document(
        archive,
        1,
        job={**kept["job"], "outcome": "refused", "reason": 112},
        measurement={**kept["measurement"], "reasons": reasons},
    )
    found = row(archive, 1, Settings(recipe={"max_area_mm2": 1e6}))
    assert (found["outcome_before"], found["reason_before"]) == ("refused", 112)
    assert (found["outcome_after"], found["reason_after"]) == ("accepted", None)
    assert found["flipped"]


def truncated_frame(archive: Path) -> None:
    path = frame_of(archive, 1)
    path.write_bytes(path.read_bytes()[:500])


def no_frame(archive: Path) -> None:
    frame_of(archive, 1).unlink()


def unreadable_document(archive: Path) -> None:
    (document_of(archive, 1) or Path()).write_text('{"version": 1, "job"')


def document_without_a_measurement_inside(archive: Path) -> None:
    changed_document(archive, 1, measurement={"reasons": []})


def later_version(archive: Path) -> None:
    changed_document(archive, 1, version=2)


def nothing_measured(archive: Path) -> None:
    changed_document(archive, 1, frame=None, measurement=None)


def unknown_recipe_key(archive: Path) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], "glow": True})


def damaged_calibration(archive: Path) -> None:
    known = load_archived(archive, 1).document["calibration"]
    changed_document(archive, 1, calibration={**known, "content": {**known["content"], "mm_per_pixel": -1}})


def lost_table(archive: Path) -> None:
    changed_document(archive, 1, table="tables/0123.npz")


@pytest.mark.parametrize(
    ("damage", "kind"),
    [
        (truncated_frame, Flaw.FRAME_DAMAGED),
        (no_frame, Flaw.MISSING),
        (unreadable_document, Flaw.DOCUMENT_DAMAGED),
        (document_without_a_measurement_inside, Flaw.DOCUMENT_DAMAGED),
        (later_version, Flaw.LATER_VERSION),
        (nothing_measured, Flaw.NOTHING_MEASURED),
        (unknown_recipe_key, Flaw.SETTINGS),
        (damaged_calibration, Flaw.CALIBRATION),
        (lost_table, Flaw.TABLE),
    ],
)
def test_a_job_that_cannot_be_done_says_why_by_kind(archive: Path, damage: object, kind: Flaw) -> None:
    assert callable(damage)
    damage(archive)
    found = row(archive, 1)
    assert found["left_out"] == kind, found["left_out_text"]
    assert found["left_out_text"]
    assert found["outcome_after"] is None
    assert row(archive, 2)["left_out"] is None


def test_a_job_that_nothing_is_kept_of_is_left_out_as_missing(archive: Path) -> None:
    assert row(archive, 99)["left_out"] == Flaw.MISSING


def test_an_error_of_ours_is_told_as_such_and_ends_nothing(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("1/0")

    monkeypatch.setattr("service.replays.work.row_of", broken)
    found = row(archive, 1)
    assert found["left_out"] == Lost.DEFECT
    assert "ZeroDivisionError" in found["left_out_text"]


def test_pictures_of_a_job_show_both_outlines_and_the_place_only_where_they_differ(archive: Path) -> None:
    work = Work((Place("cell-7", str(archive)),))
    same = work.drawn(JobName(0, 2, "accepted"))
    assert same is not None
    assert same.place is None
    other = replace(work, settings=Settings(recipe={"tolerance_mm": 2.0})).drawn(JobName(0, 2, "accepted"))
    assert other is not None
    assert other.place is not None
    assert other.before == same.before != other.after
    assert work.drawn(JobName(0, 99, "accepted")) is None


def test_a_place_lists_its_jobs_and_nothing_else(archive: Path) -> None:
    (archive / "notes").mkdir()
    (archive / "0000000xxx" / "1-mine.txt").write_text("kept by somebody")
    found = dict(Place("cell-7", str(archive)).jobs())
    assert found == {1: "accepted", 2: "accepted", 3: "accepted", 4: "accepted", 5: "refused"}


def test_a_job_of_an_unknown_end_is_not_looked_for_in_a_bucket() -> None:
    with (
        pytest.raises(EvidenceError, match="holds nothing of job 7"),
        Place("cell-7", "s3://plant/cell-7").at_hand(7, ""),
    ):
        pass


def test_the_reference_names_each_column_and_those_of_the_run() -> None:
    page = (ROOT / "docs" / "reference" / "replay-table.md").read_text(encoding="utf-8")
    told = [line for line in page.splitlines() if line.startswith("| `")]
    assert told == [f"| `{name}` | {kind} | {meaning} |" for name, (kind, meaning) in COLUMNS.items()]
    assert all(f"`{name}`" in page.partition("| column")[0] for name in OF_THE_RUN)
