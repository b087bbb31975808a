"""A block in a picture: its cells, walls and coarse rings, and what its walls say of the outline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float64s
from contour.geometry.rings import Contour
from contour.image.pixel_grid import averaged, coarse_step, pixels_of
from contour.image.region import Region, shifted
from contour.relief.relief import Relief
from contour.walls.cell_scale import CellScale, probe
from contour.walls.coarse_block import coarse_block, small_openings
from contour.walls.coarse_rings import CoarseBlock, walls_at_frame
from contour.walls.dark_material import dark_edge, midway_to_table
from contour.walls.faint_links import with_faint_links
from contour.walls.lightness import light_from_table, wall_light
from contour.walls.pieces import pieces_beside, without_loose_pieces
from contour.walls.wall_evidence import BlockEvidence
from contour.walls.wall_mask import FINE_PITCH, WallMask, light_beside_walls, wall_mask, without_specks
from contour.walls.wall_witnesses import block_evidence, border_evidence

# Noise alone reaches a score of 0.18.
_ORDERLY = 0.35
# Larger pictures are halved to look for walls in cells of more than so many pixels, or made as small as leaves cells so
# many pixels, and walls that.
_WHOLE_UP_TO_PX, _HALVED_ABOVE_PX = 6_000_000, 20.0
_PITCH_PX, _LEAST_WALL_PX = 16.0, 1.25
# Walls of such cells are two pixels wide and more: every second pixel tells their colour.
_SUBSAMPLED_PITCH = 20.0
_DARK_POINTS_PER_PITCH = 4
# How much lighter than midway to the table something is in glare, of what walls are darker.
_GLARE = 1.5
# A horn that hangs on nothing reaches no farther from the block.
_STRANDS_PITCHES = 5.0


@dataclass(frozen=True)
class Outline:
    """An outline that was told without walls' ends, pixels, the pitch of its cells, and within what 95 % of it lie."""

    contour: Contour
    pitch_px: float
    bound_px: float


@dataclass(frozen=True, eq=False)
class Source:
    """The picture that another one was drawn from, grey (H, W) or BGR (H, W, 3), uint8, and where its comb ends, some
    four places a pitch, (N, 2), pixels; None where ends of walls are to tell, or an outline that was told.
    """

    picture: Bytes
    border: Float64s | None = None
    outline: Outline | None = None

    @cached_property
    def light(self) -> Bytes:
        """The light that walls stand out by in the picture, (H, W)."""
        return wall_light(self.picture)

    def cut(self, region: Region) -> Source:
        """The same of the part of the picture that lies in a region's box."""
        part, first = region.cut(self.picture)
        outline = self.outline and replace(self.outline, contour=shifted(self.outline.contour, -first))
        return Source(part, None if self.border is None else self.border - first, outline)


@dataclass(frozen=True, eq=False)
class SeenWalls:
    """Walls of a picture, whatever hides them: the light they were seen in, (H, W), and the same `scale` times smaller,
    their cells, and their mask in the smaller one. `relief`: how they stand out of a table that is known; `strong`:
    without fainter ones; `source`: what the light was drawn from.
    """

    light: Bytes
    small: Bytes
    scale: int
    cells: CellScale
    mask: WallMask
    relief: Relief | None = None
    strong: bool = False
    source: Source | None = None


def see_walls(picture: Bytes, light: Bytes, polarity: str, cells: CellScale | None = None) -> SeenWalls:
    """The walls in a picture, grey (H, W) or BGR (H, W, 3), uint8, of which `light` is the `wall_light`.

    `cells`: what `probe` tells of that light, where it was asked. Raises NoBlockFound.
    """
    cells = cells or probe(light, polarity)
    if picture.ndim == 3:
        hop = 2 if cells.pitch_px > _SUBSAMPLED_PITCH else 1
        sample = np.ascontiguousarray(light[::hop, ::hop])
        walls = wall_mask(sample, cells.pitch_px / hop, bright=cells.bright, contrast=cells.contrast).mask
        coloured = light_from_table(picture, sample, walls, hop)
        if coloured is not None:
            light, cells = coloured, probe(coloured, "bright")
    scale = _scale(light, cells)
    small = averaged(light, scale, cv2.BORDER_REPLICATE)
    seen = wall_mask(
        small, cells.pitch_px / scale, bright=cells.bright, contrast=cells.contrast, wall=cells.wall_px / scale
    )
    if cells.pitch_px < FINE_PITCH and seen.may_be_noise and cells.score < _ORDERLY:
        raise NoBlockFound(
            f"no block found: cells of {cells.pitch_px:.0f} px with a contrast of {seen.contrast:.0f} grey levels look "
            "like noise. Check the light, and that a block lies in view"
        )
    return SeenWalls(light, small, scale, cells, seen)


def strong_walls(walls: SeenWalls, least: float) -> SeenWalls:
    """Those of the walls that rise by `least` of what walls of the wider region do, and no fainter ones."""
    cells, scale = walls.cells, walls.scale
    seen = wall_mask(
        walls.small,
        cells.pitch_px / scale,
        bright=cells.bright,
        contrast=cells.contrast,
        wall=cells.wall_px / scale,
        least=least,
    )
    return replace(walls, mask=replace(seen, faint=lambda: seen.mask), strong=True)


