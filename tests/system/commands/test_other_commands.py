"""demo, check, schema, and run --once, as a user runs them."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.processes.cell import Cell
from tests.support.processes.processes import COMBTRACE, ENVIRONMENT, ROOT, called, combtrace, free_port, jobs, until
from tests.support.real_parts import need_program

SAMPLES = Path(__file__).parents[3] / "service" / "samples"


def test_demo_goes_the_whole_way_and_says_what_a_person_wants_to_know(tmp_path: Path) -> None:
    done = combtrace("demo", "--output", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    for words in ("-> Ready", "-> SingleExecution", "method", "vertices", "mm²", "transfer", "equal to what was sent"):
        assert words in done.stdout
    assert re.search(r"size +\d+\.\d x \d+\.\d mm", done.stdout)
    overlay = Path(done.stdout.splitlines()[-1].removeprefix("picture: "))
    height, *size = cv2.imread(str(overlay)).shape
    assert (size, height > 1200) == ([1600, 3], True), "the picture, and above it the caption"
    (job,) = jobs(tmp_path / "out" / "state" / "journal.sqlite")
    assert job["outcome"] == "accepted"


def test_what_make_demo_says_fits_on_one_screen_and_ends_with_the_picture(tmp_path: Path) -> None:
    make = need_program("make", "apt-get install make")
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    installed = tmp_path / ".installed"
    installed.touch()
    command = tmp_path / "combtrace"
    command.write_text(f'#!/bin/sh\nexec {" ".join(COMBTRACE)} "$@"\n')
    command.chmod(0o755)
    variables = [f"BIN={tmp_path}", f"STAMP={installed}"]
    # These tests may be run by make: one make in another says which folder it enters and leaves.
    alone = {name: value for name, value in ENVIRONMENT.items() if not name.startswith(("MAKE", "MFLAGS"))}
    done = subprocess.run(
        [make, "demo", *variables], cwd=tmp_path, env=alone, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    said = (done.stdout + done.stderr).splitlines()
    rows = sum(max(1, -(-len(line) // 80)) for line in said)
    assert rows <= 22, said  # of 24: one says that it installs, one is the prompt's
    assert said[-1].startswith("picture: ")
    assert (tmp_path / said[-1].removeprefix("picture: ")).exists()


def test_demo_can_be_run_again_in_the_same_folder(tmp_path: Path) -> None:
    assert combtrace("demo", "--output", tmp_path).returncode == 0
    again = combtrace("demo", "--output", tmp_path)
    assert again.returncode == 0
    first, second = (int(job["job_id"]) for job in jobs(tmp_path / "state" / "journal.sqlite"))
    assert f"job {second}: accepted" in again.stdout
    assert second > first + 1000, "as at every start"


def test_schema_prints_the_schema_that_config_yaml_names() -> None:
    done = called("schema")
    assert json.loads(done.stdout) == json.loads((SAMPLES.parents[1] / "config.schema.json").read_text())


@pytest.fixture
def cell(tmp_path: Path):
    started = Cell(tmp_path, triggers="[{kind: interval, period_s: 0.2}]", trigger_every_s=None)
    try:
        yield started
    finally:
        started.stop()


def test_an_interval_gives_job_after_job(cell: Cell) -> None:
    until(lambda: len(cell.settled()) >= 3, what="three jobs")
    assert {job["trigger_kind"] for job in cell.settled()} == {"interval"}
    assert {job["outcome"] for job in cell.settled()} == {"accepted"}
    assert cell.service.stop() == 0
    assert cell.controller.stop() == 0
    verdict = json.loads((cell.folder / "verdict.json").read_text())
    assert verdict["clean"], verdict["violations"]
    assert verdict["accepted"] >= 3


def test_check_says_that_all_is_well(cell: Cell) -> None:
    cell.ready()
    cell.service.stop()
    done = called("check", "--config", cell.folder / "config.yaml")
    assert done.returncode == 0, done.stdout
    assert [line.split()[:2] for line in done.stdout.splitlines()] == [
        ["ok", part]
        for part in ("config", "service", "calibration", "camera", "controller", "state", "archive", "journal")
    ] + [["ok", "disk"]] * 2 + [["ok", "clock"]]


def test_check_of_a_running_service_takes_nothing_from_it(cell: Cell) -> None:
    cell.goes_on(1)
    begun = len(cell.service.text)  # at its start it may have been there before its controller
    done = called("check", "--config", cell.folder / "config.yaml", "--json", "-")
    assert done.returncode == 0, done.stderr
    told = {one["part"]: one["text"] for one in json.loads(done.stdout)["findings"]}
    assert told["service"] == f"runs as process {cell.service.process_id}"
    for part in ("camera", "controller"):
        assert told[part].startswith(f"in use by the running service (process {cell.service.process_id})")
    # Another configuration for the same controller does not become its second client either.
    other = cell.folder / "other.yaml"
    text = (cell.folder / "config.yaml").read_text()
    other.write_text(text.replace("state_dir: state", "state_dir: other").replace("path: journal", "path: other"))
    done = called("check", "--config", other)
    assert done.returncode == 0, done.stdout
    assert "in use by another combtrace on this machine" in done.stdout
    assert called("check", "--config", other, "--strict").returncode == 1
    cell.goes_on(1)
    assert "-> Error" not in cell.service.text[begun:]
    assert json.loads(called("check", "--config", other, "--json", "-").stdout)["status"] == "warning"


def test_check_names_each_thing_that_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text(
        "camera: {kind: files, path: nowhere}\ncalibration: {file: nowhere.yaml}\n"
        f"controller: {{kind: modbus-tcp, port: {free_port()}}}\ntriggers: [{{kind: serial, port: /dev/nowhere}}]\n"
    )
    done = called("check", "--config", tmp_path / "config.yaml")
    assert done.returncode == 1
    faults = [line.split()[1] for line in done.stdout.splitlines() if line.startswith("FAULT")]
    assert faults == ["calibration", "camera", "controller", "serial"]


def test_check_without_devices_opens_none(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text(
        f"camera: {{kind: files, path: nowhere}}\ncalibration: {{file: {SAMPLES / 'calibration.yaml'}}}\n"
        f"controller: {{kind: modbus-tcp, port: {free_port()}}}\n"
    )
    done = called("check", "--config", tmp_path / "config.yaml", "--no-devices")
    assert done.returncode == 0
    assert "camera" not in done.stdout


def test_check_of_a_bad_configuration_has_status_2(tmp_path: Path) -> None:
    (tmp_path / "config.yaml").write_text("camra: 1\n")
    done = called("check", "--config", tmp_path / "config.yaml")
    assert done.returncode == 2
    assert "camra: unknown key; did you mean camera?" in done.stdout


# --- run --once -------------------------------------------------------------------------------------------------


def once(folder: Path, **changes: str):
    parts = {
        "camera": f"{{kind: files, path: {SAMPLES}}}",
        "calibration": f"{{file: {SAMPLES / 'calibration.yaml'}}}",
        "controller": "{kind: none}",
        **changes,
    }
    (folder / "config.yaml").write_text("".join(f"{key}: {value}\n" for key, value in parts.items() if value))
    return combtrace("run", "--once", "--config", folder / "config.yaml")


def test_once_accepted_has_status_0(cell: Cell, tmp_path: Path) -> None:
    cell.service.stop()
    done = combtrace("run", "--once", "--config", cell.folder / "config.yaml")
    assert done.returncode == 0, done.stderr
    assert re.search(r"job \d+ accepted: \d+ vertices, \d+\.\d mm²", done.stdout)


def test_once_without_a_controller_is_written_and_has_status_0(tmp_path: Path) -> None:
    done = once(tmp_path)
    assert done.returncode == 0, done.stderr
    assert "job 1 written" in done.stdout


def test_once_refused_has_status_3(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "empty.png"), np.full((1200, 1600), 30, np.uint8))
    done = once(tmp_path, camera="{kind: files, path: empty.png}")
    assert done.returncode == 3
    assert "110 no_block_found" in done.stdout


def test_once_with_a_calibration_for_another_size_is_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "small.png"), np.full((120, 160), 30, np.uint8))
    done = once(tmp_path, camera="{kind: files, path: small.png}")
    assert done.returncode == 3
    assert "141 calibration_mismatch" in done.stdout


def test_once_with_an_unusable_picture_has_status_1(tmp_path: Path) -> None:
    (tmp_path / "half.jpg").write_bytes((SAMPLES / "1-rectangle.jpg").read_bytes()[:90_000])
    done = once(tmp_path, camera="{kind: files, path: half.jpg}")
    assert done.returncode == 1
    assert "100 no_frame" in done.stdout


def test_once_with_an_absent_controller_has_status_1_and_says_why(tmp_path: Path) -> None:
    done = once(tmp_path, controller=f"{{kind: modbus-tcp, port: {free_port()}, ready_timeout_s: 1}}")
    assert done.returncode == 1
    assert "121 not_ready" in done.stderr
    assert done.stderr.strip().splitlines()[-1].startswith("combtrace run: not triggered")


def test_once_with_an_absent_v4l2_camera_has_status_1_and_says_why(tmp_path: Path) -> None:
    camera = "{kind: v4l2, device: /dev/no-camera, width: 640, height: 480}"
    done = once(tmp_path, camera=camera, controller="{kind: none, ready_timeout_s: 1}")
    assert done.returncode == 1
    assert "/dev/no-camera: No such file" in done.stderr


def test_once_with_a_bad_configuration_has_status_2(tmp_path: Path) -> None:
    assert once(tmp_path, recipes="[{number: 1}]").returncode == 2


def test_a_journal_that_is_none_stops_the_daemon_with_status_2_and_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "journal.sqlite").write_bytes(b"somebody's notes" * 100)
    done = once(tmp_path, journal="{path: journal.sqlite}")
    assert done.returncode == 2
    assert "journal.sqlite" in done.stderr
    assert (tmp_path / "journal.sqlite").read_bytes() == b"somebody's notes" * 100
