"""Evidence is drafted before a contour is sent and completed at its end, with a restart in between as without one."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.quality import Quality
from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.rings import Contour
from contour.image.overlay import DrawnPart
from contour.placement.place import Placement
from contour.placement.pose import Pose
from drivers.camera import Frame
from service.config.recipes import Recipe
from service.link.contour_message import Envelope, contour_pages
from service.measuring.measure import Measurer
from service.parts.fit import PartFit
from service.parts.part import Part
from service.reasons import Outcome, Reason
from service.records.archive import Archive, ArchiveLimits, files_of
from service.records.archive_writer import ArchiveWriter
from service.records.archived_job import load_archived
from service.records.evidence import Evidence
from service.records.job import Job, Terms, TriggerStamp
from tests.support.service.cycle_rig import measured

RECIPE = Recipe(number=1, name="one", exports=["dxf", "geojson"])
FRAME = Frame(np.random.default_rng(1).integers(0, 255, (60, 80), dtype=np.uint8), 1.0, True, "a.png", 3, "cam")
SQUARE = Contour(np.array([[1.0, 2.0], [11.0, 2.0], [11.0, 12.0], [1.0, 12.0]]))
LAID = PartFit(
    Part(Path("part.dxf"), Contour(SQUARE.exterior - (1.0, 2.0)), "mm"),
    Placement(Pose(1.0, 2.0, 0.0), 1.5, ((1.0, 2.0), (1.0, 0.5))),
    SQUARE,
    asked_mm=1.0,
    bound_mm=0.25,
    drawn=DrawnPart(Contour(SQUARE.exterior * 3.0), 4.0, ((3.0, 6.0), (3.0, 1.5)), True),
)
TAKEN = Job(
    7, "2026-11-22T08:00:00.000+00:00", TriggerStamp("serial", line="/dev/ttyPanel"), terms=Terms({"number": 1})
)


def evidence(job: Job = TAKEN) -> Evidence:
    """As a job has it when its pages are made."""
    quality = Quality(200.0, 60.0, 1.5, 0.8, 20.0, 0.01)
    rests_on = (SentStretch(0, 0.0, 40.0, "seen", None, 0.5), SentStretch(0, 40.0, 300.0, "covered", "object", 9.0))
    found = measured(
        uncertainty_px=0.5, uncertainty=ErrorBudget(0.1, 0.2, None), quality=quality, evidence=rests_on, part=LAID
    )
    envelope = Envelope(job.job_id, 1, 60_000, 30_000, 9, 5, True)
    pages = contour_pages(found, envelope)
    return Evidence(job, Measurer(None), RECIPE, 20.0, FRAME, found, envelope, pages)


def ended(job: Job = TAKEN) -> Job:
    return replace(job, outcome=Outcome.ACCEPTED, settled_at="2026-11-22T08:00:01.000+00:00", report={"vertices": 4})


def nobody(_job_id: int) -> Job | None:
    return None


@contextmanager
def writer(
    path: Path,
    find: Callable[[int], Job | None] = nobody,
    in_flight: tuple[int, ...] = (),
    last_taken: int = 0,
    max_bytes: int = 10**9,
) -> Iterator[ArchiveWriter]:
    """The writer of one process; what waits at its end is written, as a kill would not let it."""
    built = ArchiveWriter(Archive(path, ArchiveLimits(max_bytes)), find, in_flight, last_taken)
    built.start()
    try:
        yield built
    finally:
        built.close()


def drafted(path: Path, given: Evidence) -> None:
    """A process that is killed once the draft is durable."""
    with writer(path) as built:
        step = built.draft(given)
        assert step is not None
        step.result(5)


def contents(path: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in files_of(path, 7)}


def test_a_draft_is_frame_and_document_and_is_no_document_of_an_ended_job(tmp_path: Path) -> None:
    drafted(tmp_path, evidence())
    assert sorted(contents(tmp_path)) == ["7-draft.json", "7-frame.raw"]
    assert Archive(tmp_path, ArchiveLimits(10**9)).document_of(7) is None


def test_after_a_restart_the_evidence_is_to_the_byte_what_it_is_without(tmp_path: Path) -> None:
    with writer(tmp_path / "usual") as built:
        built.draft(evidence())
        built.keep(evidence(ended()))
    drafted(tmp_path / "killed", evidence())
    with writer(tmp_path / "killed", in_flight=(7,)) as built:
        built.keep(Evidence(ended(), Measurer(None)))
    usual = contents(tmp_path / "usual")
    assert sorted(usual) == [
        "7-accepted.json",
        "7-contour.dxf",
        "7-contour.geojson",
        "7-frame.png",
        "7-overlay.jpg",
    ]
    killed = contents(tmp_path / "killed")
    for name in ("7-contour.dxf",):  # it carries identifiers that are drawn at random
        assert len(killed.pop(name)) == pytest.approx(len(usual.pop(name)), rel=0.01)
    assert killed == usual
    archived = load_archived(tmp_path / "killed", 7)
    assert np.array_equal(archived.frame(), FRAME.pixels)
    assert archived.document["job"]["outcome"] == "accepted"
    assert [stretch["state"] for stretch in archived.document["measurement"]["evidence"]] == ["seen", "covered"]


def test_without_a_draft_the_evidence_is_the_same(tmp_path: Path) -> None:
    with writer(tmp_path / "usual") as built:
        built.draft(evidence())
        built.keep(evidence(ended()))
    with writer(tmp_path / "late") as built:
        built.keep(evidence(ended()))
    usual, late = contents(tmp_path / "usual"), contents(tmp_path / "late")
    assert usual.keys() == late.keys()
    assert usual["7-accepted.json"] == late["7-accepted.json"]


def test_a_job_that_had_ended_when_the_kill_came_is_completed_at_the_start(tmp_path: Path) -> None:
    drafted(tmp_path, evidence())
    with writer(tmp_path, lambda job_id: ended() if job_id == 7 else None) as built:
        until(lambda: built.figures.jobs == 1)
    assert {"7-accepted.json", "7-frame.png", "7-overlay.jpg"} <= contents(tmp_path).keys()


def test_a_draft_of_a_job_that_the_journal_does_not_know_goes(tmp_path: Path) -> None:
    drafted(tmp_path, evidence())
    with writer(tmp_path, last_taken=7) as built:
        until(lambda: built.figures.bytes == 0)
    assert contents(tmp_path) == {}


def test_a_draft_that_was_damaged_is_told_and_the_job_gets_what_is_known(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    drafted(tmp_path, evidence())
    (frame,) = tmp_path.glob("*/7-frame.raw")
    frame.write_bytes(bytes(60 * 80))
    with writer(tmp_path, in_flight=(7,)) as built:
        built.keep(Evidence(ended(), Measurer(None)))
    assert sorted(contents(tmp_path)) == ["7-accepted.json"]
    assert "is not the frame that was kept" in caplog.text


def test_where_a_draft_does_not_fit_the_job_goes_on_and_nothing_is_left(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with writer(tmp_path, max_bytes=4096) as built:
        step = built.draft(evidence())
        assert step is not None
        assert step.result(5) is None
        assert contents(tmp_path) == {}
        assert built.figures.bytes == 0
    assert "job 7 goes on without its evidence" in caplog.text


def test_drafts_count_in_the_bound_and_push_older_jobs_out(tmp_path: Path) -> None:
    with writer(tmp_path / "one") as built:
        built.keep(evidence(ended()))
    one = on_disk(tmp_path / "one")
    with writer(tmp_path / "archive", max_bytes=one + 4096) as built:
        built.keep(evidence(ended(replace(TAKEN, job_id=6))))
        until(lambda: built.figures.jobs == 1)
        step = built.draft(evidence())
        assert step is not None
        step.result(5)
        assert built.figures.jobs == 0
        assert built.figures.bytes == on_disk(tmp_path / "archive")
        built.keep(evidence(ended()))
        until(lambda: built.figures.jobs == 1)
        assert built.figures.bytes == on_disk(tmp_path / "archive") == one


def test_a_disk_that_hangs_holds_one_draft_and_no_other_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    goes_on, fsync = threading.Event(), os.fsync

    def hanging(handle: int) -> None:
        goes_on.wait(60)
        fsync(handle)

    monkeypatch.setattr(os, "fsync", hanging)
    with writer(tmp_path) as built:
        stuck = built.draft(evidence())
        assert stuck is not None
        assert built.draft(evidence(replace(TAKEN, job_id=8))) is None
        assert not stuck.done()
        goes_on.set()
        stuck.result(5)
        step = built.draft(evidence(replace(TAKEN, job_id=9)))
        assert step is not None
        step.result(5)


def test_a_job_that_failed_before_a_frame_leaves_its_document(tmp_path: Path) -> None:
    failed = replace(TAKEN, outcome=Outcome.FAILED, reason=Reason.SERVICE_RESTARTED, settled_at=TAKEN.taken_at)
    with writer(tmp_path, in_flight=(7,)) as built:
        built.keep(Evidence(failed, Measurer(None)))
    assert sorted(contents(tmp_path)) == ["7-failed.json"]


def test_a_job_that_a_lost_journal_had_ended_keeps_its_evidence(tmp_path: Path) -> None:
    with writer(tmp_path) as built:
        built.keep(evidence(ended()))
    before = contents(tmp_path)
    with writer(tmp_path, in_flight=(7,)) as built:
        built.keep(Evidence(ended(), Measurer(None)))
    assert contents(tmp_path) == before


def test_a_draft_whose_journal_was_lost_is_completed_where_the_controller_knows_the_job(tmp_path: Path) -> None:
    drafted(tmp_path, evidence())
    with writer(tmp_path) as built:  # an empty journal: the job is found and settled after the start
        built.keep(Evidence(ended(), Measurer(None)))
    assert {"7-accepted.json", "7-frame.png"} <= contents(tmp_path).keys()


def on_disk(path: Path) -> int:
    return sum(-(-file.stat().st_size // 4096) * 4096 for file in path.rglob("*") if file.is_file())


def until(condition: Callable[[], object]) -> None:
    give_up_at = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < give_up_at
        time.sleep(0.01)
