"""A calibration that is too old, of another camera, or of a camera that was moved is not used; the reason is told."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from contour.calibration.calibration import CameraCalibration
from contour.calibration.fixed_marks import Sentinels, see_sentinels
from contour.calibration.position_uncertainty import PositionUncertainty
from service.cli.main import main
from service.config.recipes import Recipe
from service.measuring.calibration_file import CalibrationRecord, save_record
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.pictures.fixed_mark_scenes import CAMERA, bumped, marked

MADE = datetime(2026, 3, 1, tzinfo=UTC)
SEEN = see_sentinels(marked(CAMERA), "DICT_4X4_50")
assert SEEN is not None
EMPTY = np.full((CAMERA.height, CAMERA.width), 90, np.uint8)


def calibration() -> CameraCalibration:
    """The truth, as a calibration."""
    return CameraCalibration(
        CAMERA.width,
        CAMERA.height,
        CAMERA.matrix,
        np.array(CAMERA.distortion),
        np.array(CAMERA.rotation_vector),
        np.array(CAMERA.translation_mm),
    )


def guard(
    sentinels: Sentinels | None = SEEN, *, name: str = "", days: float = 0.0, made: datetime | None = MADE, **limits
):
    record = CalibrationRecord(calibration(), name, made, sentinels)
    return CalibrationGuard(record, GuardLimits(**limits), now=lambda: MADE + timedelta(days=days))


def test_a_calibration_expires() -> None:
    assert guard(days=29, max_age_days=30).expired() is None
    assert guard(days=4000).expired() is None
    reason, text = guard(days=31, max_age_days=30).expired()
    assert reason is Reason.CALIBRATION_MISMATCH
    assert "31.0 days old, 30 are allowed" in text
    assert "does not say when it was made" in guard(made=None, max_age_days=30).expired()[1]
    assert "in the future" in guard(days=-5, max_age_days=30).expired()[1]


def test_another_camera_is_refused_where_both_are_named() -> None:
    assert guard(name="cam7").other_camera("cam7") is None
    assert guard(name="cam7").other_camera("") is None
    assert guard(name="").other_camera("cam8") is None
    reason, text = guard(name="cam7").other_camera("cam8")
    assert reason is Reason.CALIBRATION_MISMATCH
    assert "of camera 'cam8', the calibration of 'cam7'" in text


def test_a_bump_is_refused_and_no_bump_is_not() -> None:
    assert guard().findings(marked(CAMERA, seed=2)) == ()
    found = guard().findings(marked(bumped(CAMERA, yaw_deg=0.3)))
    assert [reason for reason, _ in found] == [Reason.SENTINEL_MOVED]
    assert "mark 3 by " in found[0][1]


def test_marks_that_nobody_sees_are_refused_where_they_are_required() -> None:
    assert guard(sentinels_required=False).findings(EMPTY) == ()
    assert guard(None).findings(EMPTY) == ()
    assert "None of the fixed marks (3, 4) is seen" in guard().findings(EMPTY)[0][1]


def test_a_picture_of_another_size_is_not_searched_for_marks() -> None:
    assert guard().findings(EMPTY[:100]) == ()


def test_all_reasons_reach_the_measurement_lowest_code_first() -> None:
    watch = guard(name="cam7", days=31, max_age_days=30)
    measurer = Measurer(watch.record.calibration, guard=watch)
    found = measurer.measure(EMPTY, Recipe(number=1, name="a"), 20.0, "cam8")
    assert found.reasons == (
        Reason.NO_BLOCK_FOUND,
        Reason.CALIBRATION_MISMATCH,
        Reason.CALIBRATION_MISMATCH,
        Reason.SENTINEL_MOVED,
    )


# --- the commands -----------------------------------------------------------------------------------------------------


def cell(folder: Path, picture: np.ndarray, record: CalibrationRecord, **limits: object) -> Path:
    """A configuration with one picture and no controller."""
    cv2.imwrite(str(folder / "frame.png"), picture)
    save_record(folder / "calibration.yaml", record)
    config = folder / "config.yaml"
    data = {
        "camera": {"kind": "files", "path": "frame.png"},
        "calibration": {"file": "calibration.yaml", **limits},
        "controller": {"kind": "none"},
    }
    config.write_text(yaml.safe_dump(data))
    return config


def test_check_shows_age_figure_and_offsets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = CalibrationRecord(calibration(), "cam7", datetime.now(UTC) - timedelta(days=2), SEEN)
    config = cell(tmp_path, marked(CAMERA, seed=5), record)
    assert main(["check", "--config", str(config)]) == 0
    told = capsys.readouterr().out
    assert "2.0 days old" in told
    assert "95 % of positions within, mm: not stated" in told
    assert "2 fixed marks" in told
    assert "fixed marks: mark 3 by 0.0" in told


def test_check_warns_of_a_work_area_that_the_calibration_does_not_cover(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    width, height = calibration().image_width, calibration().image_height
    ring = np.array([[0.0, 0.0], [width / 2, 0.0], [width / 2, height], [0.0, height]])
    sure = replace(PositionUncertainty.everywhere(width, height, 0.1), covered_px=ring)
    covering = replace(calibration(), uncertainty=sure)
    inner = np.array([[0.1, 0.1], [0.4, 0.1], [0.4, 0.9], [0.1, 0.9]]) * [width, height]
    config = cell(tmp_path, EMPTY, CalibrationRecord(covering))
    for pixels, told in ((inner, False), (inner * [2.0, 1.0], True)):
        area = covering.to_machine(covering.to_work(pixels, 20.0)).round(1).tolist()
        data = yaml.safe_load(config.read_text()) | {"work_area_mm": area}
        config.write_text(yaml.safe_dump(data))
        assert main(["check", "--config", str(config)]) == 0
        assert ("mm lie where it is not covered" in capsys.readouterr().out) is told


def test_check_tells_a_bump_and_an_old_calibration(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = CalibrationRecord(calibration(), "", datetime.now(UTC) - timedelta(days=9), SEEN)
    config = cell(tmp_path, marked(bumped(CAMERA, shift_px=(2.0, 0.0))), record, max_age_days=7)
    assert main(["check", "--config", str(config)]) == 1
    told = capsys.readouterr().out
    assert "FAULT calibration  The calibration is 9.0 days old, 7 are allowed" in told
    assert "The camera or a mark was moved: mark 3 by 2.0" in told


def test_a_changed_file_is_a_mismatch_to_the_daemon(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = cell(tmp_path, EMPTY, CalibrationRecord(calibration()))
    path = tmp_path / "calibration.yaml"
    path.write_text(path.read_text().replace("camera_name: ''", "camera_name: other"))
    assert main(["check", "--config", str(config)]) == 1
    assert "it was changed after it was written" in capsys.readouterr().out


def test_trace_refuses_a_picture_of_a_camera_that_was_moved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    record = CalibrationRecord(calibration(), "", MADE, SEEN)
    cell(tmp_path, marked(bumped(CAMERA, shift_px=(0.0, 2.0))), record)
    options = ["--calibration", str(tmp_path / "calibration.yaml")]
    assert main(["trace", str(tmp_path / "frame.png"), *options]) == 3
    assert "142 sentinel_moved" in capsys.readouterr().out
