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
from service.replays.run_files import schema
from service.replays.work import JobName, Lost, Work
from tests.support.processes.processes import ROOT
from tests.support.real_parts import CLUSTER, need_module
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


def recipe_number_that_is_none(archive: Path) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], "number": "one"})


def recipe_number_beyond_all_columns(archive: Path) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], "number": 10**30})


def recipe_name_that_cannot_be_written(archive: Path) -> None:
    changed_document(archive, 1, recipe={**load_archived(archive, 1).document["recipe"], "name": "\ud800"})


def recipe_that_is_a_list(archive: Path) -> None:
    changed_document(archive, 1, recipe=[1])


def times_that_are_none(archive: Path) -> None:
    changed_document(archive, 1, measurement={**load_archived(archive, 1).document["measurement"], "timings_ms": None})


def vertices_that_are_no_number(archive: Path) -> None:
    changed_document(archive, 1, measurement={**load_archived(archive, 1).document["measurement"], "vertices": "many"})


def area_beyond_all_numbers(archive: Path) -> None:
    changed_document(archive, 1, measurement={**load_archived(archive, 1).document["measurement"], "area_mm2": 10**400})


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
        (recipe_number_that_is_none, Flaw.DOCUMENT_DAMAGED),
        (recipe_number_beyond_all_columns, Flaw.DOCUMENT_DAMAGED),
        (recipe_name_that_cannot_be_written, Flaw.DOCUMENT_DAMAGED),
        (recipe_that_is_a_list, Flaw.DOCUMENT_DAMAGED),
        (times_that_are_none, Flaw.DOCUMENT_DAMAGED),
        (vertices_that_are_no_number, Flaw.DOCUMENT_DAMAGED),
        (area_beyond_all_numbers, Flaw.DOCUMENT_DAMAGED),
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
    pa = need_module("pyarrow", CLUSTER)
    assert len(pa.Table.from_pylist([found], schema())) == 1  # the table takes the row: it does not end the run


def test_of_a_bucket_what_went_meanwhile_is_missing_and_told_by_where_it_lay(archive: Path) -> None:
    stored = need_module("fsspec", CLUSTER).filesystem("memory")
    changed_document(archive, 3, table="tables/0123.npz")
    (document_of(archive, 4) or Path()).write_text("{")
    for path in (archive / "0000000xxx").iterdir():
        stored.pipe(f"/plant/cell-7/0000000xxx/{path.name}", path.read_bytes())
    place = Place("cell-7", "memory://plant/cell-7")
    there = dict(place.jobs())
    stored.rm("/plant/cell-7/0000000xxx/1-accepted.json")
    found = [Work((place,)).row(JobName(0, job, there[job])) for job in (1, 2, 3, 4)]
    stored.rm("/plant", recursive=True)
    assert [one["left_out"] for one in found] == [Flaw.MISSING, None, Flaw.TABLE, Flaw.DOCUMENT_DAMAGED]
    assert found[0]["left_out_text"].startswith("memory://plant/cell-7: holds nothing of job 1.")
    assert found[3]["left_out_text"].startswith("memory://plant/cell-7/0000000xxx/4-accepted.json: is no document")


def test_a_worker_that_has_no_such_wheel_does_not_call_that_a_defect(archive: Path, tmp_path: Path) -> None:
    work = Work((Place("cell-7", str(archive)),), against=tmp_path / "combtrace.whl")
    for _ in range(2):
        found = work.row(JobName(0, 1, "accepted"))
        assert found["left_out"] == Lost.OTHER_VERSION
        assert "there is no such wheel" in found["left_out_text"]


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
