"""The whole chain: a GigE Vision camera on loopback, the daemon, the simulated controller, each of them killed."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest

from contour.synthetic.board_poses import board_poses
from service.cli.main import main
from service.measuring.calibration_file import load_record
from tests.support.gige_camera import GigeCamera, aravis_is_loaded, need_aravis
from tests.support.pictures.board_scenes import CHARUCO, SMALL, picture
from tests.support.pictures.combs import SIZES, comb, write_combs
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client
from tests.support.processes.processes import called, free_port, lines, until

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
    looked = called("live", "--config", config, "--frames", "3", "--json")
    assert [json.loads(line)["sequence"] for line in looked.stdout.splitlines()] == [1, 2, 3], looked.stderr


def test_a_deep_camera_is_calibrated_by_what_it_shows(tmp_path):
    need_aravis()
    poses = board_poses(CHARUCO, SMALL, 10, np.random.default_rng(4))
    shown = [picture(CHARUCO, SMALL, pose, number).astype("<u2") << 4 for number, pose in enumerate(poses)]
    config, views = tmp_path / "config.yaml", [tmp_path / f"{number}.png" for number in range(len(shown))]
    made = "width: 960, height: 720, pixel_format: Mono12, exposure_us: 2000, packet_size: 9000, timeout_s: 5"
    config.write_text(f"camera: {{kind: genicam, serial: GV7, {made}}}\ncontroller: {{kind: none}}\ntriggers: []\n")
    # A command takes two frames, three where one came broken: shown twice each, none is passed over for ever.
    with GigeCamera(tmp_path, [frame.view(np.uint8) for frame in shown for _ in range(2)]):
        for _ in range(10 * len(views)):
            assert main(["grab", "--config", str(config), "--output", str(tmp_path / "seen.png")]) == 0
            seen = cv2.imread(str(tmp_path / "seen.png"), cv2.IMREAD_UNCHANGED)
            assert seen.dtype == np.uint16
            number = next(n for n, frame in enumerate(shown) if (seen.ravel()[8:] >> 4 == frame.ravel()[8:]).all())
            (tmp_path / "seen.png").rename(views[number])
            if all(view.exists() for view in views):
                break
        else:
            pytest.fail("the camera did not show every view")
    board = ["--board", "charuco", "--squares", "11x8", "--square-mm", "30", "--marker-mm", "21"]
    output = tmp_path / "cell.yaml"
    assert main(["calibrate", *board, "--plane", str(views[0]), "--output", str(output), *map(str, views)]) == 0
    record = load_record(output)
    assert record.made["views"] == len(shown)
    true = SMALL.back_project(np.array([[480.0, 360.0]]), 20.0) - poses[0].translation_mm[:2]
    found = record.calibration.to_work(np.array([[480.0, 360.0]]), 20.0)
    assert np.linalg.norm(found - true) < record.calibration.uncertainty.figure_mm(20.0) + 0.02


def test_deep_frames_are_archived_whole_and_replayed_to_the_bit(tmp_path):
    need_aravis()
    write_combs(tmp_path / "combs")
    dim = [comb(*size).astype("<u2") for size in SIZES]  # 8 of 12 bits: a sixteenth of the light
    page = Client(free_port())
    with GigeCamera(tmp_path, [picture.view(np.uint8) for picture in dim]):
        cell = Cell(
            tmp_path,
            camera=CAMERA % ", pixel_format: Mono12",
            calibration=tmp_path / "combs.yaml",
            more=f"archive: {{path: archive}}\npage: {{port: {page.port}}}\n",
        )
        try:
            cell.goes_on(3)
            job = cell.number(1)
            until(lambda: page.get(f"/api/v1/frames/{job}").status == 200, what="the frame on the page")
            shown = page.get(f"/api/v1/frames/{job}")
        finally:
            cell.stop()
    assert cv2.imdecode(np.frombuffer(shown.body, np.uint8), cv2.IMREAD_GRAYSCALE).max() > 150, "as dim as it was taken"
    frames = sorted((tmp_path / "archive").rglob("*-frame.png"))
    assert frames
    kept = cv2.imread(str(frames[0]), cv2.IMREAD_UNCHANGED)
    assert kept.dtype == np.uint16
    assert any(np.array_equal(kept.ravel()[8:], picture.ravel()[8:] << 4) for picture in dim)
    for job in [job for job in cell.settled() if job["outcome"] == "accepted"][:3]:
        replayed = called("replay", str(job["job_id"]), "--config", tmp_path / "config.yaml")
        assert replayed.returncode == 0, replayed.stdout + replayed.stderr
