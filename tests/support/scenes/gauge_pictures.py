"""Gauges on the tables of rendered cells: what their files say, and pictures of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from contour.camera_calibration.board import Board
from contour.geometry.arrays import Bytes
from contour.synthetic import CameraModel, CellGeometry, Light, Scene, rectangle, render
from contour.synthetic.board_view import board_camera, board_sheet, render_planes
from tests.support.scenes.gauge_scenes import FLAT, MARK_SHARE, Bend, Cell, lying, mark_sheets, raised

PLATE_SQUARES = (11, 8)
EXPANSION_UM = 11.5
"""Of steel."""


def plate_board(cell: Cell) -> Board:
    """A plate's board for a cell: 40 % of the field's width, in markers that the cell's own board has not."""
    square = round(0.4 * float(np.ptp(cell.field_mm[:, 0])) / PLATE_SQUARES[0], 1)
    return Board("charuco", *PLATE_SQUARES, square, 0.7 * square, "DICT_6X6_250")


def plate_file(
    board: Board, height_mm: float, rng: np.random.Generator, uncertainty_mm: float = 0.02
) -> dict[str, Any]:
    """What a gauge file says of that plate, where each figure is off as far as its own uncertainty (k = 2) allows."""
    ends = {
        "bottom": ((1, 1), (10, 1)),
        "left": ((1, 1), (1, 7)),
        "rising": ((1, 1), (10, 7)),
        "falling": ((1, 7), (10, 1)),
        "half": ((3, 4), (8, 4)),
    }
    lengths = []
    for name, ((a, b), (c, d)) in ends.items():
        true = board.square_mm * float(np.hypot(c - a, d - b))
        told = round(true + float(rng.normal(0, uncertainty_mm / 2)), 4)
        entry = {"name": name, "length_mm": told, "uncertainty_mm": uncertainty_mm, "between": [[a, b], [c, d]]}
        lengths.append(entry)
    squares = {"squares": [board.squares_x, board.squares_y], "square_mm": board.square_mm}
    markers = {"marker_mm": board.marker_mm, "dictionary": board.dictionary}
    return {
        **_gauge_head("plate", height_mm, rng),
        "board": {"kind": "charuco", **squares, **markers},
        "lengths": lengths,
    }


def block_file(
    size_mm: tuple[float, float], height_mm: float, rng: np.random.Generator, uncertainty_mm: float = 0.03
) -> dict[str, Any]:
    """What a gauge file says of a milled block of that size."""
    lengths = [
        {"name": name, "length_mm": round(float(true + rng.normal(0, uncertainty_mm / 2)), 4)}
        for name, true in zip(("long", "short"), size_mm, strict=True)
    ]
    told = [{**entry, "uncertainty_mm": uncertainty_mm} for entry in lengths]
    return {**_gauge_head("block", height_mm, rng), "lengths": told}


def _gauge_head(kind: str, height_mm: float, rng: np.random.Generator) -> dict[str, Any]:
    return {
        "version": 1,
        "kind": kind,
        "id": f"G-{kind}",
        "calibrated_by": "rendered",
        "calibrated_on": "2026-11-02",
        "height_mm": round(height_mm + float(rng.normal(0, 0.025)), 4),
        "height_uncertainty_mm": 0.05,
        "form_mm": 0.02,
        "expansion_um_per_m_k": EXPANSION_UM,
    }


def plate_picture(
    cell: Cell,
    board: Board,
    place: tuple[float, float, float],
    height_mm: float,
    *,
    bend: Bend = FLAT,
    camera: CameraModel | None = None,
    warmer_k: float = 0.0,
    seed: int = 1,
) -> Bytes:
    """The plate in a place, its pattern at `height_mm` over the table; marks that it hides are left out.

    camera: where the camera is by now; None = where it was calibrated.
    """
    grown = 1 + warmer_k * EXPANSION_UM * 1e-6
    warm = replace(board, square_mm=board.square_mm * grown, marker_mm=board.marker_mm * grown)
    pose = raised(lying(warm.size_mm, place, cell, bend), height_mm)
    eye = camera or cell.camera
    reach = float(np.hypot(*warm.size_mm)) / 2 + board.square_mm
    side = MARK_SHARE * float(np.ptp(cell.field_mm[:, 0]))
    free = [
        sheet
        for sheet in mark_sheets(cell.camera)
        if np.linalg.norm(sheet[0].reshape(2, 2).mean(axis=0) - place[:2]) > reach + 2 * side
    ]
    planes = [(board_camera(eye, *pose), [board_sheet(warm)]), (eye, free)]
    return render_planes(planes, seed=seed)


def block_picture(
    cell: Cell,
    size_mm: tuple[float, float],
    place: tuple[float, float, float],
    height_mm: float,
    *,
    bend: Bend = FLAT,
    camera: CameraModel | None = None,
    seed: int = 1,
) -> Bytes:
    """A honeycomb block of that size in a place."""
    pose = lying(size_mm, place, cell, bend)
    eye = board_camera(camera or cell.camera, *pose)
    pitch = 20.0 * cell.camera.mm_per_px((place[0], place[1]), height_mm)
    cells = CellGeometry(pitch_mm=pitch, wall_mm=0.075 * pitch, warp=0.05, ribbon_deg=float(seed % 180), broken=0.003)
    outline = rectangle((size_mm[0] / 2, size_mm[1] / 2), *size_mm, 0.0)
    light = Light(gradient=0.1, vignetting=0.1)
    return render(Scene(outline, eye, cells, thickness_mm=height_mm, seed=seed, light=light)).picture
