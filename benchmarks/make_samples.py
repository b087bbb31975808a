"""Writes the shipped sample frames and their calibration file: `python -m benchmarks.make_samples [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import yaml

from contour.synthetic import CameraModel, render
from tests.support.scenes.sample_scenes import CAMERA, JPEG_QUALITY, sample_scenes

FOLDER = Path(__file__).resolve().parent.parent / "service" / "samples"


def main(folder: Path = FOLDER) -> None:
    """Write every sample as FOLDER/NAME.jpg and the camera as FOLDER/calibration.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    for scene in sample_scenes():
        done, data = cv2.imencode(".jpg", render(scene).picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        if not done:
            raise RuntimeError(f"{scene.name}: the JPEG encoder gave nothing; check the OpenCV build")
        (folder / f"{scene.name}.jpg").write_bytes(data.tobytes())
        print(f"{folder / scene.name}.jpg: {len(data) / 1000:.0f} kB")
    header = "# The camera that the sample frames were rendered with (tests/support/scenes/sample_scenes.py).\n"
    (folder / "calibration.yaml").write_text(
        header + yaml.safe_dump(calibration_of(CAMERA), sort_keys=False, default_flow_style=None), encoding="utf-8"
    )


def calibration_of(camera: CameraModel, name: str = "samples") -> dict[str, object]:
    """The camera as a calibration file's content (camera model form)."""
    return {
        "version": 1,
        "kind": "camera",
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": name,
        "distortion_model": "plumb_bob",
        "camera_matrix": {"rows": 3, "cols": 3, "data": camera.matrix.ravel().tolist()},
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(camera.distortion)},
        "work_plane": {
            "rotation_vector": list(camera.rotation_vector),
            "translation_mm": list(camera.translation_mm),
        },
        "alignment": {"rotation_deg": 0.0, "translation_mm": [0.0, 0.0]},
    }


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
