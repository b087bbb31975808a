"""Other pieces of comb in the picture than the one that was traced. Debris is none: a piece has cells of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, Int32s, Int64s
from contour.geometry.rings import Ring
from contour.image.opencv import closed_by_disc, pieces_and_boxes, pieces_and_lesser
from contour.image.pixel_grid import coarse_step, pixels_of, samples_of, whole_averaged
from contour.walls.coarse_block import CLOSING_PITCHES

_WALL_COVERAGE = 0.12
# What lies within this of the traced outline is the block itself: its side seen at a slant, its broken walls.
_MARGIN_PITCHES = 0.6
_LEAST_SIZE_PITCHES = 3.0
# Enclosed areas that are cells, in areas of one: broken walls join several, letters and chips enclose less.
_CELL_AREAS = (0.25, 6.0)
_FEWEST_CELLS = 7
# A strip of swarf beside the block has closed cells of its own, and broken walls have none; but of a block that seems
# to be in two, parts as large as this may be its own. No such strip has less wall, pitches times pixels.
_LOOSE_CELLS, _LOOSE_SHARE, _MOST_WALLS, _LEAST_WALL = 2, 0.15, 0.5, 3.0
_LEAST_CELL = 0.2
# But cells that lie where the block's rows of cells go on are its own, parted from it by ink: pitches around a piece,
# between neighbours, and rows across; of middles that lie in a cell of such a row so many, and most so near to its own.
# Of 30 strips of swarf and 40 offcuts one has as many, by chance; a corner that a felt-pen parted has all.
_ORDER_PITCHES, _NEXT, _ROWS, _IN_CELL, _MET = 4.0, (0.6, 1.45), 3, 0.45, 0.2
_FEWEST_MET, _MOSTLY_MET = 8, 0.85
STRIP_PITCHES = 4.5
"""Narrower than so many cells a piece is a strip that was cut off, however long: no block is."""
# A shaving is as long as several walls: of the block's own walls fewer may stand alone, between two that do not show.
_SHAVING_PITCHES = 1.5
_HEXAGON = 2 / np.sqrt(3)


@dataclass(frozen=True)
class Piece:
    """A piece of comb: its area, cells filled, px², its box (left, top, right, bottom), and its outline to look at.

    The outline, shape (N, 2), is as coarse as the samples that the piece was found in; empty = not known. width_px: of
    its widest place, or how much of the picture's border it lies along, if that is more; infinite where not known.
    """

    area_px2: float
    box_px: tuple[int, int, int, int]
    outline_px: Ring = field(default_factory=lambda: np.empty((0, 2)), compare=False)
    width_px: float = field(default=np.inf, compare=False)

    @property
    def middle_px(self) -> tuple[float, float]:
        """(x, y) of the box's middle."""
        left, top, right, bottom = self.box_px
        return 0.5 * (left + right), 0.5 * (top + bottom)

    def holds(self, other: Piece) -> bool:
        """Whether the middle of another piece's box lies in the box of this one."""
        left, top, right, bottom = self.box_px
        x, y = other.middle_px
        return left <= x <= right and top <= y <= bottom

    def moved(self, x: int, y: int) -> Piece:
        """The piece in a picture whose first pixel lies (x, y) before this one's."""
        left, top, right, bottom = self.box_px
        box = left + x, top + y, right + x, bottom + y
        return replace(self, box_px=box, outline_px=self.outline_px + np.array([x, y]))

    def reduced(self, times: int) -> Piece:
        """The piece in the picture that this one's shows so many times as large."""
        left, top, right, bottom = (side // times for side in self.box_px)
        outline = samples_of(self.outline_px, times)
        return Piece(self.area_px2 / times**2, (left, top, right, bottom), outline, self.width_px / times)


def pieces_beside(
    mask: Bytes, exterior: Ring, pitch_px: float, scale: int = 1, small: Bytes | None = None
) -> tuple[Piece, ...]:
    """Pieces of comb outside `exterior`, largest first, in a wall mask (H, W), uint8, 255 on walls.

    `exterior` and `pitch_px` are in the mask's pixels, the result in those of a picture `scale` times as large. A piece
    hangs together, is wider than three pitches, and encloses seven cells or more. `small`: the mask's `averaged` by
    samples of `coarse_step`, where it is known.
    """
    step = coarse_step(pitch_px)
    samples = pitch_px / step
    if small is None or min(mask.shape) < step:
        small = whole_averaged(mask, step)
    high, wide = max(1, mask.shape[0] // step), max(1, mask.shape[1] // step)
    walls = (small[:high, :wide] > 255 * _WALL_COVERAGE).astype(np.uint8)
    outline = np.rint(samples_of(exterior, step)).astype(np.int32)
    cv2.fillPoly(walls, [outline], 0)
    cv2.polylines(walls, [outline], True, 0, max(1, round(2 * _MARGIN_PITCHES * samples)))
    labels, stats = pieces_and_boxes(walls, 8)
    large = np.minimum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) >= _LEAST_SIZE_PITCHES * samples
    large[0] = False
    found = []
    for number in np.flatnonzero(large):
        x, y, w, h = (int(value) for value in stats[number, :4])
        filled = _filled(labels[y : y + h, x : x + w] == number, samples)
        if filled is not None:
            whole = step * scale
            box = (x * whole, y * whole, (x + w) * whole, (y + h) * whole)
            ring = pixels_of(_outline(filled) + np.array([x, y]), whole)
            width = _width(filled, (x, y, x + w, y + h), walls.shape) * whole
            found.append(Piece(float(np.count_nonzero(filled)) * whole**2, box, ring, width))
    return tuple(sorted(found, key=lambda piece: -piece.area_px2))


def with_earlier(pieces: tuple[Piece, ...], earlier: tuple[Piece, ...], exterior: Ring) -> tuple[Piece, ...]:
    """Pieces beside `exterior`, and those of an earlier look that lie outside of it, each as the look saw it that saw
    more of it, largest first.

    What hides a block's edge may be another block: at a later look its walls count no more, yet it lies there.
    """
    around = np.asarray(exterior, np.float32)
    outside = [one for one in earlier if cv2.pointPolygonTest(around, one.middle_px, measureDist=False) < 0]
    kept = [one for one in pieces if not any(one.area_px2 <= other.area_px2 and other.holds(one) for other in outside)]
    kept += [one for one in outside if not any(one.area_px2 < other.area_px2 and other.holds(one) for other in pieces)]
    return tuple(sorted(kept, key=lambda piece: -piece.area_px2))


def without_loose_pieces(mask: Bytes, pitch_px: float, faint: Callable[[], Bytes] | None = None) -> Bytes:
    """A wall mask (H, W), uint8, 255 on walls, without small pieces of comb whose walls nowhere touch the block's,
    however near they lie, and whose cells do not go on in its rows: strips of swarf, chips. Where no piece holds most
    of the walls, nothing is taken out.

    `faint` makes the mask by a lower threshold: shavings without cells, too, are loose where no faint wall leads from
    the block to them, as one does to every wall of its own.
    """
    labels, area, places = pieces_and_lesser(mask, 8)
    count, piece, main = len(area), labels.ravel().take(places), int(area.argmax())
    if area.max() <= _MOST_WALLS * area.sum():
        return mask
    small = (area > _LEAST_WALL * pitch_px) & (area < _LOOSE_SHARE * area.max())
    few = np.flatnonzero(small[piece])
    boxes = _boxes(np.divmod(places[few], mask.shape[1]), piece[few], count)
    loose = np.zeros(count, np.bool_)
    for number in np.flatnonzero(small & ((boxes[2:] - boxes[:2]).min(axis=0) > pitch_px)).tolist():
        top, left, bottom, right = boxes[:, number].tolist()
        cells = _cells(labels[top:bottom, left:right], number, pitch_px)
        loose[number] = len(cells) >= _LOOSE_CELLS
        if len(cells) >= _FEWEST_CELLS:
            beyond = round(_ORDER_PITCHES * pitch_px)
            x, y = max(0, left - beyond), max(0, top - beyond)
            block = _cells(labels[y : bottom + beyond, x : right + beyond], main, pitch_px)
            if _go_on(block + np.array([x, y]), cells + np.array([left, top]), pitch_px):
                small[number] = loose[number] = False
    long = small & ~loose & (np.hypot(*(boxes[2:] - boxes[:2])) > _SHAVING_PITCHES * pitch_px)
    if faint is not None and long.any():
        loose |= long & ~_hang_together(labels, main, mask | faint())
    return (~loose).astype(np.uint8).take(labels) * mask if loose.any() else mask


def _cells(labels: Int32s, number: int, pitch_px: float) -> Float64s:
    """Middles of the cells that one of numbered pieces of wall encloses, (H, W), x and y, shape (N, 2)."""
    rings, around = cv2.findContours((labels == number).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    holes = [ring for ring, outer in zip(rings, around[0, :, 3], strict=True) if outer >= 0] if rings else []
    moments = [cv2.moments(hole) for hole in holes]
    found = [
        (one["m10"] / one["m00"], one["m01"] / one["m00"]) for one in moments if one["m00"] > _LEAST_CELL * pitch_px**2
    ]
    return np.array(found, np.float64).reshape(-1, 2)


def _go_on(block: Float64s, cells: Float64s, pitch_px: float) -> bool:
    """Whether cells of a piece, (M, 2), lie where those of a block, (N, 2), go on in their rows across a gap."""
    own, other = (places[:, 0] + 1j * places[:, 1] for places in (block, cells))
    step = own[:, None] - own
    one, before = np.nonzero((np.abs(step) > _NEXT[0] * pitch_px) & (np.abs(step) < _NEXT[1] * pitch_px))
    row = own[one] + np.arange(1, _ROWS + 1)[:, None] * step[one, before]
    off = np.abs(other[:, None] - row.ravel())
    within, met = (np.count_nonzero(off < reach * pitch_px) for reach in (_IN_CELL, _MET))
    return bool(within >= _FEWEST_MET and met > _MOSTLY_MET * within)


def _hang_together(labels: Int32s, main: int, walls: Bytes) -> Bools:
    """Which of numbered pieces, (H, W), hang together with the main one by `walls`, (H, W), shape (count,)."""
    _, joined = cv2.connectedComponents(walls, connectivity=8)
    with_main = joined == joined[labels == main][0]
    return np.bincount(labels[with_main], minlength=int(labels.max()) + 1) > 0


def _boxes(places: tuple[Int64s, Int64s], piece: Int32s, count: int) -> Int64s:
    """First row and column of each of `count` pieces, and the first ones behind it, shape (4, count), by the rows and
    columns of their pixels (N,) and the piece of each (N,).
    """
    boxes = np.zeros((4, count), np.int64)
    boxes[:2] = np.iinfo(np.int32).max
    for axis in (0, 1):
        np.minimum.at(boxes[axis], piece, places[axis])
        np.maximum.at(boxes[2 + axis], piece, places[axis] + 1)
    return boxes


def _width(filled: Bools, box: tuple[int, int, int, int], shape: tuple[int, ...]) -> float:
    """Diameter of the largest disc inside, samples, or how much of the picture's border it lies along: its box (left,
    top, right, bottom) reaches the last samples but one, of so many rows and columns, where it may go on.
    """
    framed = cv2.copyMakeBorder(filled.astype(np.uint8), 1, 1, 1, 1, cv2.BORDER_CONSTANT)
    disc = 2.0 * float(cv2.distanceTransform(framed, cv2.DIST_L2, 5).max())
    left, top, right, bottom = box
    sides = (
        (left <= 1, filled[:, :2], 1),
        (top <= 1, filled[:2], 0),
        (right >= shape[1] - 1, filled[:, -2:], 1),
        (bottom >= shape[0] - 1, filled[-2:], 0),
    )
    return max(disc, float(sum(np.count_nonzero(side.any(axis=axis)) for at_border, side, axis in sides if at_border)))


def _outline(filled: Bools) -> Ring:
    """The outermost samples of the largest part, shape (N, 2)."""
    rings, _ = cv2.findContours(filled.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return np.asarray(max(rings, key=cv2.contourArea), dtype=np.float64).reshape(-1, 2)


def _filled(walls: Bools, samples: float) -> Bools | None:
    """A piece with walls `walls` (h, w), its cells filled; None where it has too few cells of its own."""
    cell = samples**2 / _HEXAGON
    pad = round(CLOSING_PITCHES * samples) + 2
    free = cv2.copyMakeBorder((~walls).astype(np.uint8), pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=1)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(free, connectivity=4)
    area = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
    # Walls of about a sample and a half are free pixels lost all around a cell.
    whole = (np.sqrt(area) + 1.5) ** 2
    cells = (whole > _CELL_AREAS[0] * cell) & (whole < _CELL_AREAS[1] * cell)
    cells[[0, labels[0, 0]]] = False
    if np.count_nonzero(cells) < _FEWEST_CELLS:
        return None
    return closed_by_disc(walls.astype(np.uint8), CLOSING_PITCHES * samples) > 0
