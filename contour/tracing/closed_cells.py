"""The outer boundary of the material itself, for blocks whose border cells are closed: all that differs from the
table.

Printed and moulded honeycomb, boards and foam slabs end in whole cells: their true edge is serrated, and no line
through wall ends describes it.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float64s
from contour.geometry.rings import Contour, Ring
from contour.image.pixel_sampling import sample_at
from contour.tracing.table_surface import OUTLIER, table_surface

_GRID_PX = 4
# Chips and dust are small against a block; a block smaller than this share of the picture is a chip to this method.
_LEAST_SHARE = 0.004
# How far behind the boundary, and before it, its own half level is looked for.
_REACH_PX = 3.0
_OUT_PX = 2.0
# Gaps of a faint wall, in pitches, that do not open a cell.
_GAP_PITCHES = 0.3
_WALL_PITCHES = 0.62
_CELL_AREA = 1.5
_SIMPLE_PX = 0.25


def material_edge(picture: Bytes, pitch_px: float, walls: Bytes) -> Contour:
    """Boundary of the largest region that differs from the table, with holes wider than 2.2 pitches, in pixels.

    `walls` (H, W), 255 where the picture shows cell walls, adds those that differ less than most. Exterior with
    negative shoelace, holes positive. The table is a smooth surface in every channel, learnt from the picture's border
    inwards. Raises NoBlockFound.
    """
    difference, noise = _difference(picture)
    level = _level(difference, noise)
    faint = (walls > 0) & (difference > OUTLIER * noise)
    region = _region((difference > level) | faint, pitch_px)
    chains, hierarchy = cv2.findContours(region, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    rings = [
        (_sub_pixel(difference, chain[:, 0, :].astype(np.float64)), bool(node[3] >= 0))
        for chain, node in zip(chains, hierarchy[0], strict=True)
        if len(chain) >= 8
    ]
    exterior = max((ring for ring, hole in rings if not hole), key=lambda ring: abs(_shoelace(ring)))
    holes = tuple(_turned(ring, 1.0) for ring, hole in rings if hole)
    return Contour(_turned(exterior, -1.0), holes)


def _difference(picture: Bytes) -> tuple[Bytes, float]:
    """How far each pixel is from the table: largest difference over the channels, shape (H, W), uint8; the table's
    spread.
    """
    height, width = picture.shape[:2]
    channels = picture[:, :, None] if picture.ndim == 2 else picture
    grid = (max(8, width // _GRID_PX), max(8, height // _GRID_PX))
    small = cv2.resize(picture, grid, interpolation=cv2.INTER_AREA).reshape(grid[1], grid[0], -1).astype(np.float64)
    gray = channels[:, :, channels.shape[2] // 2]
    rough = cv2.absdiff(gray, cv2.blur(gray, (5, 5)))
    texture = np.asarray(cv2.resize(rough, grid, interpolation=cv2.INTER_AREA), np.uint8)
    surface, spread = table_surface(small, texture)
    table = np.clip(np.rint(surface), 0, 255).astype(np.uint8)
    full = cv2.resize(table, (width, height), interpolation=cv2.INTER_LINEAR).reshape(channels.shape)
    apart = cv2.absdiff(channels, full).reshape(height, width, -1)
    largest = apart.max(axis=2) if apart.shape[2] > 1 else apart[:, :, 0]
    return np.asarray(cv2.GaussianBlur(largest, (3, 3), 0), np.uint8), spread


def _level(difference: Bytes, spread: float) -> float:
    """The level that parts material from table best (Otsu). Raises NoBlockFound where nothing stands out."""
    split, _ = cv2.threshold(difference[::2, ::2].copy(), 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    if split < OUTLIER * spread:
        raise NoBlockFound(
            f"no block found: nothing stands out from the table by more than {split:.0f} grey levels, of which its own "
            f"texture makes {spread:.0f}. Check the light and that a block lies in view"
        )
    return float(split)


def _region(apart: Bools, pitch_px: float) -> Bytes:
    """The largest piece with its cells filled; inner openings in which a disc of 1.1 pitches' radius fits stay open."""
    material = _closed(apart.astype(np.uint8), _GAP_PITCHES * pitch_px)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(material, connectivity=8)
    area = (stats[:, cv2.CC_STAT_WIDTH] * stats[:, cv2.CC_STAT_HEIGHT]).astype(np.float64)
    area[0] = 0
    if area.max() < _LEAST_SHARE * apart.size:
        raise NoBlockFound(
            "no block found: all that differs from the table is smaller than a block. Check that a block lies in view"
        )
    piece = (labels == int(np.argmax(area))).astype(np.uint8)
    # Of the piece alone: specks of a table lie as close as walls, and enclose as much.
    piece |= _leaking_cells(piece, pitch_px)
    padded = cv2.copyMakeBorder(piece, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    _, inner, _, _ = cv2.connectedComponentsWithStats(1 - padded, connectivity=4)
    room = cv2.distanceTransform(1 - padded, cv2.DIST_L2, 5)
    open_ = np.zeros(int(inner.max()) + 1, np.bool_)
    open_[inner[room > 1.1 * pitch_px]] = True
    open_[inner[0, 0]] = True
    open_[0] = False
    return np.asarray(1 - open_.astype(np.uint8)[inner][1:-1, 1:-1], np.uint8)


def _closed(material: Bytes, gap: float) -> Bytes:
    size = 2 * int(gap / 2) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    wide = cv2.copyMakeBorder(material, size, size, size, size, cv2.BORDER_CONSTANT, value=0)
    return np.asarray(cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc)[size:-size, size:-size], np.uint8)


