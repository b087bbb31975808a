"""Writes every figure and table of docs/reports/methods.md: `python -m benchmarks.methods`."""

from __future__ import annotations

from pathlib import Path

import cv2

from benchmarks.methods.figures import figures
from benchmarks.methods.tables import tables
from benchmarks.page_section import put_section

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "reports" / "methods.md"
PICTURES = DOCS / "pictures"


def main() -> None:
    for name, text in tables().items():
        put_section(name, text, PAGE)
    for name, picture in figures().items():
        data = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
        (PICTURES / name).write_bytes(data)
        print(f"{PICTURES / name}: {len(data) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
