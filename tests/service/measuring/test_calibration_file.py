"""Calibration files: both forms come back as they were; what cannot be trusted in full is refused with its reason."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from contour.calibration.calibration import Alignment, Calibration, CameraCalibration, SimpleCalibration
from contour.calibration.fixed_marks import Mark, Sentinels
from contour.calibration.plane_calibration import PlaneCalibration
from contour.calibration.position_uncertainty import PositionUncertainty
from service.measuring.calibration_file import (
    CalibrationFileError,
    CalibrationRecord,
    load_record,
    save_record,
)

CAMERA: dict[str, Any] = {
    "version": 1,
    "kind": "camera",
    "image_width": 1600,
    "image_height": 1200,
    "camera_name": "cam0",
    "distortion_model": "plumb_bob",
    "camera_matrix": {"rows": 3, "cols": 3, "data": [2800, 0, 799.5, 0, 2800, 599.5, 0, 0, 1]},
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [-0.12, 0.03, 0, 0, 0]},
    "work_plane": {"rotation_vector": [3.141592653589793, 0, 0], "translation_mm": [-300, 225, 1050]},
    "alignment": {"rotation_deg": 90, "translation_mm": [1000, 2000]},
}
SIMPLE: dict[str, Any] = {
    "version": 1,
    "kind": "simple",
    "image_width": 1600,
    "image_height": 1200,
    "mm_per_pixel": 0.375,
    "plane_height_mm": 0,
    "origin_px": [100.0, 1100.0],
    "rotation_deg": 0,
}
PLANE: dict[str, Any] = {"height_mm": 0, "figure_mm": 0.1, "map": {"rows": 2, "cols": 2, "data": [1, 2, 3, 4]}}
BIG: dict[str, Any] = {"rows": 3, "cols": 2, "data": [1, 2, 3, 4, 5, 6]}
MARK: dict[str, Any] = {"id": 1, "corners_px": [[0, 0], [5, 0], [5, 5], [0, 5]]}
MIRRORED: dict[str, Any] = {"rows": 3, "cols": 3, "data": [1, 0, 0, 0, 1, 0, 0, 0, 1]}


def written(folder: Path, data: object) -> Path:
    path = folder / "calibration.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def save(path: Path, calibration: Calibration) -> None:
    name = calibration.camera_name if isinstance(calibration, CameraCalibration) else ""
    save_record(path, CalibrationRecord(calibration, name))


@pytest.mark.parametrize("stated", [{"plane_mm": 0.12}, {"planes": [PLANE]}], ids=["one figure", "maps"])
def test_the_covered_part_comes_back_and_a_file_without_one_covers_all(tmp_path: Path, stated: dict[str, Any]) -> None:
    corners = np.array([[0.0, 0.0], [1599.0, 0.0]])
    ring = [[100.0, 100.0], [1700.0, -100.0], [900.0, 900.0]]
    for covered, outside in (({}, 0), ({"covered_px": ring}, 1)):
        read = load_record(written(tmp_path, {**CAMERA, "uncertainty": {**stated, **covered}})).calibration
        save(tmp_path / "again.yaml", read)
        for calibration in (read, load_record(tmp_path / "again.yaml").calibration):
            assert calibration.uncertainty is not None
            assert len(calibration.uncertainty.uncovered(corners)) == outside
    with pytest.raises(CalibrationFileError, match="covered_px"):
        load_record(written(tmp_path, {**CAMERA, "uncertainty": {**stated, "covered_px": ring[:2]}}))


@pytest.mark.parametrize("form", [CAMERA, SIMPLE], ids=["camera", "simple"])
def test_what_a_calibration_states_of_itself_is_read_and_written(tmp_path: Path, form: dict[str, Any]) -> None:
    assert load_record(written(tmp_path, form)).calibration.uncertainty is None
    stated = load_record(written(tmp_path, {**form, "uncertainty": {"plane_mm": 0.12}})).calibration
    assert stated.uncertainty is not None
    assert stated.uncertainty.figure_mm(33.0) == 0.12
    save(tmp_path / "again.yaml", stated)
    again = load_record(tmp_path / "again.yaml").calibration
    assert again.uncertainty is not None
    np.testing.assert_allclose(again.uncertainty.at(np.array([[5.0, 7.0], [900.0, 800.0]]), 20.0), 0.12)


def test_the_simple_form_is_read_as_the_contract_says(tmp_path: Path) -> None:
    """The origin's pixel is work (0, 0); 100 px to its right are 37.5 mm in x, 100 px above it 37.5 mm in y."""
    calibration = load_record(written(tmp_path, SIMPLE)).calibration
    points = np.array([[100.0, 1100.0], [200.0, 1100.0], [100.0, 1000.0]])
    expected = [[0, 0], [37.5, 0], [0, 37.5]]
    np.testing.assert_allclose(calibration.to_machine(calibration.to_work(points, 0)), expected, atol=1e-9)
    assert not calibration.aligned


