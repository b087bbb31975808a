"""The shipped sample frames are what their scenes render to, and their calibration file is their camera's."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from contour.synthetic import render
from tests.support.scenes.sample_scenes import CAMERA, THICKNESS_MM, calibration_of, sample_scenes
from tests.support.scenes.trials import calibration_for

ROOT = Path(__file__).resolve().parents[3]
SAMPLES = ROOT / "service" / "samples"


@pytest.mark.parametrize("scene", sample_scenes()[:2], ids=lambda scene: scene.name)
def test_a_sample_is_its_scene_as_a_jpeg(scene):
    shipped = cv2.imread(str(SAMPLES / f"{scene.name}.jpg"), cv2.IMREAD_GRAYSCALE)
    difference = np.abs(shipped.astype(int) - render(scene).picture.astype(int))
    assert difference.mean() < 2.5
    assert np.percentile(difference, 99.9) < 15


def test_there_is_one_file_for_every_sample_and_none_is_large():
    files = sorted(SAMPLES.glob("*.jpg"))
    assert [file.stem for file in files] == [scene.name for scene in sample_scenes()]
    assert max(file.stat().st_size for file in files) < 700_000


def test_the_samples_share_one_camera_and_thickness():
    assert all(scene.camera == CAMERA and scene.thickness_mm == THICKNESS_MM for scene in sample_scenes())


def test_the_calibration_file_is_the_samples_camera():
    shipped = yaml.safe_load((SAMPLES / "calibration.yaml").read_text(encoding="utf-8"))
    assert shipped == calibration_of(CAMERA)


def test_the_calibration_takes_the_truth_in_pixels_back_to_the_truth_in_millimetres():
    for scene in sample_scenes():
        seen = CAMERA.project(scene.outline.exterior, THICKNESS_MM)
        assert np.allclose(calibration_for(CAMERA).to_work(seen, THICKNESS_MM), scene.outline.exterior, atol=1e-3)


def test_the_samples_can_be_written_again_elsewhere(tmp_path):
    command = [sys.executable, "-m", "benchmarks.drawings.make_samples", tmp_path]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(
        file.name for file in SAMPLES.iterdir() if file.suffix in (".jpg", ".yaml")
    )
    assert "1-rectangle.jpg" in done.stdout
