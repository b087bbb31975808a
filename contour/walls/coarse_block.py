"""The coarse block: where the comb lies to a fraction of a cell, and the rings along which witnesses are ordered."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s, Int64s
from contour.geometry.rings import Ring
from contour.image.pixel_grid import averaged, enlarged, pixels_of, samples_of
from contour.image.pixel_sampling import sample_at
from contour.walls.coarse_threads import without_threads

# About six and a half samples a pitch hold a wall's place and make every later pass cheap.
_SAMPLES_PER_PITCH = 6.5
# A disc of 0.72 pitch bridges an open cell (1.15 pitches across its corners) and a wall broken out of it.
_CLOSING_PITCHES = 0.72
# A gap in a ring of single cells around an opening, up to a cell wide, is a missing wall and no way out.
_LINK_PITCHES = 1.0
_FRAGMENT_PITCHES = 2.0
_SPECK_PITCHES = 0.4
_STRAND_PITCHES = 0.8
# All gaps around an opening together, its line being a sample or two wide.
_GAPS_PITCHES = 2.5
# Samples of another piece within two of the main one that make both of them one block.
_CONTACTS = 6
# An inner opening in which a disc of this radius fits is a hole, not a missing cell.
_HOLE_RADIUS_PITCHES = 1.1
_WALL_COVERAGE = 0.12
_PAD = 8
# Grey levels between table and walls, averaged with their cells, below which an opening's own level says nothing.
_LEAST_SHADE = 8.0


@dataclass(frozen=True)
class CoarseRing:
    """One ring of the coarse block: vertices (M, 2), the same smoothed over two pitches (M, 2), arc length at each
    (M,), outward unit normals (M, 2), total length.

    In pixels of the wall mask. Exterior: positive shoelace; hole: negative.
    """

    vertices: Ring
    base: Float64s
    arc: Float64s
    normal: Float64s
    length: float
    is_hole: bool


@dataclass(frozen=True)
class CoarseBlock:
    """Rings (exterior first) and the maps that place any point: signed distance and nearest ring vertex.

    filled, walls, strands: coarse grid, uint8, 1 in the block, where it has walls, and where there are others that hang
    on nothing. depth: coarse grid, float32, mask pixels, positive inside. nearest: coarse grid, int32, index into all
    vertices of all rings one after the other. step: mask pixels a coarse sample. leaves: whether the block runs out of
    the picture.
    """

    rings: tuple[CoarseRing, ...]
    filled: Bytes
    walls: Bytes
    strands: Bytes
    depth: Float32s
    nearest: Int32s
    step: int
    leaves: bool

    def depth_at(self, points: Float64s) -> Float64s:
        """Distance inside the coarse edge, negative outside, shape (N,), mask pixels, for points (N, 2) in mask
        pixels.
        """
        grid = self._grid(points)
        return sample_at(self.depth, grid[:, 0], grid[:, 1])

    def height_at(self, points: Float64s) -> Float64s:
        """How far points (N, 2) stand out of the ring smoothed over two pitches, along its normal, shape (N,), mask
        pixels.
        """
        index = self._nearest_at(points)
        base = np.concatenate([r.base for r in self.rings])[index]
        normal = np.concatenate([r.normal for r in self.rings])[index]
        return np.asarray(((points - base) * normal).sum(axis=1), np.float64)

    def strands_near(self, reach: float) -> Float64s:
        """Places of strands within `reach` mask pixels outside of the coarse edge, shape (K, 2), mask pixels."""
        rows, columns = np.nonzero(self.strands & (self.depth > -reach))
        return pixels_of(np.stack([columns, rows], axis=1) - _PAD, self.step)

    def feet(self, points: Float64s) -> tuple[Int64s, Float64s, Float64s]:
        """Ring number, arc length and outward normal at the foot of each point on its nearest ring."""
        index = self._nearest_at(points)
        sizes = np.array([len(ring.vertices) for ring in self.rings])
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        ring = np.searchsorted(starts, index, side="right") - 1
        vertices = np.concatenate([r.vertices for r in self.rings])
        normals = np.concatenate([r.normal for r in self.rings])
        arcs = np.concatenate([r.arc for r in self.rings])
        lengths = np.array([r.length for r in self.rings])[ring]
        tangent = np.stack([-normals[index, 1], normals[index, 0]], axis=1)
        along = ((points - vertices[index]) * tangent).sum(axis=1)
        arc = (arcs[index] + np.clip(along, -self.step, self.step)) % lengths
        return ring, arc, normals[index]

    def unpadded(self, grid: Bytes) -> Bytes:
        """A map on the coarse grid without its margin: sample (i, j) covers mask pixels from step · i and step · j
        on.
        """
        return grid[_PAD:-_PAD, _PAD:-_PAD]

    def enlarged(self, grid: Bytes, shape: tuple[int, ...]) -> Bytes:
        """A map on the coarse grid at the size of the wall mask, whose `shape` is (H, W)."""
        return enlarged(self.unpadded(grid), self.step, shape)

    def _nearest_at(self, points: Float64s) -> Int32s:
        grid = np.rint(self._grid(points)).astype(np.int64)
        height, width = self.nearest.shape
        return self.nearest[np.clip(grid[:, 1], 0, height - 1), np.clip(grid[:, 0], 0, width - 1)]

    def _grid(self, points: Float64s) -> Float64s:
        return samples_of(points, self.step) + _PAD


def coarse_block(mask: Bytes, light: Bytes, pitch_px: float) -> CoarseBlock:
    """The largest comb in a wall mask (H, W), uint8, of the picture `light`, with cells `pitch_px` pixels wide.

    Raises NoBlockFound.
    """
    # A whole number of pixels a sample: averaging is several times faster so.
    step = max(1, round(pitch_px / _SAMPLES_PER_PITCH))
    small = averaged(mask, step)
    walls = (small > 255 * _WALL_COVERAGE).astype(np.uint8)
    walls = _padded(walls, cv2.BORDER_CONSTANT)
    samples = pitch_px / step
    kept = _main_piece(walls, samples)
    filled, kept = _linked(walls, kept, _close(kept, _CLOSING_PITCHES * samples), samples)
    filled = without_threads(_largest(filled | kept), samples)
    kept &= filled
    shade = _padded(averaged(light, step, cv2.BORDER_REPLICATE), cv2.BORDER_REPLICATE)
    filled = _fill_missing_cells(filled, kept, shade, _HOLE_RADIUS_PITCHES * samples)
    if len(_sides(filled, samples)) == 4:
        raise NoBlockFound(
            "no block found: a pattern of cells runs out of the picture on all four sides, as a table's does. "
            "Check that a block lies in view with table around it"
        )
    return _with_rings(filled, kept, _strands(walls & (1 - kept), samples), step, samples)


def _main_piece(walls: Bytes, samples: float) -> Bytes:
    """The walls of the largest piece of comb; `samples` is the pitch on the coarse grid. Raises NoBlockFound.

    Chips and neighbouring pieces may lie nearer than the closing reaches, but do not hang together with the block. Only
    where no piece holds most of the walls (a faint block seen in fragments) all fragments of several cells are taken.
    """
    _, labels, stats, _ = cv2.connectedComponentsWithStats(walls, connectivity=8)
    area = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
    area[0] = 0
    size = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    size[0] = 0
    large = size > 3 * samples
    if not large.any():
        raise NoBlockFound(
            "no block found: the walls seen form no piece more than three cells wide. "
            "Check the light and that a block lies in view"
        )
    if area.max() <= 0.5 * area[large].sum():
        return np.asarray(large.astype(np.uint8)[labels], np.uint8)
    main = labels == int(np.argmax(area))
    # Another large piece that all but hangs together with it at several walls is a part behind a faint row.
    beside = labels[cv2.dilate(main.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0]
    touching = np.bincount(beside, minlength=len(area)) >= _CONTACTS
    kept = large & touching
    return np.asarray((main | kept[labels]).astype(np.uint8), np.uint8)


def _close(walls: Bytes, radius: float) -> Bytes:
    """Closing with a disc, by two distance transforms."""
    pad = int(radius) + 2
    wide = cv2.copyMakeBorder(walls, pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0)
    grown = (cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5) <= radius).astype(np.uint8)
    shrunk = (cv2.distanceTransform(grown, cv2.DIST_L2, 5) > radius).astype(np.uint8)
    return np.asarray(shrunk[pad:-pad, pad:-pad] | walls, np.uint8)


def _linked(walls: Bytes, kept: Bytes, filled: Bytes, samples: float) -> tuple[Bytes, Bytes]:
    """The filled block and its walls with a thin line across every gap of less than a cell that leads into an opening.

    Closing joins what lies side by side, but not the ends of a strand of walls between an opening and the table. Grown
    walls part such openings from the table; where their two sides meet again, the line runs. Loose walls of the strand
    are walls of the block then.
    """
    reach = 0.5 * _LINK_PITCHES * samples
    _, labels, stats, _ = cv2.connectedComponentsWithStats(walls, connectivity=8)
    size = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    small = (size > _SPECK_PITCHES * samples) & (size < _FRAGMENT_PITCHES * samples)
    small[0] = False
    strand = kept | small[labels].astype(np.uint8)
    away = cv2.distanceTransform(1 - strand, cv2.DIST_L2, 5)
    count, parts = cv2.connectedComponents((away > reach).astype(np.uint8), connectivity=4)
    # Cells are such parts too; only wide ones can be holes.
    wide = np.zeros(count, np.bool_)
    wide[parts[away > _HOLE_RADIUS_PITCHES * samples]] = True
    wide[0] = False
    if np.count_nonzero(wide) < 2:
        return filled, kept
    seeds = np.where(wide, np.arange(count), 0)[parts]
    _, nearest = cv2.distanceTransformWithLabels(
        (seeds == 0).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP
    )
    low = cv2.erode(nearest.astype(np.float32), np.ones((3, 3), np.uint8)).astype(np.int32)
    line = (low < nearest) & (away <= reach + 1) & (filled == 0)
    # Dust on a table encloses openings too, but its strands are gaps for the most part.
    gaps = line & (cv2.dilate(strand, np.ones((3, 3), np.uint8)) == 0)
    both = np.concatenate([nearest[gaps], low[gaps]])
    length = np.bincount(both, minlength=int(nearest.max()) + 1)
    closed = length <= _GAPS_PITCHES * samples
    closed[nearest[0, 0]] = False
    line &= closed[low] | closed[nearest]
    across = np.unique(labels[line & (cv2.dilate(filled, np.ones((3, 3), np.uint8)) == 0)])
    joined = np.isin(np.arange(len(small)), across) & small
    return filled | line.astype(np.uint8), kept | joined[labels].astype(np.uint8)


def _sides(filled: Bytes, samples: float) -> list[int]:
    """Sides of the picture (top, bottom, left, right as 0…3) that the block meets over more than half a pitch."""
    inner = filled[_PAD:-_PAD, _PAD:-_PAD]
    sides = (inner[:2].max(axis=0), inner[-2:].max(axis=0), inner[:, :2].max(axis=1), inner[:, -2:].max(axis=1))
    return [number for number, side in enumerate(sides) if np.count_nonzero(side) > 0.5 * samples]


def _largest(filled: Bytes) -> Bytes:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(filled, connectivity=8)
    return np.asarray(labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])), np.uint8)


def _padded(grid: Bytes, border: int) -> Bytes:
    return np.asarray(cv2.copyMakeBorder(grid, _PAD, _PAD, _PAD, _PAD, border, value=0), np.uint8)


def _fill_missing_cells(filled: Bytes, walls: Bytes, shade: Bytes, radius: float) -> Bytes:
    """The block with every inner opening filled in which no disc of `radius` fits, or that is as dark as dark walls.

    Looked into at a slant, black cells show nothing but wall: no mask of walls against cells, and no hole either.
    """
    count, labels, _, _ = cv2.connectedComponentsWithStats(1 - filled, connectivity=4)
    room = cv2.distanceTransform(1 - filled, cv2.DIST_L2, 5)
    opening = np.zeros(count, np.bool_)
    opening[labels[room > radius]] = True
    outside = labels[0, 0]
    opening[[0, outside]] = False
    if opening.any():
        table = float(np.median(shade[labels == outside]))
        wall = float(np.median(shade[walls > 0]))
        for number in np.flatnonzero(opening):
            inside = float(np.median(shade[labels == number]))
            # What is lighter than a light block's walls and cells together is a lamp's spot on the table in a hole.
            like_table = abs(inside - table) < abs(inside - wall)
            opening[number] = table < wall or like_table or table - wall < _LEAST_SHADE
    opening[outside] = True
    return np.asarray(1 - opening.astype(np.uint8)[labels], np.uint8)


def _strands(walls: Bytes, samples: float) -> Bytes:
    """Those of the walls that are as long as a cell's wall and more, no specks."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(walls, connectivity=8)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) > _STRAND_PITCHES * samples
    long[0] = False
    return np.asarray(long[labels], np.uint8)


