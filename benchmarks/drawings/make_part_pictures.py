"""Writes the pictures of docs/how-to/parts.md: `… -m benchmarks.drawings.make_part_pictures`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "service" / "samples"
PICTURES = ROOT / "docs" / "pictures"
PART = SAMPLES / "part.dxf"
CASES = (
    ("2-l-shape", (), "part-fits"),
    ("4-with-holes", ("--margin-mm", "10"), "part-between-holes"),
    ("3-u-shape", ("--margin-mm", "25"), "part-does-not-fit"),
    ("1-rectangle", ("--margin-mm", "10", "--rotation", "fixed"), "part-as-drawn"),
)
WIDTH = 800


def main() -> None:
    """Write each picture as the command draws it."""
    for sample, options, name in CASES:
        overlay = PICTURES / f"{name}.png"
        words = [SAMPLES / f"{sample}.jpg", "--part", PART, "--calibration", SAMPLES / "calibration.yaml", *options]
        command = [sys.executable, "-m", "service.cli.main", "fit", *words, "--overlay", overlay]
        subprocess.run([str(word) for word in command], check=False)  # one of them does not fit
        drawn = cv2.imread(str(overlay))
        if drawn is None:
            raise RuntimeError(f"{overlay}: was not drawn")
        overlay.unlink()
        small = cv2.resize(drawn, (WIDTH, round(drawn.shape[0] * WIDTH / drawn.shape[1])), interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(overlay.with_suffix(".jpg")), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


if __name__ == "__main__":
    main()
