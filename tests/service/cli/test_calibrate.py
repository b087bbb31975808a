"""`combtrace calibrate` on rendered views, points and scales: files that load, reports, or one clear line."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from contour.calibration.calibration import CameraCalibration, SimpleCalibration
from contour.calibration.plane_calibration import PlaneCalibration
from contour.camera_calibration.board import Board
from contour.synthetic.board_poses import BoardPose, board_poses
from service.cli.main import main
from service.measuring.calibration_file import load_record
from tests.support.pictures.board_scenes import CHARUCO, SMALL, picture

BOARD = ["--board", "charuco", "--squares", "11x8", "--square-mm", "30", "--marker-mm", "21"]


@pytest.fixture(scope="module")
def views(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten views of a board: flat.png on the table, 1.png … 9.png held."""
    folder = tmp_path_factory.mktemp("views")
    for number, pose in enumerate(board_poses(CHARUCO, SMALL, 10, np.random.default_rng(4))):
        name = "flat.png" if number == 0 else f"{number}.png"
        cv2.imwrite(str(folder / name), picture(CHARUCO, SMALL, pose, number))
    return folder


def images(views: Path) -> list[str]:
    return [str(path) for path in sorted(views.glob("*.png"))]


def test_views_become_a_calibration_and_a_report(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    odd = tmp_path / "odd.png"
    cv2.imwrite(str(odd), np.full((480, 640), 90, np.uint8))
    output = tmp_path / "cell.yaml"
    options = ["--plane", str(views / "flat.png"), "--output", str(output), "--camera-name", "cam7", str(odd)]
    assert main(["calibrate", *BOARD, *options, *images(views)]) == 0
    told = capsys.readouterr()
    assert "good: 95 % of positions are within" in told.out
    assert f"not used  {odd}: it is 640 x 480 px, the plane view 960 x 720" in told.out
    assert "cross-validating the lens model 'k1'" in told.err
    record = load_record(output)
    assert isinstance(record.calibration, CameraCalibration)
    assert record.camera_name == "cam7"
    assert record.created is not None
    assert record.made["views"] == 10
    sure = record.calibration.uncertainty
    assert sure is not None
    true = SMALL.back_project(np.array([[480.0, 360.0]]), 20.0)
    flat = board_poses(CHARUCO, SMALL, 10, np.random.default_rng(4))[0]
    found = record.calibration.to_work(np.array([[480.0, 360.0]]), 20.0)
    assert np.linalg.norm(found - (true - flat.translation_mm[:2])) < sure.figure_mm(20.0) + 0.02
    report = output.with_suffix(".html").read_text()
    assert report.count("<svg") == 8
    for part in ("data:image/jpeg;base64,", "good: 95 %", "url(#hatch)", "cam7", "another resolution", "0.0"):
        assert part in report
    assert "http" not in report


def test_a_verdict_that_is_not_good_writes_the_report_and_no_file(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "cell.yaml"
    options = ["--plane", str(views / "flat.png"), "--output", str(output), "--accept-mm", "0.001"]
    assert main(["calibrate", *BOARD, *options, *images(views)]) == 3
    assert not output.exists()
    assert "repeat with more and sharper views" in output.with_suffix(".html").read_text()
    told = capsys.readouterr().err
    assert "not written" in told
    advice = told.strip().split("To take it nevertheless: ")[1].split()
    assert main(["calibrate", *BOARD, *options, *images(views), *advice]) == 0


def calibrated(views: Path, output: Path, *options: str, square_mm: str = "30") -> int:
    board = ["--board", "charuco", "--squares", "11x8", "--square-mm", square_mm]
    plane = ["--plane", str(views / "flat.png"), "--output", str(output)]
    return main(["calibrate", *board, *plane, *options, *images(views)])


def test_tape_and_result_stand_side_by_side_and_a_wrong_square_is_refused_by_them(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output, tape = tmp_path / "cell.yaml", f"{SMALL.position_mm[2]:.0f}"
    assert calibrated(views, output, "--camera-height-mm", tape, square_mm="25") == 3
    told = capsys.readouterr()
    report = output.with_suffix(".html").read_text()
    for text in (told.out, report):
        assert f"mm by the calibration, {tape} mm measured: 16." in text
        assert f"squares of 30.0 mm would give {tape[:3]}" in text
    assert 'class="verdict bad"' in report
    assert not output.exists()
    assert told.err.endswith("To take it nevertheless: --accept-apart-percent 17\n")
    assert calibrated(views, output, "--camera-height-mm", tape, "--accept-apart-percent", "17", square_mm="25") == 0
    assert "WARNING   camera above the table" in capsys.readouterr().out
    assert f"measured {tape}" in str(load_record(output).made["compared_lengths"])
    assert calibrated(views, output, "--camera-height-mm", tape) == 0
    assert "WARNING" not in capsys.readouterr().out


def test_a_known_length_in_the_picture_is_told_beside_the_result(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ends = np.array([[200.0, 200.0], [700.0, 500.0]])
    length_mm = float(np.linalg.norm(np.diff(SMALL.back_project(ends, 0.0), axis=0)))
    between = ["--between", "200,200", "700,500"]
    assert calibrated(views, tmp_path / "x.yaml", "--known-length-mm", f"{length_mm:.1f}", *between) == 0
    assert f"known length on the table {length_mm:.0f} mm by the calibration" in capsys.readouterr().out
    assert calibrated(views, tmp_path / "x.yaml", "--known-length-mm", f"{1.1 * length_mm:.1f}", *between) == 3


def test_an_area_that_no_corner_reached_is_refused_unless_told_otherwise(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "cell.yaml"
    assert calibrated(views, output, "--area-px", "0,0,959,719") == 3
    told = capsys.readouterr()
    assert "of --area-px (0, 0)" in told.out
    assert told.err.endswith("To take it nevertheless: --accept-uncovered\n")
    assert calibrated(views, output, "--area-px", "0,0,959,719", "--accept-uncovered") == 0


def test_views_of_less_than_half_serve_for_that_part_and_blocks_beyond_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = Board("charuco", 11, 8, 15.0, 10.5, "DICT_5X5_250")
    middle = np.array([240.0, 180.0, 0.0])
    for number, (turn, place) in enumerate(board_poses(small, SMALL, 10, np.random.default_rng(4))):
        pose = BoardPose(turn, middle + 0.4 * (place - middle))
        cv2.imwrite(
            str(tmp_path / ("flat.png" if number == 0 else f"{number}.png")), picture(small, SMALL, pose, number)
        )
    output = tmp_path / "cell.yaml"
    assert calibrated(tmp_path, output, "--block-mm", "20", square_mm="15") == 0
    told = capsys.readouterr().out
    assert "verdict   good in " in told
    assert "a block that leaves that part is refused (115 outside_work_area)" in told
    sure = load_record(output).calibration.uncertainty
    assert sure is not None
    assert len(sure.uncovered(np.array([[480.0, 360.0], [2.0, 2.0]]))) == 1
    assert calibrated(tmp_path, output, "--block-mm", "20", "--accept-uncovered", square_mm="15") == 0
    assert "contours outside of it are taken, too" in capsys.readouterr().out
    sure = load_record(output).calibration.uncertainty
    assert sure is not None
    assert sure.covered_px is None


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--output", "x.yaml"], "expected one of --board, --points and --scale, seen none"),
        (["--output", "x.yaml", "--scale", "1", "--points", "a.csv"], "seen points and scale"),
        (["--output", "x.yaml", "--scale", "1"], "--scale needs --size WxH"),
        (["--output", "x.yaml", "--scale", "-1", "--size", "9x9"], "mm_per_pixel is -1.0"),
        (["--output", "x.yaml", "--scale", "1", "--size", "9x9", "--camera-height-mm", "9"], "give --known-length-mm"),
        (["--output", "x.yaml", "--scale", "1", "--size", "9x9", "--accept-uncovered"], "no views that cover an area"),
        (["--output", "x.yaml", "--scale", "1", "--size", "9x9", "--known-length-mm", "9"], "belong together"),
        (["--output", "x.yaml", *BOARD, "--plane", "a.png", "--accept-apart-percent", "0"], "--accept-apart-percent 0"),
        (["--output", "x.yaml", "--board", "chessboard"], "--board needs --squares and --square-mm and --plane"),
        (
            ["--output", "x.yaml", "--board", "chessboard", "--squares", "8x8", "--square-mm", "9", "--plane", "a.png"],
            "both counts are even",
        ),
        (["--output", "x.yaml", *BOARD, "--plane", "gone.png"], "gone.png: cannot be read"),
        (["--output", "x.yaml", *BOARD, "--plane", "a.png", "--accept-mm", "nan"], "--accept-mm nan"),
        (["--output", "x.yaml", *BOARD, "--plane", "a.png", "--board-thickness-mm", "nan"], "--board-thickness-mm nan"),
        (["--output", "gone/x.yaml", *BOARD, "--plane", "a.png"], "--output gone/x.yaml: there is no folder gone"),
        (["--output", "x.html", *BOARD, "--plane", "a.png"], "the report would overwrite it"),
    ],
)
def test_wrong_usage_is_one_clear_line(
    arguments: list[str], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", *arguments]) == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_too_few_views_are_an_error_that_names_the_others(
    views: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--plane", str(views / "flat.png"), "--output", str(tmp_path / "x.yaml")]
    assert main(["calibrate", *BOARD, *options, *images(views)[:4], str(views / "flat.png")]) == 2
    assert "too few views: 5 can be used" in capsys.readouterr().err


# --- without a board --------------------------------------------------------------------------------------------------

POINTS = "x_px,y_px,x_mm,y_mm\n100,1100,0,0\n1500,1100,560,0\n1500,100,560,400\n100,100,0,400\n800,600,280,200\n"


def from_points(tmp_path: Path, text: str, *more: str) -> int:
    (tmp_path / "points.csv").write_text(text)
    options = ["--points", str(tmp_path / "points.csv"), "--size", "1600x1200", "--output", str(tmp_path / "x.yaml")]
    return main(["calibrate", *options, *more])


def test_points_become_a_homography(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert from_points(tmp_path, POINTS, "--plane-height-mm", "20") == 0
    calibration = load_record(tmp_path / "x.yaml").calibration
    assert isinstance(calibration, PlaneCalibration)
    np.testing.assert_allclose(calibration.to_work(np.array([[450.0, 850.0]]), 20), [[140, 100]], atol=1e-6)
    assert calibration.height_known(20)
    assert not calibration.height_known(0)
    assert "point 5: off by 0.000 mm" in capsys.readouterr().out


def test_points_may_lack_a_header_and_be_european(tmp_path: Path) -> None:
    body = "\n".join(POINTS.splitlines()[1:])
    assert from_points(tmp_path, body) == 0
    assert from_points(tmp_path, body.replace(",", ";").replace("280", "280,0")) == 0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "is empty"),
        ("x_px,y_px,x_mm,y_mm\n", "has a header and no points"),
        ("a,b,c,d\n1,2,3,4\n", "columns are a, b, c, d; expected x_px,y_px,x_mm,y_mm"),
        (POINTS.replace("800", "nan"), "line 6: x_px is 'nan', expected a finite number"),
        (POINTS.replace("800", "many"), "line 6: x_px is 'many'"),
        (POINTS + "5,6\n", "line 7: 2 columns, x_mm is missing"),
        ("\n".join(POINTS.splitlines()[:4]), "3 points, expected 4 or more"),
        ("x_px,y_px,x_mm,y_mm\n0,0,0,0\n10,10,1,1\n20,20,2,2\n30,30,3,3\n", "lie on one line"),
        ("x_px,y_px,x_mm,y_mm\n0,0,0,0\n900,0,1,0\n900,900,1,1\n0,900,0,1\n", "mirrors the picture"),
        (POINTS.replace("1500,100", "1700,100"), "outside the picture of 1600 x 1200"),
    ],
)
def test_points_that_do_not_serve_are_one_clear_line(
    text: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert from_points(tmp_path, text) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "x.yaml").exists()


def test_points_that_contradict_one_another_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = POINTS.replace("280,200", "290,200")
    assert from_points(tmp_path, wrong) == 3
    told = capsys.readouterr().err
    assert "1 mm are allowed" in told
    assert from_points(tmp_path, wrong, *told.strip().split("To take it nevertheless: ")[1].split()) == 0


def test_a_scale_becomes_the_simple_form(tmp_path: Path) -> None:
    options = ["--scale", "0.375", "--size", "1600x1200", "--origin-px", "100,1100"]
    assert main(["calibrate", *options, "--output", str(tmp_path / "x.yaml")]) == 0
    calibration = load_record(tmp_path / "x.yaml").calibration
    assert isinstance(calibration, SimpleCalibration)
    np.testing.assert_allclose(calibration.to_work(np.array([[200.0, 1000.0]]), 0), [[37.5, 37.5]])


@pytest.mark.parametrize(("length_mm", "status", "told"), [(301, 0, "lengths"), (312, 0, "WARNING"), (330, 3, "apart")])
def test_a_scale_is_held_against_a_known_length(
    length_mm: int, status: int, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--scale", "0.375", "--size", "1600x1200", "--known-length-mm", str(length_mm)]
    output = tmp_path / "x.yaml"
    assert main(["calibrate", *options, "--between", "100,100", "900,100", "--output", str(output)]) == status
    text = capsys.readouterr()
    assert told in text.out
    assert output.exists() is (status == 0)
    if status:
        assert "Check --scale: 1.1 times as much would agree" in text.err
        assert "--accept-apart-percent 10" in text.err


def test_points_are_held_against_a_known_length(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    between = ["--between", "100,1100", "1500,1100"]
    assert from_points(tmp_path, POINTS, "--known-length-mm", "561", *between) == 0
    assert from_points(tmp_path, POINTS, "--known-length-mm", "672", *between) == 3
    assert "the points' millimetres: all times 1.2 would agree" in capsys.readouterr().err
