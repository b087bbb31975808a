"""align, verify and repeat on the shipped samples: what is written, what passes, what is refused and why."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from contour.calibration.calibration import Alignment, SimpleCalibration
from contour.calibration.position_uncertainty import PositionUncertainty
from service.cli.main import main
from service.measuring.calibration_file import CalibrationRecord, load_record, save_record

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
PICTURE = SAMPLES / "2-l-shape.jpg"
CALIBRATION = ["--calibration", str(SAMPLES / "calibration.yaml")]


@pytest.fixture(scope="module")
def master(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("master") / "master.json"
    assert main(["trace", str(PICTURE), *CALIBRATION, "--json", str(path)]) == 0
    return path


# --- verify -----------------------------------------------------------------------------------------------------------


def changed(master: Path, path: Path, scale: float, degrees: float = 0.0) -> Path:
    """The master drawn elsewhere, larger or smaller."""
    data = json.loads(master.read_text())["millimetres"]
    c, s = scale * np.cos(np.radians(degrees)), scale * np.sin(np.radians(degrees))
    turn = np.array([[c, s], [-s, c]])
    rings = {"exterior": (np.array(data["exterior"]) @ turn + [70, -20]).tolist(), "holes": []}
    path.write_text(json.dumps(rings))
    return path


def test_the_master_passes_wherever_it_is_drawn(
    master: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = changed(master, tmp_path / "m.json", 1.0, 130.0)
    assert main(["verify", "--outline", str(elsewhere), *CALIBRATION, str(PICTURE)]) == 0
    told = capsys.readouterr().out
    assert "worst 0.000 mm" in told
    assert "+130.000 degrees" in told
    assert main(["verify", "--fixed", "--outline", str(master), *CALIBRATION, str(PICTURE)]) == 0


def test_a_part_that_measures_wrong_fails_and_the_trend_keeps_both(
    master: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trend = tmp_path / "trend.csv"
    larger = changed(master, tmp_path / "m.json", 1.01)
    assert main(["verify", "--outline", str(master), *CALIBRATION, "--trend", str(trend), str(PICTURE)]) == 0
    assert "first line" in capsys.readouterr().out
    assert main(["verify", "--outline", str(larger), *CALIBRATION, "--trend", str(trend), str(PICTURE)]) == 3
    told = capsys.readouterr().out
    assert "FAIL" in told
    assert "last time 0.000 mm" in told
    rows = list(csv.DictReader(trend.read_text().splitlines()))
    assert [row["verdict"] for row in rows] == ["pass", "fail"]
    assert float(rows[1]["worst_mm"]) > 0.3


def test_a_part_that_lies_elsewhere_fails_in_place(master: Path, tmp_path: Path) -> None:
    moved = changed(master, tmp_path / "m.json", 1.0)
    assert main(["verify", "--fixed", "--outline", str(moved), *CALIBRATION, str(PICTURE)]) == 3


def test_a_picture_that_is_refused_is_no_pass(master: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", "--outline", str(master), *CALIBRATION, str(SAMPLES / "4-with-holes.jpg")]) == 2
    assert "holes, the master 0" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "is no JSON"),
        ("{}", "holds no outline in millimetres"),
        ('{"millimetres": null}', "holds no outline in millimetres"),
        ('{"exterior": [[0, 0], [1, 1]]}', "of shape (2, 2)"),
        ('{"exterior": [[0, 0], [1, NaN], [1, 1]]}', "not finite"),
        ('{"exterior": [[0, 0], [1, "a"], [1, 1]]}', "expected three or more points"),
        ('{"exterior": [[0, 0], [9, 9], [9, 0], [0, 9]]}', "is no outline of a part"),
    ],
)
def test_a_master_that_is_none_is_one_clear_line(
    text: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "m.json"
    path.write_text(text)
    assert main(["verify", "--outline", str(path), *CALIBRATION, str(PICTURE)]) == 2
    error = capsys.readouterr().err
    assert f"--outline {path}: " in error
    assert expected in error


def test_without_a_calibration_nothing_is_in_millimetres(master: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", "--outline", str(master), str(PICTURE)]) == 2
    assert "name the calibration" in capsys.readouterr().err


def test_a_file_that_is_no_trend_is_not_written_to(
    master: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n")
    assert main(["verify", "--outline", str(master), *CALIBRATION, "--trend", str(other), str(PICTURE)]) == 2
    assert "is no trend file" in capsys.readouterr().err
    assert other.read_text() == "a,b\n1,2\n"


# --- repeat -----------------------------------------------------------------------------------------------------------


def still(folder: Path, *pictures: Path) -> Path:
    """A configuration whose camera shows these pictures in turn."""
    (folder / "frames").mkdir()
    for number, picture in enumerate(pictures):
        shutil.copy(picture, folder / "frames" / f"{number}{picture.suffix}")
    data = {
        "camera": {"kind": "files", "path": "frames", "loop": True},
        "calibration": {"file": str(SAMPLES / "calibration.yaml")},
        "controller": {"kind": "none"},
    }
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def test_a_still_scene_repeats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config, trend = still(tmp_path, PICTURE), tmp_path / "trend.csv"
    assert main(["repeat", "--count", "3", "--config", str(config), "--trend", str(trend)]) == 0
    assert "pass      worst 0.000 mm" in capsys.readouterr().out
    assert "repeat" in trend.read_text()


def test_a_scene_that_is_not_still_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = still(tmp_path, SAMPLES / "1-rectangle.jpg", PICTURE)
    assert main(["repeat", "--count", "4", "--config", str(config)]) == 3
    assert "FAIL" in capsys.readouterr().out


def test_repeat_needs_a_camera_and_a_count(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["repeat"]) == 2
    assert main(["repeat", "--count", "1", "--config", str(still(tmp_path, PICTURE))]) == 2
    assert "--count 1: expected 3" in capsys.readouterr().err


# --- align ------------------------------------------------------------------------------------------------------------

MACHINE = Alignment(30.0, (1000.0, -50.0))
WORK = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0]])


def align(folder: Path, points: np.ndarray, machine: np.ndarray, header: str = "x_mm,y_mm", *more: str) -> int:
    rows = "\n".join(",".join(map(str, row)) for row in np.hstack([points, machine]).tolist())
    (folder / "points.csv").write_text(f"{header},machine_x_mm,machine_y_mm\n{rows}\n")
    if not (folder / "c.yaml").exists():
        shutil.copy(SAMPLES / "calibration.yaml", folder / "c.yaml")
    return main(["align", "--points", str(folder / "points.csv"), "--calibration", str(folder / "c.yaml"), *more])


def test_work_points_align_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert align(tmp_path, WORK, MACHINE.apply(WORK)) == 0
    record = load_record(tmp_path / "c.yaml")
    assert record.calibration.alignment is not None
    assert record.calibration.alignment.rotation_deg == pytest.approx(30.0, abs=1e-9)
    np.testing.assert_allclose(record.calibration.alignment.translation_mm, (1000.0, -50.0), atol=1e-9)
    assert record.made["alignment_worst_mm"] == 0
    assert "scale     1.000000, told and not applied" in capsys.readouterr().out


def test_pixels_at_a_height_align_it_too(tmp_path: Path) -> None:
    calibration = load_record(SAMPLES / "calibration.yaml").calibration
    pixels = np.array([[100.0, 100.0], [1500.0, 150.0], [1400.0, 1100.0]])
    machine = MACHINE.apply(calibration.to_work(pixels, 20.0))
    assert align(tmp_path, pixels, machine, "x_px,y_px", "--height-mm", "20", "--output", str(tmp_path / "d.yaml")) == 0
    aligned = load_record(tmp_path / "d.yaml").calibration
    np.testing.assert_allclose(aligned.to_machine(aligned.to_work(pixels, 20.0)), machine, atol=1e-6)
    assert load_record(tmp_path / "c.yaml").calibration.alignment == Alignment(0.0, (0.0, 0.0))


def test_marks_off_the_calibrations_plane_or_beyond_what_it_covers_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pixels = np.array([[100.0, 100.0], [1500.0, 150.0], [1400.0, 1100.0]])
    ring = np.array([[0.0, 0.0], [1599.0, 0.0], [1599.0, 800.0], [0.0, 800.0]])
    sure = replace(PositionUncertainty.everywhere(1600, 1200, 0.1), covered_px=ring)
    plain = SimpleCalibration(1600, 1200, 0.375, (0.0, 1199.0), 20.0, uncertainty=sure)
    machine = MACHINE.apply(plain.to_work(pixels, 20.0))
    save_record(tmp_path / "c.yaml", CalibrationRecord(plain))
    assert align(tmp_path, pixels, machine, "x_px,y_px") == 2
    advice = capsys.readouterr().err.strip().split(", and ")[1].split()
    assert advice == ["--height-mm", "20"]
    assert align(tmp_path, pixels, machine, "x_px,y_px", *advice) == 0
    assert "WARNING   pixel (1400, 1100) lies where the calibration is not covered" in capsys.readouterr().out


MIRROR = np.array([1.0, -1.0])


@pytest.mark.parametrize(
    ("work", "machine", "status", "expected"),
    [
        (WORK, MACHINE.apply(WORK) + np.array([[0, 0], [0, 2], [0, 0], [0, 0]]), 3, "point 2 lies 1."),
        (
            WORK,
            MACHINE.apply(WORK) * 1.01,
            3,
            "the scale between both is 1.01000 ± 0.00000 (95 %), within 0.1 % of 1 is allowed. Check --",
        ),
        (WORK, MACHINE.apply(WORK * MIRROR), 3, "A mirrored fit is better"),
        (WORK[:2], WORK[:2], 2, "2 points, expected 3 or more"),
        (WORK[[0, 0, 1]], WORK[[0, 0, 1]], 2, "lie on one line"),
        (np.array([[0.0, 0], [1, 1], [2, 2], [3, 3]]), WORK, 2, "the work points lie on one line"),
    ],
)
def test_points_that_do_not_fit_are_refused(
    work: np.ndarray,
    machine: np.ndarray,
    status: int,
    expected: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    shutil.copy(SAMPLES / "calibration.yaml", tmp_path / "c.yaml")
    before = (tmp_path / "c.yaml").read_bytes()
    assert align(tmp_path, work, machine) == status
    assert expected in capsys.readouterr().err
    assert (tmp_path / "c.yaml").read_bytes() == before


def test_a_scale_of_1_003_is_refused_by_name_although_every_point_lies_near(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Over 260 x 195 mm the scale moves no point by more than the 0.49 mm that once passed."""
    work = 0.65 * WORK
    machine = MACHINE.apply(1.003 * work)
    shutil.copy(SAMPLES / "calibration.yaml", tmp_path / "c.yaml")
    record = load_record(tmp_path / "c.yaml")
    save_record(tmp_path / "c.yaml", replace(record, made={"square_mm": 25.0}))
    before = (tmp_path / "c.yaml").read_bytes()
    assert align(tmp_path, work, machine) == 3
    told = capsys.readouterr()
    assert "point 1: off by 0.487 mm" in told.out
    assert "the scale between both is 1.00300" in told.err
    assert "(squares of 25.075 mm would give 1)" in told.err
    assert (tmp_path / "c.yaml").read_bytes() == before
    options = told.err.strip().split("To take it nevertheless: ")[1].split()
    assert "--accept-scale-percent" in options
    assert align(tmp_path, work, machine, "x_mm,y_mm", *options) == 0