def see_block(
    walls: SeenWalls,
    on_mask: Callable[[], None] = lambda: None,
    *,
    hidden: Bytes | None = None,
    joining: Bytes | None = None,
) -> BlockEvidence:
    """Witnesses of the largest block among the walls of a picture, in its pixels.

    `on_mask` is called when the mask of what belongs to blocks is made. `hidden`, (h, w), not 0 where something hides
    the block, on a grid of any size over the picture: no walls are seen there. `joining`, on such a grid, not 0 where
    something joins parts of it as walls do. Raises NoBlockFound.
    """
    small, scale, cells = walls.small, walls.scale, walls.cells
    pitch_px = cells.pitch_px / scale
    seen = without_specks(_visible(walls.mask, hidden), pitch_px, cells.wall_px / scale)
    midway = None if cells.bright else midway_to_table(small, cells.level, seen.contrast)
    if midway is not None:
        # Such a block is told from the table by its darkness: fainter walls would be more of its cells' own shades.
        seen = _darker_than_table(seen, small, midway, cells.level, pitch_px)
    every, few, faint = seen.mask, averaged(seen.mask, coarse_step(pitch_px)), None
    if midway is None:
        faint = seen.faint
        every = with_faint_links(every, faint, pitch_px, few)
        few = few if every is seen.mask else averaged(every, coarse_step(pitch_px))
    on_mask()
    if joining is not None:
        between = _enlarged(joining, every.shape)
        every = np.where(between, np.uint8(255), every)
        few = averaged(every, coarse_step(pitch_px))
    seen = replace(seen, mask=without_loose_pieces(every, pitch_px, faint))
    loose = None if seen.mask is every else np.asarray(cv2.subtract(every, seen.mask), np.uint8)
    coarse = coarse_block(seen.mask, small, pitch_px, few if loose is None else None)
    others = pieces_beside(every, coarse.rings[0].vertices, pitch_px, scale, few)
    if joining is not None:
        seen = replace(seen, mask=np.where(between, np.uint8(0), seen.mask))
    if walls.source is not None and walls.source.border is not None:
        evidence = border_evidence(walls.source.border, seen, coarse, cells, scale)
    else:
        evidence = block_evidence(walls.light, seen, coarse, cells, scale, midway, walls.relief)
    evidence = _with_beside(evidence, small, coarse, scale, midway)
    at_frame = any(walls_at_frame(seen.mask, coarse.walls, coarse.step))
    evidence = replace(evidence, others=others, reaches_frame=at_frame, comb=cells.comb, loose=loose, mask=seen.mask)
    return replace(evidence, openings=small_openings(coarse, small, pitch_px, scale))


def _scale(light: Bytes, cells: CellScale) -> int:
    """How many times smaller the picture is in which walls are looked for: where each ends is measured at full size."""
    if light.size <= _WHOLE_UP_TO_PX or cells.pitch_px <= _HALVED_ABOVE_PX:
        return 1
    return max(1, int(min(max(2.0, cells.pitch_px / _PITCH_PX), cells.wall_px / _LEAST_WALL_PX)))


def _visible(seen: WallMask, hidden: Bytes | None) -> WallMask:
    """The mask without walls in what hides the block."""
    if hidden is None:
        return seen
    there = _enlarged(hidden, seen.mask.shape)

    def visible(mask: Bytes) -> Bytes:
        return np.where(there, np.uint8(0), mask)

    return replace(seen, mask=visible(seen.mask), faint=lambda: visible(seen.faint()))


def _enlarged(part: Bytes, shape: tuple[int, ...]) -> Bools:
    """Where a map on a coarser grid is not 0, at the size of the wall mask, whose `shape` is (H, W)."""
    return np.asarray(cv2.resize(part, shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _darker_than_table(seen: WallMask, light: Bytes, midway: float, walls: float, pitch_px: float) -> WallMask:
    """The mask without what is lighter than `midway` from dark walls to the table, or in glare to what lies beside.

    Cells of a black block are nearly as dark as its walls. Against so small a contrast the table's own shades, beside a
    scratch or in the block's shadow, look like walls; but they are not dark.
    """
    step = coarse_step(pitch_px)
    beside = light_beside_walls(averaged(light, step, cv2.BORDER_REPLICATE), pitch_px / step, closed=True)
    half = midway - walls
    level = np.where(beside > midway + _GLARE * half, beside - half, midway).astype(np.uint8)
    dark = cv2.compare(light, cv2.resize(level, light.shape[::-1], interpolation=cv2.INTER_LINEAR), cv2.CMP_LE)
    return replace(seen, mask=np.asarray(cv2.bitwise_and(seen.mask, dark), np.uint8))


def _with_beside(
    evidence: BlockEvidence, light: Bytes, coarse: CoarseBlock, scale: int, midway: float | None
) -> BlockEvidence:
    """The evidence with strands that hang on nothing and, where `midway` is given, the edge of dark material."""
    pitch_px = evidence.pitch_px / scale
    beside = coarse.strands_near(_STRANDS_PITCHES * pitch_px)
    if midway is not None:
        edge = dark_edge(light, coarse, pitch_px, midway)[:: max(1, round(pitch_px / _DARK_POINTS_PER_PITCH))]
        beside = np.concatenate([beside, edge])
    ring, points = coarse.feet(beside)[0], pixels_of(beside, scale)
    rings = tuple(replace(one, beside=points[ring == number]) for number, one in enumerate(evidence.rings))
    return replace(evidence, rings=rings)
