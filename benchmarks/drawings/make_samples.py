"""Writes the shipped sample frames and their calibration: `python -m benchmarks.drawings.make_samples [FOLDER]`."""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import yaml

from contour.synthetic import render
from tests.support.scenes.sample_scenes import CAMERA, JPEG_QUALITY, calibration_of, sample_scenes

FOLDER = Path(__file__).resolve().parents[2] / "service" / "samples"


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


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:2]))
