"""What each version wrote, taken on by this one; and what a later one wrote, left alone."""

from __future__ import annotations

import json
import shutil
import sqlite3
from pathlib import Path

import pytest

from tests.support.processes.processes import Process, called, free_port, jobs, lines, until

VERSIONS = sorted(path for path in Path(__file__).parent.iterdir() if (path / "journal.sql").exists())


class OldCell:
    """A copy of what a version left behind, with the controller that goes on."""

    def __init__(self, version: Path, folder: Path) -> None:
        shutil.copytree(version, folder, dirs_exist_ok=True)
        self.port = free_port()
        self.config = folder / "config.yaml"
        self.config.write_text(self.config.read_text().replace("port: 15020", f"port: {self.port}"))
        (folder / "var").mkdir()
        (folder / "archive").rename(folder / "var" / "archive")
        self.journal = folder / "var" / "journal.sqlite"
        with sqlite3.connect(self.journal) as database:
            database.execute("PRAGMA journal_mode = WAL")
            database.executescript((folder / "journal.sql").read_text())
        database.close()
        self.accepted = folder / "accepted.jsonl"
        self.folder = folder

    def run(self, *arguments: str) -> Process:
        return Process(self.folder / f"{arguments[0]}.log", *arguments)

    def controller(self) -> Process:
        return self.run(
            *("simulate-controller", "--tcp", f"127.0.0.1:{self.port}", "--trigger-every", "1"),
            *("--memory", str(self.folder / "controller.json"), "--log", str(self.accepted)),
        )


@pytest.fixture(params=VERSIONS, ids=lambda path: path.name)
def cell(request: pytest.FixtureRequest, tmp_path: Path) -> OldCell:
    return OldCell(request.param, tmp_path / "cell")


def test_a_job_in_flight_is_settled_by_this_version_and_the_next_ones_follow(cell: OldCell) -> None:
    before = jobs(cell.journal)
    assert [job["outcome"] for job in before] == ["accepted", "refused", "refused", None]
    in_flight = before[-1]["job_id"]
    controller, service = cell.controller(), cell.run("run", "--config", str(cell.config))
    try:
        until(
            lambda: [job for job in jobs(cell.journal) if job["job_id"] > in_flight and job["outcome"]], what="next job"
        )
    finally:
        assert service.stop() == 0
        controller.stop()
    after = jobs(cell.journal)
    assert [dict(job, **was) for job, was in zip(after, before[:-1], strict=False)] == after[: len(before) - 1]
    assert after[len(before) - 1]["outcome"] == "accepted", "the controller had taken it"
    accepted = [contour["job_id"] for contour in lines(cell.accepted)]
    assert accepted.count(in_flight) == 1
    assert after[len(before)]["job_id"] in accepted
    assert "Traceback" not in service.text


def test_jobs_are_listed_and_replayed_from_their_archive(cell: OldCell) -> None:
    listed = called("jobs", "--config", cell.config, "--json")
    assert listed.returncode == 0, listed.stderr
    assert [json.loads(line)["job_id"] for line in listed.stdout.splitlines()] == [1, 2, 3, 4]
    replayed = called("replay", "1", "3", "--config", cell.config, "--json")
    assert replayed.returncode in (0, 3), replayed.stderr  # 3: the outline may have become a better one
    outcomes = [json.loads(line) for line in replayed.stdout.splitlines()]
    assert [(one["job_id"], one["flipped"]) for one in outcomes] == [(1, False), (3, False)]


def test_a_journal_of_a_later_version_is_refused_with_words_and_left_as_it_is(cell: OldCell) -> None:
    with sqlite3.connect(cell.journal) as database:
        database.execute("PRAGMA user_version = 999")
    database.close()
    before = cell.journal.read_bytes()
    service = cell.run("run", "--config", str(cell.config))
    until(lambda: not service.running, what="end of the service")
    assert service.stop() != 0
    assert "journal of schema version 999, expected 1 to" in service.text
    assert "written by another version of combtrace: use that one" in service.text
    assert cell.journal.read_bytes() == before


def test_an_archive_or_calibration_of_a_later_version_is_refused_with_words(cell: OldCell) -> None:
    (document,) = cell.folder.glob("var/archive/*/1-accepted.json")
    document.write_text(document.read_text().replace('"version": 1', '"version": 2', 1))
    replayed = called("replay", "1", "--config", cell.config)
    assert replayed.returncode == 2
    assert "version 2 of job 1" in replayed.stderr
    assert "written by another version of combtrace: use that one" in replayed.stderr
    calibration = cell.folder / "calibration.yaml"
    calibration.write_text(calibration.read_text().replace("version: 1", "version: 2"))
    traced = called("trace", cell.folder / "pictures" / "0.png", "--calibration", calibration)
    assert traced.returncode == 2
    assert "version" in traced.stderr
