"""The daemon's jobs, looked at and done again by other processes while it runs: byte for byte, or what changed."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from service.cli.main import main
from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import called, lines, until
from tests.support.real_parts import CLUSTER, need_module


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """A daemon that has done the samples and an empty table, and goes on."""
    folder = tmp_path_factory.mktemp("cell")
    pictures = folder / "pictures"
    pictures.mkdir()
    for sample in SAMPLES.glob("*.jpg"):
        shutil.copy(sample, pictures)
    height, width = cv2.imread(str(SAMPLES / "1-rectangle.jpg")).shape[:2]
    noise = np.random.default_rng(1).integers(60, 80, (height, width), dtype=np.uint8)
    cv2.imwrite(str(pictures / "5-empty.png"), noise)
    built = Cell(
        folder,
        camera=f"{{kind: files, path: {pictures}, loop: true}}",
        trigger_every_s=0.3,
        more="archive: {path: archive, min_free_bytes: 0}\n",
    )
    try:
        until(lambda: len(built.settled()) > 5, 40, "six jobs")
        until(lambda: files(built, "*/#6-accepted.json"), 40, "evidence of six jobs")
        built.controller.stop()  # no more jobs: the daemon goes on, and leaves the processor to the tests
        yield built
    finally:
        built.service.kill()  # a job that the controller's end cut short would hold a stop up
        built.stop()


def numbered(cell: Cell, text: str) -> str:
    """`text` with the number of the n-th job for #n."""
    return re.sub(r"#(\d)", lambda nth: str(cell.number(int(nth[1]))), text)


def files(cell: Cell, pattern: str) -> list[Path]:
    return list((cell.folder / "archive").glob(numbered(cell, pattern)))


def run(cell: Cell, *arguments: str) -> subprocess.CompletedProcess[str]:
    return called(*(numbered(cell, text) for text in arguments), "--config", cell.folder / "config.yaml")


def test_jobs_are_listed_and_filtered_while_the_daemon_runs(cell: Cell) -> None:
    assert cell.service.running
    listed = run(cell, "jobs", "--json", "--limit", "0")
    assert listed.returncode == 0, listed.stderr
    found = [json.loads(line) for line in listed.stdout.splitlines()]
    assert [job["job_id"] - found[0]["job_id"] for job in found[:6]] == [0, 1, 2, 3, 4, 5]
    assert [job["outcome"] for job in found[:6]] == ["accepted"] * 4 + ["refused", "accepted"]
    assert found[0]["recipe"]["tolerance_mm"] == 0.1
    assert found[0]["calibration"].startswith("sha256:")
    assert found[0]["transfer"]["pages"] == 1
    assert {"mask", "trace", "total"} <= set(found[0]["report"]["timings_ms"])
    refused = run(cell, "jobs", "--outcome", "refused", "--reason", "no_block_found", "--since", "1h")
    assert "110 no_block_found" in refused.stdout
    assert "accepted" not in refused.stdout
    assert run(cell, "jobs", "--since", "2999-01-01").stderr.strip() == "no such jobs"


def test_a_span_beyond_all_time_is_all_of_it(cell: Cell) -> None:
    def listed(*span: str) -> list[int]:  # a job that the controller's end cut short may end in between
        found = run(cell, "jobs", "--json", "--limit", "0", *span).stdout
        return [json.loads(line)["job_id"] for line in found.splitlines()]

    assert listed("--since", "999999w") == listed() != []


def test_one_job_is_shown_with_its_evidence_and_what_to_do(cell: Cell) -> None:
    shown = run(cell, "jobs", "show", "#5")
    assert shown.returncode == 0, shown.stderr
    for expected in ("110 no_block_found", "#5-frame.png", "#5-overlay.jpg", "Check that a block lies on the table"):
        assert numbered(cell, expected) in shown.stdout
    assert "there is no job 99999" in run(cell, "jobs", "show", "99999").stderr


def test_a_replay_gives_the_registers_that_the_controller_took_byte_for_byte(cell: Cell) -> None:
    again = run(cell, "replay", "#1", "#2", "#3", "#4", "#5")
    assert again.returncode == 0, again.stdout + again.stderr
    assert again.stdout.count("byte for byte as they were") == 5
    (evidence,) = files(cell, "*/#1-accepted.json")
    archived = json.loads(evidence.read_text())
    taken = next(contour for contour in lines(cell.accepted) if contour["job_id"] == cell.number(1))
    exterior = np.array(archived["measurement"]["millimetres"]["exterior"])
    assert np.abs(exterior - np.array(taken["millimetres"]["exterior"])).max() < 0.0006, (
        "the archive is of that contour"
    )


