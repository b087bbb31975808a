"""The plot of stated against true error, both on logarithmic scales, drawn with OpenCV."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.pictures import FOLDER

Picture = NDArray[np.uint8]

PLOT = FOLDER / "uncertainty.png"
SIZE, MARGIN = 760, 80
LOW, HIGH = 0.1, 20.0
TICKS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
INK, GRID, HELD, BROKEN = (60, 60, 60), (225, 225, 225), (150, 110, 30), (50, 50, 220)


def write_plot(true_px: Sequence[float], stated_px: Sequence[float]) -> None:
    """Write `PLOT`: a dot a scene; those beyond the axes stand at their ends."""
    canvas: Picture = np.full((SIZE, SIZE, 3), 255, np.uint8)
    for tick in TICKS:
        _line(canvas, (tick, LOW), (tick, HIGH), GRID)
        _line(canvas, (LOW, tick), (HIGH, tick), GRID)
        _text(canvas, f"{tick:g}", (_at(tick, LOW)[0] - 10, SIZE - MARGIN + 24))
        _text(canvas, f"{tick:g}", (MARGIN - 44, _at(LOW, tick)[1] + 5))
    for factor, name in ((1.0, "bound = error"), (2.0, "twice the error")):
        _line(canvas, (LOW, LOW * factor), (HIGH / factor, HIGH), INK)
        x, y = _at(12.0 / factor, 12.0)
        _text(canvas, name, (x + 10, y) if factor == 1.0 else (x - 135, y))
    for true, stated in zip(true_px, stated_px, strict=True):
        colour = HELD if stated >= true else BROKEN
        cv2.circle(canvas, _at(true, stated), 4, colour, -1, cv2.LINE_AA)
    _text(canvas, "true error: 95 % of the outline within, px", (SIZE // 2 - 170, SIZE - 22))
    _text(canvas, "stated bound, px", (MARGIN - 44, 40))
    FOLDER.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(PLOT), canvas)


def _at(x: float, y: float) -> tuple[int, int]:
    share = np.log(np.clip([x, y], LOW, HIGH) / LOW) / np.log(HIGH / LOW)
    across, up = (MARGIN + share * (SIZE - 2 * MARGIN)).round().astype(int).tolist()
    return across, SIZE - up


def _line(canvas: Picture, start: tuple[float, float], end: tuple[float, float], colour: tuple[int, int, int]) -> None:
    cv2.line(canvas, _at(*start), _at(*end), colour, 1, cv2.LINE_AA)


def _text(canvas: Picture, text: str, place: tuple[int, int]) -> None:
    cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, INK, 1, cv2.LINE_AA)