def _with_rings(filled: Bytes, walls: Bytes, strands: Bytes, step: int, samples: float) -> CoarseBlock:
    chains, hierarchy = cv2.findContours(filled, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    order = sorted(range(len(chains)), key=lambda i: (hierarchy[0][i][3] >= 0, -len(chains[i])))
    pixels = [
        _turned(np.asarray(chains[i][:, 0, :], np.int32), hierarchy[0][i][3] >= 0) for i in order if len(chains[i]) >= 8
    ]
    rings = []
    seeds = np.ones(filled.shape, np.uint8)
    for number, chain in enumerate(pixels):
        seeds[chain[:, 1], chain[:, 0]] = 0
        rings.append(_ring(chain, number > 0, step, samples))
    _, labels = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    joined = np.concatenate(pixels)
    index_of_label = np.zeros(int(labels.max()) + 1, np.int32)
    index_of_label[labels[joined[:, 1], joined[:, 0]]] = np.arange(len(joined))
    inside = cv2.distanceTransform(filled, cv2.DIST_L2, 5)
    outside = cv2.distanceTransform(1 - filled, cv2.DIST_L2, 5)
    depth = np.where(filled > 0, inside - 0.5, 0.5 - outside).astype(np.float32) * step
    leaves = bool(_sides(filled, samples))
    nearest = index_of_label[labels]
    return CoarseBlock(tuple(rings), filled, walls, strands, depth.astype(np.float32), nearest, step, leaves)


def _ring(chain: Int32s, is_hole: bool, step: int, samples: float) -> CoarseRing:
    """A chain of coarse samples as a ring in mask pixels with normals smoothed over about two pitches."""
    points = chain.astype(np.float64)
    smooth = cyclic_mean(points, max(1, round(samples / 4)))
    half = max(2, round(samples))
    ahead = cyclic_mean(points, half)
    tangent = np.roll(ahead, -half, axis=0) - np.roll(ahead, half, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    # The chain runs through sample centres, half a sample inside the filled block (outside of it along a hole).
    vertices = pixels_of(smooth - _PAD, step) + (0.5 * step) * normal
    lengths = np.linalg.norm(np.roll(vertices, -1, axis=0) - vertices, axis=1)
    arc = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    base = pixels_of(ahead - _PAD, step)
    return CoarseRing(vertices, base, arc, normal, float(lengths.sum()), is_hole)


def cyclic_mean(points: Float64s, half: int) -> Float64s:
    """Mean of each point with its `half` neighbours on both sides around a ring, shape (N, 2)."""
    count = len(points)
    half = min(half, (count - 1) // 2)
    padded = np.concatenate([points[count - half :], points, points[: half + 1]])
    total = np.cumsum(np.concatenate([np.zeros((1, 2)), padded]), axis=0)
    return np.asarray((total[2 * half + 1 : 2 * half + 1 + count] - total[:count]) / (2 * half + 1), np.float64)


def _turned(chain: Int32s, is_hole: bool) -> Int32s:
    """The chain with positive shoelace, negative for a hole."""
    return chain[::-1] if (_shoelace(chain.astype(np.float64)) < 0) != is_hole else chain


def _shoelace(points: Float64s) -> float:
    following = np.roll(points, -1, axis=0)
    return float(0.5 * (points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1]).sum())