def test_the_rotation_of_the_simple_form_is_counter_clockwise_as_seen(tmp_path: Path) -> None:
    """A work x axis turned by 90 degrees counter-clockwise points up in the picture: to smaller image y."""
    calibration = load_record(written(tmp_path, {**SIMPLE, "rotation_deg": 90})).calibration
    np.testing.assert_allclose(calibration.to_work(np.array([[100.0, 1000.0]]), 0), [[37.5, 0]], atol=1e-9)


def test_the_camera_form_is_read_with_its_alignment(tmp_path: Path) -> None:
    """A camera that looks straight down on (300, 225): its principal point sees that place at every height."""
    data = {**CAMERA, "distortion_coefficients": {"rows": 1, "cols": 5, "data": [0, 0, 0, 0, 0]}}
    calibration = load_record(written(tmp_path, data)).calibration
    centre = np.array([[799.5, 599.5]])
    np.testing.assert_allclose(calibration.to_work(centre, 0), [[300, 225]], atol=1e-6)
    np.testing.assert_allclose(calibration.to_machine(calibration.to_work(centre, 60)), [[1000 - 225, 2300]], atol=1e-6)
    right = calibration.to_work(np.array([[799.5 + 280, 599.5]]), 50)
    np.testing.assert_allclose(right, [[300 + 0.1 * 1000, 225]], atol=1e-6)


@pytest.mark.parametrize("data", [CAMERA, SIMPLE])
def test_what_is_saved_comes_back_as_it_was(tmp_path: Path, data: dict[str, Any]) -> None:
    first = load_record(written(tmp_path, data)).calibration
    path = tmp_path / "again.yaml"
    save(path, first)
    again = load_record(path).calibration
    for name, value in vars(first).items():
        np.testing.assert_equal(vars(again)[name], value)
    assert yaml.safe_load(path.read_text())["hash"] == load_record(path).digest


def test_uncertainty_sentinels_and_origin_come_back_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "calibration.yaml"
    sure = PositionUncertainty(1600, 1200, [0.0, 60.0], [0.02, 0.03], np.arange(24.0).reshape(2, 3, 4))
    marks = Sentinels("DICT_4X4_50", (Mark(7, np.array([[1.0, 2.0], [9.5, 2.0], [9.0, 10.0], [1.0, 10.0]])),))
    created = datetime(2026, 5, 4, 3, 2, 1, tzinfo=UTC)
    calibration = replace(load_record(written(tmp_path, CAMERA)).calibration, uncertainty=sure)
    save_record(path, CalibrationRecord(calibration, "cam0", created, marks, {"views": 14, "board": "charuco"}))
    again = load_record(path)
    assert (again.camera_name, again.created) == ("cam0", created)
    assert again.made == {"views": 14, "board": "charuco"}
    assert again.calibration.uncertainty is not None
    for name, value in vars(sure).items():
        np.testing.assert_equal(vars(again.calibration.uncertainty)[name], value)
    assert again.sentinels is not None
    assert again.sentinels.dictionary == "DICT_4X4_50"
    np.testing.assert_equal(again.sentinels.marks[0].corners_px, marks.marks[0].corners_px)


def test_a_homography_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "calibration.yaml"
    first = PlaneCalibration(1600, 1200, np.array([[0.4, 0.01, -9], [0.02, -0.41, 480], [1e-5, 2e-5, 1]]), 5.0)
    save(path, first)
    again = load_record(path).calibration
    assert isinstance(again, PlaneCalibration)
    np.testing.assert_allclose(again.homography, first.homography, rtol=1e-14)
    assert again.plane_height_mm == 5.0


def test_a_changed_file_no_longer_matches_its_hash(tmp_path: Path) -> None:
    path = tmp_path / "calibration.yaml"
    save(path, SimpleCalibration(1600, 1200, 0.375, (0.0, 0.0)))
    path.write_text(path.read_text().replace("0.375", "0.376"))
    with pytest.raises(CalibrationFileError, match="it was changed after it was written"):
        load_record(path)


def test_the_hash_does_not_depend_on_layout_and_order(tmp_path: Path) -> None:
    one = written(tmp_path, SIMPLE)
    other = tmp_path / "other.yaml"
    other.write_text("# a comment\n" + yaml.safe_dump(dict(reversed(SIMPLE.items())), default_flow_style=True))
    assert load_record(one).digest == load_record(other).digest


def test_a_file_without_a_hash_is_read(tmp_path: Path) -> None:
    assert "hash" not in SIMPLE
    assert isinstance(load_record(written(tmp_path, SIMPLE)).calibration, SimpleCalibration)


