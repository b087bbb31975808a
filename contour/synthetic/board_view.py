"""Renders a flat printed board through a known camera, by exact area coverage: truth for calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from contour.camera_calibration.board import Board
from contour.geometry.arrays import Bytes, Float32s, Float64s
from contour.synthetic.camera import CameraModel
from contour.synthetic.coverage import area_coverage
from contour.synthetic.scene import Sensor
from contour.synthetic.sensor import expose

TABLE, PAPER, INK = 0.35, 0.82, 0.06
"""Light they return, shares of full scale."""

_STEP_PX = 16.0
"""A chord this long leaves the bent edge by 0.002 px under k1 = -0.12."""


def board_camera(camera: CameraModel, rotation: Float64s, translation_mm: Float64s) -> CameraModel:
    """The same camera seen from a board's frame: the board is turned and moved before `camera`'s work frame.

    `rotation` (3, 3) and `translation_mm` (3,) take points of the board frame to the work frame.
    """
    turn = np.array(camera.rotation)
    rows = tuple((float(r[0]), float(r[1]), float(r[2])) for r in turn @ rotation)
    x, y, z = (turn @ translation_mm + np.array(camera.translation_mm)).tolist()
    return replace(camera, rotation=rows, translation_mm=(x, y, z))


def render_flat(
    camera: CameraModel, sheets: Sequence[tuple[Float64s, Float64s]], *, sensor: Sensor | None = None, seed: int = 1
) -> Bytes:
    """The picture of sheets in the plane z = 0 of the camera's frame: (H, W), uint8.

    A sheet is its white box and its black boxes: left, bottom, right, top, shapes (4,) and (N, 4), millimetres.
    """
    return render_planes([(camera, sheets)], sensor=sensor, seed=seed)


def render_planes(
    planes: Sequence[tuple[CameraModel, Sequence[tuple[Float64s, Float64s]]]],
    *,
    sensor: Sensor | None = None,
    seed: int = 1,
) -> Bytes:
    """The same of sheets in several planes, each with the one camera in that plane's frame; none may hide another."""
    camera, _ = planes[0]
    light = np.full((camera.height, camera.width), TABLE, dtype=np.float32)
    for seen_by, sheets in planes:
        for paper, ink in sheets:
            white = _coverage(seen_by, paper[None])
            black = _coverage(seen_by, ink)
            light += white * np.float32(PAPER - TABLE) - black * np.float32(PAPER - INK)
    return expose(sensor or Sensor(), [light], seed)


def render_board(board: Board, camera: CameraModel, *, sensor: Sensor | None = None, seed: int = 1) -> Bytes:
    """The picture of a board on its sheet; `camera` is given in the board's frame."""
    return render_flat(camera, [board_sheet(board)], sensor=sensor, seed=seed)


def board_sheet(board: Board, offset_mm: tuple[float, float] = (0.0, 0.0)) -> tuple[Float64s, Float64s]:
    """A board's sheet, with a margin of half a square, as `render_flat` takes it."""
    width, height = board.size_mm
    margin = 0.5 * board.square_mm
    shift = np.array([*offset_mm, *offset_mm])
    return np.array([-margin, -margin, width + margin, height + margin]) + shift, board.black_boxes() + shift


def _coverage(camera: CameraModel, boxes: Float64s) -> Float32s:
    """Share of each pixel that the boxes cover; what lies beside the picture is left out."""
    middle = np.array([[camera.width / 2, camera.height / 2]])
    x, y = camera.back_project(middle, 0.0)[0].tolist()
    step = _STEP_PX * camera.mm_per_px((x, y), 0.0)
    left, bottom, right, top = boxes.T
    corners = np.stack([left, bottom, right, bottom, right, top, left, top], axis=1).reshape(-1, 4, 2)
    count = max(1, int(np.ceil(float((boxes[:, 2:] - boxes[:, :2]).max()) / step)))
    share = (np.arange(count) / count)[None, None, :, None]
    ends = np.roll(corners, -1, axis=1)
    dense = (corners[:, :, None] * (1 - share) + ends[:, :, None] * share).reshape(-1, 2)
    rings = camera.project(dense, 0.0).reshape(len(boxes), -1, 2)
    limit = np.array([camera.width + 1, camera.height + 1])
    seen = (rings.max(axis=1) > -1).all(axis=1) & (rings.min(axis=1) < limit).all(axis=1)
    if not seen.any():
        return np.zeros((camera.height, camera.width), dtype=np.float32)
    return area_coverage(list(rings[seen]), camera.width, camera.height)
