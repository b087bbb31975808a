"""The whole chain: a GigE Vision camera on loopback, the daemon, the simulated controller, each of them killed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.support.gige_camera import GigeCamera, aravis_is_loaded, need_aravis
from tests.support.pictures.combs import SIZES, comb, write_combs
from tests.support.processes.cell import Cell
from tests.support.processes.processes import called, lines, until

__all__ = ["aravis_is_loaded"]
CAMERA = '{kind: genicam, serial: "GV7", width: 320, height: 240, exposure_us: 2000, timeout_s: 2%s}'


@pytest.fixture
def gige(tmp_path):
    need_aravis()
    with GigeCamera(tmp_path, [comb(*size) for size in SIZES]) as camera:
        yield camera


@pytest.fixture
def cell(gige, tmp_path):
    write_combs(tmp_path / "combs")
    made = Cell(tmp_path, camera=CAMERA % "", calibration=tmp_path / "combs.yaml", more="archive: {path: archive}\n")
    yield made
    made.stop()


def accepted_jobs(cell):
    """The jobs that ended accepted."""
    return {int(job["job_id"]) for job in cell.settled() if job["outcome"] == "accepted"}


def test_blocks_seen_by_a_gige_camera_reach_the_controller_whoever_is_killed(gige, cell):
    cell.ready()
    cell.goes_on(3)

    gige.kill()
    until(lambda: "the camera has gone" in cell.service.text, what="the camera's loss told")
    until(lambda: "-> Error reason" in cell.service.text, what="Error")
    gige.start()
    cell.goes_on(3)

    cell.controller.kill()
    cell.controller = cell.start_controller()
    cell.goes_on(3)

    cell.service.kill()  # the camera believes in its client for three seconds more
    cell.service = cell.start_service()
    cell.goes_on(3)

    areas = {round(float(entry["area_mm2"])) for entry in lines(cell.accepted)}
    assert len(areas) == len(SIZES), "every block that the camera shows was seen"
    taken = {int(entry["job_id"]) for entry in lines(cell.accepted)}
    until(lambda: taken <= accepted_jobs(cell), what="what the controller took, accepted in the journal")


def test_a_camera_s_commands_work_on_it(gige, tmp_path):
    (tmp_path / "config.yaml").write_text(f"camera: {CAMERA % ''}\ncontroller: {{kind: none}}\ntriggers: []\n")
    config = tmp_path / "config.yaml"
    listed = called("cameras")
    assert 'serial: "GV7"' in listed.stdout
    assert 'user_name: "over table 2"' in listed.stdout
    grabbed = called("grab", "--config", config, "--output", tmp_path / "seen.png")
    assert "packets of" in grabbed.stdout, grabbed.stderr
    assert "ExposureTimeAbs = 2000" in grabbed.stdout
    seen = cv2.imread(str(tmp_path / "seen.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(seen.ravel()[8:], comb(*SIZES[1]).ravel()[8:])
    focused = called("focus", "--config", config, "--frames", "2")
    assert focused.returncode == 0, focused.stderr
    checked = called("check", "--config", config)
    assert "genicam GV7: 320 x 240 px" in checked.stdout, checked.stdout + checked.stderr


def test_deep_frames_are_archived_whole_and_replayed_to_the_bit(tmp_path):
    need_aravis()
    write_combs(tmp_path / "combs")
    dim = [comb(*size).astype("<u2") for size in SIZES]  # 8 of 12 bits: a sixteenth of the light
    with GigeCamera(tmp_path, [picture.view(np.uint8) for picture in dim]):
        cell = Cell(
            tmp_path,
            camera=CAMERA % ", pixel_format: Mono12",
            calibration=tmp_path / "combs.yaml",
            more="archive: {path: archive}\n",
        )
        try:
            cell.goes_on(3)
        finally:
            cell.stop()
    frames = sorted((tmp_path / "archive").rglob("*-frame.png"))
    assert frames
    kept = cv2.imread(str(frames[0]), cv2.IMREAD_UNCHANGED)
    assert kept.dtype == np.uint16
    assert any(np.array_equal(kept.ravel()[8:], picture.ravel()[8:] << 4) for picture in dim)
    for job in [job for job in cell.settled() if job["outcome"] == "accepted"][:3]:
        replayed = called("replay", str(job["job_id"]), "--config", tmp_path / "config.yaml")
        assert replayed.returncode == 0, replayed.stdout + replayed.stderr