def test_saving_that_fails_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "gone" / "calibration.yaml"
    with pytest.raises(CalibrationFileError, match="cannot be written"):
        save(path, SimpleCalibration(1600, 1200, 0.375, (0.0, 0.0), alignment=Alignment()))
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_leaves_the_old_file_and_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, SIMPLE)
    before = path.read_bytes()

    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(CalibrationFileError, match=r"No space left on device\. The old file is unchanged"):
        save(path, SimpleCalibration(1600, 1200, 0.5, (0.0, 0.0)))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_saving_through_a_link_changes_the_file_behind_it(tmp_path: Path) -> None:
    path = written(tmp_path, SIMPLE)
    link = tmp_path / "link.yaml"
    link.symlink_to(path)
    save(link, SimpleCalibration(1600, 1200, 0.5, (0.0, 0.0)))
    assert link.is_symlink()
    assert load_record(path).digest == yaml.safe_load(path.read_text())["hash"]


def changed(data: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {key: value for key, value in {**data, **changes}.items() if value is not None}


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (None, "holds no keys"),
        ([1], "holds no keys"),
        (changed(SIMPLE, kind="fisheye"), "kind is 'fisheye', expected one of 'camera', 'simple', 'plane'"),
        (changed(SIMPLE, kind=None), "kind is None"),
        (changed(SIMPLE, kind=["camera"]), "kind is ['camera'], expected"),
        (changed(SIMPLE, mm_per_pixel=True), "mm_per_pixel: is true, as yes and on are read"),
        (changed(SIMPLE, image_width=True), "image_width: is true, as yes and on are read"),
        (changed(SIMPLE, mm_per_pixle=1, mm_per_pixel=None), "unknown key; did you mean mm_per_pixel?"),
        (changed(SIMPLE, version=2), "version: seen 2"),
        (changed(SIMPLE, version=None), "version: is missing"),
        (changed(SIMPLE, mm_per_pixel=0), "mm_per_pixel: seen 0, expected a number above 0"),
        (changed(SIMPLE, mm_per_pixel=float("nan")), "mm_per_pixel: seen nan"),
        (changed(SIMPLE, mm_per_pixel=None), "mm_per_pixel: is missing"),
        (changed(SIMPLE, mm_per_pixle=1), "mm_per_pixle: unknown key"),
        (changed(SIMPLE, image_width=0), "image_width: seen 0"),
        (changed(SIMPLE, origin_px=[1]), "origin_px[1]: is missing"),
        (
            changed(CAMERA, camera_matrix={"rows": 3, "cols": 3, "data": [1, 2]}),
            "data has 2 numbers, expected rows x cols",
        ),
        (changed(CAMERA, camera_matrix={"rows": 2, "cols": 2, "data": [1, 2, 3, 4]}), "camera_matrix"),
        (
            changed(CAMERA, camera_matrix={"rows": 3, "cols": 3, "data": [0, 0, 1, 0, 9, 1, 0, 0, 1]}),
            "expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0",
        ),
        (changed(CAMERA, distortion_model="equidistant"), "distortion_model: seen 'equidistant'"),
        (changed(CAMERA, distortion_coefficients={"rows": 1, "cols": 3, "data": [0, 0, 0]}), "distortion_coefficients"),
        (changed(CAMERA, work_plane=None), "work_plane: is missing"),
        (changed(SIMPLE, uncertainty={"planes": []}), "expected either plane_mm or planes"),
        (changed(SIMPLE, uncertainty={"planes": [PLANE, {**PLANE, "map": BIG}]}), "the maps have different sizes"),
        (changed(SIMPLE, uncertainty={"planes": [PLANE, PLANE]}), "expected rising numbers"),
        (changed(SIMPLE, uncertainty={"planes": [{**PLANE, "figure_mm": -1}]}), "figure_mm: seen -1"),
        (changed(SIMPLE, created="2026-01-01 00:00:00"), "created"),
        (changed(SIMPLE, sentinels={"dictionary": "DICT_4X4_50", "marks": [MARK, MARK]}), "each id once"),
        (
            {"version": 1, "kind": "plane", "image_width": 9, "image_height": 9, "homography": MIRRORED},
            "mirrors the picture",
        ),
        (
            changed(CAMERA, work_plane={"rotation_vector": [0, 0, 0], "translation_mm": [0, 0, 1000]}),
            "under the table",
        ),
    ],
)
def test_a_file_that_cannot_be_trusted_is_refused_with_its_reason(tmp_path: Path, data: Any, expected: str) -> None:
    path = written(tmp_path, data)
    with pytest.raises(CalibrationFileError) as error:
        load_record(path)
    assert str(path) in str(error.value)
    assert expected in str(error.value)


def test_a_missing_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(CalibrationFileError, match=r"nowhere\.yaml: cannot be read"):
        load_record(tmp_path / "nowhere.yaml")


def test_a_loaded_camera_is_a_camera(tmp_path: Path) -> None:
    assert isinstance(load_record(written(tmp_path, CAMERA)).calibration, CameraCalibration)
