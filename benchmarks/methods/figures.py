"""The figures of docs/reports/methods.md: what the paper's methods see, and where each of them fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.methods.blocks import CORE_AND_STEP, HEIGHT, WIDTH, block, cells, traced, walls
from contour.geometry.rings import Contour
from contour.image.opencv import enclosed_area
from contour.image.overlay import draw_overlay
from contour.tracing.direct_scan import default_gap_px, default_width_px, scan_pairs
from contour.tracing.sliding_matrix import default_core_px, default_threshold, fill_windows
from contour.tracing.trace import TraceSettings

Picture = NDArray[np.uint8]
Colour = tuple[int, int, int]

LEFT, RIGHT, NOISE, TRUTH = (40, 150, 255), (255, 190, 40), (220, 60, 230), (255, 160, 60)
"""Blue, green, red: orange, light blue, magenta, blue."""

_BLACK, _WHITE = (0, 0, 0), (255, 255, 255)
_CELLS = ((80, 220, 60), (40, 200, 250), (240, 120, 200), (250, 180, 60), (90, 90, 250))
_GREY_STEPS = 21
"""Grey levels are rounded to steps of these: the figures compress to a third, and look the same."""
_LINE_PX = 20
_BORDER_PX = 3
CAPTION_PX = 2 * _LINE_PX + 8


@dataclass(frozen=True)
class Panel:
    """One picture of a figure, and the lines above it, each in its colour."""

    picture: Picture
    caption: Sequence[tuple[str, Colour]]


def figures() -> dict[str, Picture]:
    """Each figure's picture by its file name, BGR."""
    return {
        "methods-find-contours.png": _joined(_find_contours(), 3),
        "methods-direct-scan-points.png": _joined(_points(), 2),
        "methods-direct-scan.png": _joined(_direct_scan(), 2),
        "methods-core-and-step.png": _joined(_core_and_step(), 3),
        "methods-concave.png": _joined(_concave(), 2),
    }


def panels(figure: Picture) -> list[Picture]:
    """The panels' pictures as they lie in a figure, without what is written above them."""
    below, wide = CAPTION_PX + _BORDER_PX, WIDTH + 2 * _BORDER_PX
    tall = below + HEIGHT + _BORDER_PX
    return [
        figure[top + below : top + below + HEIGHT, left + _BORDER_PX : left + _BORDER_PX + WIDTH]
        for top in range(0, figure.shape[0], tall)
        for left in range(0, figure.shape[1], wide)
    ]


def _joined(panels: Sequence[Panel], columns: int) -> Picture:
    """The panels side by side, `columns` a row, each below its caption."""
    tiles = []
    for panel in panels:
        edges = (CAPTION_PX + _BORDER_PX, _BORDER_PX, _BORDER_PX, _BORDER_PX)
        tile = cv2.copyMakeBorder(panel.picture, *edges, cv2.BORDER_CONSTANT, value=_WHITE)
        for number, (line, colour) in enumerate(panel.caption, 1):
            place = (_BORDER_PX + 4, number * _LINE_PX)
            cv2.putText(tile, line, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, 1, cv2.LINE_AA)
        tiles.append(tile)
    rows = [np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)]
    return np.asarray(np.vstack(rows), np.uint8)


def _plain(picture: Picture) -> Picture:
    grey = (picture // _GREY_STEPS * _GREY_STEPS).astype(np.uint8)
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR), np.uint8)


def _rings(canvas: Picture, rings: Sequence[NDArray[np.float64]], colour: Colour) -> None:
    for ring in rings:
        cv2.polylines(canvas, [np.round(ring * 16).astype(np.int32).reshape(-1, 1, 2)], True, colour, 1, cv2.LINE_AA, 4)


def _black(*lines: str) -> list[tuple[str, Colour]]:
    return [(line, _BLACK) for line in lines]


def _traced(name: str, settings: TraceSettings, label: str, specks: int = 0, chips: int = 0) -> Panel:
    """A panel with the method's contour, its mean distance from the true outline and its error of area."""
    found, mean_px, share = traced(settings, name, specks, chips)
    return Panel(_drawn(name, found, specks, chips), _black(label, f"mean error {mean_px:.1f} px, area {share:+.1f} %"))


def _drawn(name: str, found: Contour, specks: int, chips: int) -> Picture:
    scene = block(name, specks, chips)
    canvas = _plain(scene.picture)
    _rings(canvas, scene.truth_px.rings, TRUTH)
    return draw_overlay(canvas, found, marks=False)


def _find_contours() -> list[Panel]:
    mask = walls("convex").mask
    rings = [ring for ring in cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0] if enclosed_area(ring)]
    every = _plain((mask // 5).astype(np.uint8))
    for number, ring in enumerate(rings):
        cv2.polylines(every, [ring], True, _CELLS[number % len(_CELLS)], 1)
    return [
        Panel(_plain(mask), _black("The wall mask")),
        Panel(every, _black("findContours: every contour", f"{len(rings)} of them, each in its colour")),
        _traced("convex", TraceSettings(method="find-contours"), "find-contours: the largest outer one"),
    ]


def _points() -> list[Panel]:
    """The scan's points and what it drops."""
    return [_points_of("convex", 80, 12), _points_of("u", 0, 0)]


def _points_of(name: str, specks: int, chips: int) -> Panel:
    seen = cells(name, specks, chips)
    kept, noise = scan_pairs(walls(name, specks, chips).mask, default_gap_px(seen), default_width_px(seen))
    canvas = _plain(block(name, specks, chips).picture)
    for y, left, right in noise.tolist():
        cv2.line(canvas, (left, y), (right, y), NOISE, 2)
    for y, left, right in kept.tolist():
        cv2.circle(canvas, (left, y), 2, LEFT, -1)
        cv2.circle(canvas, (right, y), 2, RIGHT, -1)
    dropped = f"{len(noise)} pair{'s' * (len(noise) != 1)} dropped as noise"
    return Panel(canvas, [(f"{len(kept)} rows: left points orange, right ones blue", _BLACK), (dropped, NOISE)])


def _direct_scan() -> list[Panel]:
    labels = {
        "convex": "convex: right but for open cells",
        "l, turned": "L: rows that cross it twice lose an arm",
        "u": "U: one arm is lost",
        "crescent": "crescent: one horn is lost",
    }
    settings = TraceSettings(method="direct-scan")
    return [_traced(name, settings, f"direct-scan, {label}") for name, label in labels.items()]


def _core_and_step() -> list[Panel]:
    return [
        _traced(
            "l",
            TraceSettings("sliding-matrix", core_px=core, step_px=step),
            f"sliding-matrix, core {core}, step {step}",
        )
        for core, step in CORE_AND_STEP
    ]


def _concave() -> list[Panel]:
    there = ("holed", 20, 4)
    seen = cells(*there)
    core = default_core_px(seen.pitch_px)
    filled = fill_windows(walls(*there).mask, core, core, default_threshold(seen))
    return [
        Panel(_plain(filled), _black(f"The filled picture, core {core}, step {core}")),
        _traced("holed", TraceSettings("sliding-matrix"), "sliding-matrix, sizes from the picture", 20, 4),
    ]
