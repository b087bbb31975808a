"""What is added up of a journal, held against the jobs one by one."""

from __future__ import annotations

import random
import sqlite3
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, Terms, TriggerStamp
from service.records.journal import Journal
from service.records.journal_reader import JobFilter, reading
from service.trends.history import LONGEST, MOST_BUCKETS, History, Span, history
from service.trends.limits import limits_of
from tests.support.service.journal_files import changed

BEGIN = datetime(2026, 3, 1, tzinfo=UTC)
SETTINGS = {"name": "A", "max_uncertainty_mm": 0.5, "min_area_mm2": 100.0, "max_area_mm2": 90_000.0}
JOBS = 300


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three days of two recipes, one of them changed on the third; one job has not ended."""
    path = tmp_path_factory.mktemp("journal") / "journal.sqlite"
    drawn, now = random.Random(976_001), [BEGIN]
    journal = Journal(path, now=lambda: now[0])
    for k in range(JOBS):
        now[0] = BEGIN + timedelta(days=3 * k / JOBS)
        job = journal.take(TriggerStamp("interval"))
        terms = Terms({"number": 1 + k % 2, **SETTINGS, "tolerance_mm": 0.1 if k < 200 else 0.2}, f"sha256:{k // 150}")
        quality = {"blur_px": drawn.uniform(1, 2), "level": drawn.uniform(150, 200), "pitch_px": 25.0}
        report = {"uncertainty_mm": drawn.uniform(0.1, 0.4), "total_ms": drawn.uniform(300, 900), "quality": quality}
        end = Outcome.REFUSED if k % 10 == 3 else Outcome.ACCEPTED
        if k % 50 == 7:
            journal.settle(job.job_id, Outcome.FAILED, Reason.NO_FRAME, "no frame")
        else:
            reason = Reason.TOUCHES_BORDER if end is Outcome.REFUSED else None
            journal.settle(job.job_id, end, reason, None, Progress(terms, {**report, "area_mm2": 100.0 + k}))
    journal.take(TriggerStamp("interval"))
    journal.close()
    return path


def of(path: Path, span: Span, recipe: int | None = None) -> History:
    with reading(path) as journal:
        return history(journal, span, recipe)


def one_by_one(path: Path, begin: datetime, end: datetime) -> list[Job]:
    with reading(path) as journal:
        ended = [job for job in journal.jobs(JobFilter()) if job.outcome is not None]
    return [job for job in ended if begin <= datetime.fromisoformat(job.taken_at) < end]


def test_each_bucket_and_the_whole_hold_what_its_jobs_hold(path: Path) -> None:
    span = Span(BEGIN + timedelta(hours=7), BEGIN + timedelta(days=2, minutes=11))
    found = of(path, span)
    assert span.step_s == 1800
    for bucket in (*found.buckets, found.whole):
        end = span.end if bucket is found.whole else min(bucket.begin + timedelta(seconds=1800), span.end)
        jobs = one_by_one(path, bucket.begin, end)
        assert sum(bucket.outcomes.values()) == len(jobs)
        assert bucket.reasons == {
            int(reason): sum(job.reason is reason for job in jobs) for reason in {job.reason for job in jobs} if reason
        }
        values = [job.report["quality"]["blur_px"] for job in jobs if job.report]
        blur = bucket.figures["blur_px"]
        assert blur.known == len(values)
        if values:
            assert (blur.least, blur.most) == (min(values), max(values))
            assert blur.mean == pytest.approx(sum(values) / len(values))


def test_recipes_and_calibrations_are_told_as_they_changed(path: Path) -> None:
    found = of(path, Span(BEGIN, BEGIN + timedelta(days=3)))
    assert [(used.number, used.settings["tolerance_mm"]) for used in found.recipes] == [
        (1, 0.1),
        (2, 0.1),
        (1, 0.2),
        (2, 0.2),
    ]
    assert [(used.digest, used.use.jobs) for used in found.calibrations] == [("sha256:0", 147), ("sha256:1", 147)]
    assert found.calibrations[1].use.first == "2026-03-02T12:00:00.000+00:00"
    assert limits_of(found).keys() == {"level", "blur_px"}, "of two recipes no one's limit is drawn"


def test_one_recipe_is_told_alone_with_its_limits(path: Path) -> None:
    found = of(path, Span(BEGIN, BEGIN + timedelta(days=3)), 2)
    assert {used.number for used in found.recipes} == {2}
    assert sum(found.whole.outcomes.values()) == 144, "six of its jobs came to no recipe"
    bounds = limits_of(found)
    assert (bounds["uncertainty_mm"], bounds["area_mm2"], bounds["level"]) == ((None, 0.5), (100, 90_000), (16, None))
    assert bounds["blur_px"][1] == pytest.approx((1.4**2 + (0.12 * 25) ** 2) ** 0.5)


@pytest.mark.parametrize("span", [timedelta(minutes=1), timedelta(days=1), timedelta(days=366), LONGEST])
def test_no_span_has_more_buckets_than_can_be_drawn(path: Path, span: timedelta) -> None:
    assert 1 <= len(of(path, Span(BEGIN, BEGIN + span)).buckets) <= MOST_BUCKETS


@pytest.mark.parametrize("span", [timedelta(0), timedelta(days=-1), LONGEST + timedelta(seconds=1)])
def test_a_span_of_none_or_too_many_years_is_refused(span: timedelta) -> None:
    with pytest.raises(ValueError, match="expected a minute to ten years"):
        Span(BEGIN, BEGIN + span)


def test_a_damaged_report_is_counted_without_its_figures(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "journal.sqlite"
    copy.write_bytes(path.read_bytes())
    changed(copy, "UPDATE jobs SET report = '{\"total_ms\": 7' WHERE job_id = (SELECT MIN(job_id) FROM jobs)")
    whole, sound = (of(one, Span(BEGIN, BEGIN + timedelta(days=3))).whole for one in (copy, path))
    assert whole.outcomes == sound.outcomes
    assert whole.figures["total_ms"].known == sound.figures["total_ms"].known - 1


def test_buckets_are_found_by_the_index_on_time(path: Path) -> None:
    database = sqlite3.connect(path)
    plan = database.execute("EXPLAIN QUERY PLAN SELECT report FROM jobs WHERE taken_at >= 'a' AND taken_at < 'b'")
    told = " ".join(row[3] for row in plan)
    database.close()
    assert "jobs_by_time" in told


def test_a_journal_of_before_tells_its_jobs_and_nothing_else(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "journal.sqlite"
    copy.write_bytes(path.read_bytes())
    changed(copy, "DROP TABLE checks", "DROP TABLE missed", "DROP INDEX jobs_by_time", "PRAGMA user_version = 4")
    found = of(copy, Span(BEGIN, BEGIN + timedelta(days=3)))
    assert (sum(found.whole.outcomes.values()), found.missed, found.checks) == (JOBS, {}, ())
