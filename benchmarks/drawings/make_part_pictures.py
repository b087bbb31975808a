"""Writes the pictures of docs/how-to/parts.md: `… -m benchmarks.drawings.make_part_pictures`."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.rings import Contour, densified
from contour.image.overlay import draw_overlay
from service.config.recipes import PartToCut
from service.measuring.calibration_file import load_record
from service.measuring.part_trial import PartTrial
from service.parts.fit import fit_part, in_picture
from service.parts.sure_block import SureBlock
from service.records.remnants import Remnants

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "service" / "samples"
PICTURES = ROOT / "docs" / "pictures"
PART = SAMPLES / "part.dxf"
CALIBRATION = SAMPLES / "calibration.yaml"
CASES = (
    ("2-l-shape", (), "part-fits"),
    ("4-with-holes", ("--margin-mm", "10"), "part-between-holes"),
    ("3-u-shape", ("--margin-mm", "25"), "part-does-not-fit"),
    ("4-with-holes", ("--margin-mm", "3", "--ribbon-from-picture"), "part-along-ribbon"),
    ("1-rectangle", ("--margin-mm", "10", "--rotation", "fixed"), "part-as-drawn"),
)
RECIPE = """
calibration: {{file: {calibration}}}
camera: {{kind: files, path: {samples}}}
controller: {{kind: none}}
recipes:
  - number: 1
    name: brackets
    thickness_mm: 20
    parts_apart_mm: 4
    parts:
      - {{file: {part}, quantity: 2, priority: 1, margin_mm: 3}}
      - {{file: {plate}, units: mm, quantity: 20, priority: 2, margin_mm: 3}}
"""
PLATE = '{"type": "Polygon", "coordinates": [[[0, 0], [60, 0], [60, 40], [0, 40], [0, 0]]]}'
MARGIN_MM = 3.0
WIDTH = 800


def main() -> None:
    """Write each picture as the command draws it."""
    for sample, options, name in CASES:
        drawn(name, sample, "--part", PART, "--calibration", CALIBRATION, *options)
    with tempfile.TemporaryDirectory() as folder:
        several(Path(folder))
        second_part(Path(folder) / "remnants.sqlite")


def several(folder: Path) -> None:
    """The picture of several parts, by a recipe."""
    plate, config = folder / "plate.json", folder / "config.yaml"
    plate.write_text(PLATE, encoding="utf-8")
    config.write_text(RECIPE.format(calibration=CALIBRATION, samples=SAMPLES, part=PART, plate=plate), encoding="utf-8")
    drawn("parts-several", "4-with-holes", "--config", config, "--recipe", "brackets")


def second_part(remnants: Path) -> None:
    """The pictures of what one part leaves of a block, and of a second part in that."""
    sample = "2-l-shape"
    options = ("--part", PART, "--calibration", CALIBRATION, "--margin-mm", MARGIN_MM)
    drawn("part-first", sample, *options, "--remnants", remnants)
    (left,) = Remnants(remnants).all()
    asked = PartToCut(file=PART, margin_mm=MARGIN_MM)
    block = SureBlock.of(left.contour, left.bound_mm)
    assert block is not None
    calibration = load_record(CALIBRATION).calibration
    fit = in_picture(fit_part(PartTrial().part_of(asked), block, asked), calibration, left.thickness_mm)
    assert fit.drawn is not None
    rings = [calibration.to_pixels(densified(ring, 5.0), left.thickness_mm) for ring in left.contour.rings]
    picture = cv2.imread(str(SAMPLES / f"{sample}.jpg"))
    assert picture is not None
    outline = Contour(rings[0], tuple(rings[1:]))
    caption = [f"remnant {left.number}", fit.sentence]
    overlay = draw_overlay(picture.astype(np.uint8), outline, caption=caption, marks=False, parts=[fit.drawn])
    put("part-from-remnant", overlay)


def drawn(name: str, sample: str, *options: object) -> None:
    """The overlay of `combtrace fit`, as a small picture."""
    overlay = PICTURES / f"{name}.png"
    command = [sys.executable, "-m", "service.cli.main", "fit", SAMPLES / f"{sample}.jpg", *options]
    subprocess.run([str(word) for word in (*command, "--overlay", overlay)], check=False)  # one of them does not fit
    picture = cv2.imread(str(overlay))
    if picture is None:
        raise RuntimeError(f"{overlay}: was not drawn")
    overlay.unlink()
    put(name, picture.astype(np.uint8))


def put(name: str, picture: NDArray[np.uint8]) -> None:
    """Write the picture as a small JPEG."""
    size = (WIDTH, round(picture.shape[0] * WIDTH / picture.shape[1]))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(PICTURES / f"{name}.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


if __name__ == "__main__":
    main()