def _leaking_cells(material: Bytes, pitch_px: float) -> Bytes:
    """Cells that only a broken or faint wall opens to the table, up to the line across the gap.

    Where walls are grown by half a gap, such cells lie apart from the table; what is nearer to a cell's rest than to
    the table's is the cell.
    """
    away = cv2.distanceTransform(1 - material, cv2.DIST_L2, 5)
    seeds = (away > 0.5 * _WALL_PITCHES * pitch_px).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(seeds, connectivity=4)
    cell = stats[:, cv2.CC_STAT_AREA] < _CELL_AREA * pitch_px * pitch_px
    cell[0] = False
    if not cell.any():
        return np.zeros_like(material)
    _, nearest = cv2.distanceTransformWithLabels(1 - seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP)
    of_cell = np.zeros(int(nearest.max()) + 1, np.uint8)
    of_cell[nearest[cell[labels]]] = 1
    return np.asarray(of_cell[nearest] & (material == 0), np.uint8)


def _sub_pixel(difference: Bytes, chain: Float64s) -> Ring:
    """The chain moved to half of the material's own difference behind it, simplified to a quarter of a pixel."""
    smooth = _cyclic_mean(chain, 2)
    tangent = np.roll(smooth, -1, axis=0) - np.roll(smooth, 1, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    # findContours has the free side at (−dy, dx) of its direction.
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    along = np.arange(-_REACH_PX, _OUT_PX + 0.1, 0.25)
    places = smooth[:, None, :] + along[None, :, None] * normal[:, None, :]
    values = sample_at(difference, places[:, :, 0], places[:, :, 1])
    level = 0.5 * (values.max(axis=1, keepdims=True) + values[:, -2:].mean(axis=1, keepdims=True))
    falls = (values[:, :-1] >= level) & (values[:, 1:] < level)
    # The outermost one: behind it may lie cells.
    index = falls.shape[1] - 1 - np.argmax(falls[:, ::-1], axis=1)
    rows = np.arange(len(smooth))
    high, low = values[rows, index], values[rows, index + 1]
    part = (high - level[:, 0]) / np.maximum(high - low, 1e-6)
    shift = np.where(falls.any(axis=1), along[index] + 0.25 * part, 0.5)
    moved = smooth + shift[:, None] * normal
    simple = cv2.approxPolyDP(moved.astype(np.float32)[:, None, :], _SIMPLE_PX, True)[:, 0, :]
    return np.asarray(simple, np.float64)


def _cyclic_mean(points: Float64s, half: int) -> Float64s:
    total = sum(np.roll(points, shift, axis=0) for shift in range(-half, half + 1))
    return np.asarray(total / (2 * half + 1), np.float64)


def _shoelace(ring: Ring) -> float:
    following = np.roll(ring, -1, axis=0)
    return float(0.5 * (ring[:, 0] * following[:, 1] - following[:, 0] * ring[:, 1]).sum())


def _turned(ring: Ring, sign: float) -> Ring:
    return ring if _shoelace(ring) * sign > 0 else ring[::-1].copy()