def test_advice_for_a_point_that_is_off_takes_it_and_a_mirrored_frame_gets_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    off = MACHINE.apply(WORK) + np.array([[0, 0], [0, 2], [0, 0], [0, 0]])
    assert align(tmp_path, WORK, off) == 3
    options = capsys.readouterr().err.strip().split("To take it nevertheless: ")[1].split()
    assert align(tmp_path, WORK, off, "x_mm,y_mm", *options) == 0
    capsys.readouterr()
    assert align(tmp_path, WORK, MACHINE.apply(WORK * MIRROR)) == 3
    assert "nevertheless" not in capsys.readouterr().err


def test_repeats_say_how_well_was_jogged_and_three_places_not_which_is_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twice = np.vstack([WORK, WORK])
    jogged = MACHINE.apply(twice) + np.repeat([[0.03, -0.03], [-0.03, 0.03]], 4, axis=0)
    assert align(tmp_path, twice, jogged) == 0
    told = capsys.readouterr().out
    assert "jogging   0.042 mm by 4 repeats; explains misses up to 0.1" in told
    assert align(tmp_path, WORK[:3], MACHINE.apply(WORK[:3])) == 0
    told = capsys.readouterr().out
    assert "jogging   0.150 mm as told (--jog-mm); jog to points twice to measure it; explains misses up to 0.4" in told
    assert "3 places show that one is off, not which" in told