def test_other_settings_tried_on_the_archive_tell_which_verdicts_flip(cell: Cell) -> None:
    tried = run(cell, "replay", "--since", "1h", "--limit", "8", "--set", "recipe.max_area_mm2=50000", "--json")
    assert tried.returncode == 0, tried.stderr
    found = [json.loads(line) for line in tried.stdout.splitlines()]
    for job in found:
        too_large = (job["was"]["area_mm2"] or 0) > 50000
        assert job["flipped"] == too_large, job
        assert (112 in job["reasons"]) == too_large
    flips = sum(job["flipped"] for job in found)
    assert 0 < flips < len(found)
    table = run(cell, "replay", "#1", "#2", "#5", "--set", "recipe.max_area_mm2=50000").stdout
    assert "3 jobs, 2 verdicts flip: 2 sent -> refused" in table
    assert "112 area_out_of_limits" in table


def test_jobs_of_the_journal_become_a_table(cell: Cell, tmp_path: Path) -> None:
    output = tmp_path / "rows.parquet"
    tried = run(cell, "replay", "--since", "1h", "--outcome", "refused", "--output", str(output))
    assert tried.returncode == 0, tried.stderr
    found = need_module("pyarrow.parquet", CLUSTER).read_table(output).to_pylist()
    assert numbered(cell, "#5") in [str(row["job_id"]) for row in found]
    assert {(row["cell"], row["reason_after"], row["identical"]) for row in found} == {("archive", 110, True)}


def test_what_changes_is_told_field_by_field(cell: Cell) -> None:
    tried = run(cell, "replay", "#4", "--set", "recipe.tolerance_mm=2", "--json")
    changed = {change["field"]: (change["was"], change["now"]) for change in json.loads(tried.stdout)["changes"]}
    assert changed["vertices"][0] > changed["vertices"][1]
    assert changed["page 1 point_count"] == changed["vertices"]
    assert {"polygon", "page 1 crc32", "page 1 payload_length"} <= set(changed)


def test_a_frame_that_was_changed_since_is_not_replayed(cell: Cell, tmp_path: Path) -> None:
    found = files(cell, "*/#2-*")
    copy = tmp_path / "archive" / found[0].parent.name
    copy.mkdir(parents=True)
    for path in found:
        shutil.copy(path, copy)
    (frame,) = copy.glob("*-frame.png")
    pixels = cv2.imread(str(frame), cv2.IMREAD_UNCHANGED)
    pixels[0, 0] ^= 1
    cv2.imwrite(str(frame), pixels)
    text = (cell.folder / "config.yaml").read_text().replace("path: archive", f"path: {tmp_path / 'archive'}")
    (tmp_path / "config.yaml").write_text(text)
    again = called("replay", str(cell.number(2)), "--config", tmp_path / "config.yaml")
    assert again.returncode == 2
    assert "is not the frame that was archived" in again.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("replay",), "which jobs?"),
        (("replay", "#1", "--set", "recipe.colour=red"), "expected recipe.KEY=VALUE"),
        (("replay", "#1", "--set", "recipe.tolerance=1"), "did you mean recipe.tolerance_mm?"),
        (
            ("replay", "#1", "#2", "--set", "recipe.tolerance_mm=-1"),
            "replay: jobs #1, #2: recipe.tolerance_mm: seen -1, exp",
        ),
        (
            ("replay", "#1", "--set", "calibration.max_age_days=.nan"),
            "calibration.max_age_days: seen nan, expected a fin",
        ),
        (("replay", "#1", "--set", "calibration.sentinels_required=2"), "seen 2, expected true or false"),
        (("replay", "#1", "4000000000"), "left out: job 4000000000: "),
        (("replay", "--limit", "-1"), "expected 0 or more"),
        (("replay", "#1", "--set", "recipe.number=2"), "expected recipe.KEY=VALUE"),
        (("replay", "../1"), "is no job number"),
        (("jobs", "show"), "which job?"),
        (("jobs", "--reason", "blue"), "there is no such reason"),
        (("jobs", "--since", "yesterday"), "is no time"),
    ],
)
def test_a_wrong_question_is_answered_by_what_is_expected(
    cell: Cell, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], told: str
) -> None:
    try:
        status = main([*(numbered(cell, text) for text in arguments), "--config", str(cell.folder / "config.yaml")])
    except SystemExit as ended:  # argparse's own
        status = int(ended.code or 0)
    assert status == 2
    assert numbered(cell, told) in capsys.readouterr().err
