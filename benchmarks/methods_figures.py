"""Draws the figures of docs/methods.md: what the paper's methods see, and where each of them fails.

Run it as `python -m benchmarks.methods_figures [FOLDER]`; the folder is docs/pictures by default.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.binarize import binarize
from contour.geometry import Contour, area, densified
from contour.overlay import draw_overlay
from contour.segments import distances_to_ring
from contour.sliding_matrix import default_core_px, fill_windows
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Rendered,
    Scene,
    Sensor,
    Table,
    camera_above,
    convex,
    crescent,
    disc_ring,
    l_shape,
    render,
    u_shape,
    with_holes,
)
from contour.tracing import TraceSettings, trace

Picture = NDArray[np.uint8]

WIDTH, HEIGHT, MM_PER_PX = 500, 430, 0.6
MIDDLE = (WIDTH * MM_PER_PX / 2, HEIGHT * MM_PER_PX / 2 - 11.0)
"""A little low: the caption stands above the block."""

TRUTH = (255, 160, 60)
_GREY_STEPS = 21
"""Grey levels are rounded to steps of these: the figures compress to a third, and look the same."""


@dataclass(frozen=True)
class Panel:
    """One picture of a figure: a rendering, what is drawn on it, and the lines above it."""

    picture: Picture
    contour: Contour | None
    caption: Sequence[str]
    truth: Contour | None = None


def scene(outline: Contour, seed: int, clutter: Clutter | None = None) -> Rendered:
    """An easy picture of a block, 22 px a pitch: little noise, so that the methods fail by their nature alone."""
    return render(
        Scene(
            outline,
            camera_above(WIDTH, HEIGHT, MM_PER_PX),
            CellGeometry(pitch_mm=13.2, wall_mm=1.2, ribbon_deg=20.0),
            table=Table(texture=0.004),
            light=Light(gradient=0.2),
            clutter=clutter or Clutter(),
            sensor=Sensor(shot_noise=0.003, read_noise=0.002),
            seed=seed,
        )
    )


def traced(block: Rendered, settings: TraceSettings, label: str) -> Panel:
    """A panel with the method's contour, its mean distance from the truth and its error of area."""
    found = trace(block.picture, settings).contour
    off = mean_distance(found, block.truth_px)
    share = 100 * (area(found) / area(block.truth_px) - 1)
    return Panel(block.picture, found, [label, f"mean error {off:.1f} px, area {share:+.0f} %"], block.truth_px)


def mean_distance(found: Contour, truth: Contour) -> float:
    """Mean distance between two outlines' exteriors, both ways, px."""
    there = distances_to_ring(densified(found.exterior, 1.0), truth.exterior)
    back = distances_to_ring(densified(truth.exterior, 1.0), found.exterior)
    return float((there.mean() + back.mean()) / 2)


def drawn(panel: Panel) -> Picture:
    picture = (panel.picture // _GREY_STEPS * _GREY_STEPS).astype(np.uint8)
    canvas = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    if panel.truth is not None:
        for ring in panel.truth.rings:
            points = np.round(ring * 16).astype(np.int32).reshape(-1, 1, 2)
            cv2.polylines(canvas, [points], True, TRUTH, 1, cv2.LINE_AA, 4)
    return draw_overlay(np.asarray(canvas, np.uint8), panel.contour, caption=panel.caption, marks=False)


def figure(path: Path, panels: Sequence[Panel], columns: int) -> None:
    """Write the panels side by side, `columns` a row."""
    pictures = [cv2.copyMakeBorder(drawn(panel), 3, 3, 3, 3, cv2.BORDER_CONSTANT, value=(255,) * 3) for panel in panels]
    rows = [np.hstack(pictures[k : k + columns]) for k in range(0, len(pictures), columns)]
    data = cv2.imencode(".png", np.vstack(rows), [cv2.IMWRITE_PNG_COMPRESSION, 9])[1]
    path.write_bytes(data.tobytes())
    print(f"{path}: {len(data) / 1000:.0f} kB")


def find_contours_figure(folder: Path) -> None:
    block = scene(convex(MIDDLE, 100, 4), 5)
    mask = binarize(block.picture).mask
    found = traced(block, TraceSettings(method="find-contours"), "find-contours: the largest outer contour")
    figure(folder / "methods-find-contours.png", [Panel(mask, None, ["The wall mask"]), found], 2)


def direct_scan_figure(folder: Path) -> None:
    settings = TraceSettings(method="direct-scan")
    blocks = {
        "convex: right": scene(convex(MIDDLE, 100, 4), 5),
        "L: rows that cross it twice lose an arm": scene(l_shape(MIDDLE, 205, 155, 68, 200.0), 6),
        "U: one arm is lost": scene(u_shape(MIDDLE, 220, 170, 65, 60, 0.0), 7),
        "crescent: one horn is lost": scene(crescent(MIDDLE, 100, 85, 70, 90.0), 8),
    }
    panels = [traced(block, settings, f"direct-scan, {label}") for label, block in blocks.items()]
    figure(folder / "methods-direct-scan.png", panels, 2)


def core_and_step_figure(folder: Path) -> None:
    block = scene(l_shape(MIDDLE, 205, 155, 68, 20.0), 6)
    tries = [(5, 5), (10, 10), (25, 25), (10, 20), (10, 5), (10, 1)]
    panels = [
        traced(
            block,
            TraceSettings("sliding-matrix", core_px=core, step_px=step),
            f"sliding-matrix, core {core}, step {step}",
        )
        for core, step in tries
    ]
    figure(folder / "methods-core-and-step.png", panels, 3)


def concave_figure(folder: Path) -> None:
    holed = with_holes(u_shape(MIDDLE, 225, 175, 68, 85, 10.0), disc_ring((MIDDLE[0] + 4.0, MIDDLE[1] - 42.0), 24.0))
    block = scene(holed, 9, Clutter(specks=20, debris=4))
    walls = binarize(block.picture)
    if walls.cells is None:
        raise SystemExit("The figure's block shows no cells: the renderer or the mask has changed.")
    core = default_core_px(walls.cells)
    filled = fill_windows(walls.mask, core, core, 40.0)
    panels = [
        Panel(filled, None, [f"The filled picture, core {core}, step {core}"]),
        traced(block, TraceSettings("sliding-matrix"), "sliding-matrix, sizes from the picture"),
    ]
    figure(folder / "methods-concave.png", panels, 2)


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/pictures")
    folder.mkdir(parents=True, exist_ok=True)
    for draw in (find_contours_figure, direct_scan_figure, core_and_step_figure, concave_figure):
        draw(folder)


if __name__ == "__main__":
    main()
