"""Witnesses of a block's outline: where its material ends, wall by wall, to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Bytes, Float64s, median
from contour.geometry.signed_distance import nearest
from contour.image.pixel_grid import pixels_of, samples_of
from contour.image.pixel_sampling import FULL_SCALE, light_beside, sample_at
from contour.relief.relief import Relief
from contour.relief.relief_ends import relief_ends
from contour.walls.cell_scale import CellScale
from contour.walls.coarse_rings import CoarseBlock
from contour.walls.dark_material import dark_beyond
from contour.walls.end_profile import EndModel, centred_axes, fit_ends, true_width
from contour.walls.wall_ends import Chains, edge_chains, find_ends, outermost
from contour.walls.wall_evidence import BlockEvidence, EdgePoints, RingEvidence, WitnessKind
from contour.walls.wall_mask import WallMask
from contour.walls.wall_parallax import Parallax, parallax

# Sharpest and softest blur that a lens in use leaves; outside of it the fit has seen something else.
_BLUR_PX = (0.4, 3.0)
_USUAL_BLUR_PX = 0.9
# A second witness within this of another says nothing new.
_LONELY_PITCHES = 0.3
_MOST_SIGMA_PX = 1.0
# Of the usual height: fainter ends are not ends of walls.
_LEAST_HEIGHT = 0.4
# What blunter things than noise do to clean ends and to blunt ones, and to sides fitted and not.
_MODEL_SIGMA_PX = (0.2, 0.3)
_SIDE_SIGMA_PX = (0.5, 1.0)
_NEAR_PX = 1.5
# On a known table: how unsure an end may be, how much of what differs around it its top and side explain, and by how
# much these differ from the table, of what is usual. Of 5950 ends four differ by less, which are grain and streaks on
# the table; of 20 that differ by up to 0.3, 19 are ends of walls.
_MOST_RELIEF_SIGMA_PX, _LEAST_TOLD, _LEAST_RELIEF_HEIGHT, _LEAST_SIDE_HEIGHT = 1.5, 0.4, 0.2, 0.25
_FAINT_HEIGHT = 0.45
_FAINT_SIGMA_PX = 3.0
# Beside a light table the border of a shadow is an outermost wall, too: of what light falls by at ends of walls it
# falls there by less than this, and beyond, so far, pixels, it is lighter by more than this than within, so far,
# pitches.
_LEAST_FALL, _LIGHTER_BEYOND = 0.2, 0.5
_BEYOND_PX, _WITHIN_PITCHES = np.array([3.0, 4.0, 5.0]), np.linspace(0.1, 0.6, 6)
# How far the edge of dark material is looked for from the last wall seen in it, and how near is the wall's own edge.
_DARK_PITCHES = 4.0
_INSIDE_PITCHES, _ENDS_INSIDE_PITCHES = 0.4, 0.25
_DARK_SIGMA_PX, _DARK_SIGMA_PITCHES = 1.0, 0.07
# What the mask's own light blur (3 × 3) adds.
_MASK_BLUR_PX = 0.8
_WALL_POINTS_PER_PITCH = 8
# Walls farther inside than this are no part of the boundary towards the table, the dents of open cells included.
_WALLS_INSIDE = 1.1
# Where comb ends, if that is known: so far from its coarse edge at most, and so unsure.
_BORDER_PITCHES, _BORDER_SIGMA_PITCHES = 1.2, 0.05
# How near to an end light tells whether its wall is at full scale.
_BESIDE_PX = np.array([-3.0, -1.5, 0.0, 1.5, 3.0])


@dataclass(frozen=True, eq=False)
class _Ends:
    """Ends in picture pixels before they are fitted: tip, axis and outward normal (N, 2), straight wall behind (N,)."""

    tip: Float64s
    axis: Float64s
    normal: Float64s
    straight: Float64s


@dataclass(frozen=True, eq=False)
class _Witnesses:
    points: Float64s
    kind: NDArray[np.int8]
    sigma: Float64s

    def take(self, index: Bools) -> _Witnesses:
        """Those at `index`."""
        return _Witnesses(self.points[index], self.kind[index], self.sigma[index])


def block_evidence(
    light: Bytes,
    seen: WallMask,
    coarse: CoarseBlock,
    cells: CellScale,
    scale: int,
    midway: float | None,
    relief: Relief | None = None,
) -> BlockEvidence:
    """What the walls of a block say of its outline, in picture pixels.

    `light` is the picture's, `seen` and `coarse` are of one `scale` times smaller. `midway`: as `midway_to_table` says.
    `relief`, where the table is known: their ends are told by it.
    """
    pitch_px, wall = cells.pitch_px / scale, max(1.0, cells.wall_px / scale)
    chains = edge_chains(seen.mask, coarse, pitch_px)
    found = find_ends(chains, coarse, pitch_px, wall)
    outer = chains.points[outermost(chains, coarse, pitch_px)]
    sign = 1.0 if cells.bright else -1.0
    straight = found.straight * scale
    tip, axis = centred_axes(
        light, pixels_of(found.tip, scale), found.axis, wall=cells.wall_px, straight=straight, sign=sign
    )
    if relief is None:
        depth = parallax(light, tip, axis, straight=straight, wall=cells.wall_px, sign=sign)
        tip = _to_tops(tip, axis, depth)
    else:
        depth = Parallax(relief.displacement.share, relief.displacement.middle, relief.wall_px + _MASK_BLUR_PX)
    ends = _Ends(tip, axis, coarse.feet(found.tip)[2], straight)
    model = _learnt(light, ends, cells, depth.width or cells.wall_px, seen)
    tips = _tips(light, ends, cells, model) if relief is None else _relief_tips(relief, ends, cells, model)
    dark = None if midway is None else _Dark(light, midway, cells.pitch_px)
    if dark is not None:
        normal = coarse.feet(samples_of(tips.points, scale))[2]
        # A clean end is where the wall ends; what is dark beyond it is the block's shadow.
        faded = (depth.across(tips.points, normal) >= 0.0) & (tips.kind != WitnessKind.CLEAN)
        least = np.where(faded, _ENDS_INSIDE_PITCHES * cells.pitch_px, np.inf)
        tips = _to_the_table(dark, tips, tips.points, normal, least)
    if relief is None:
        tips = replace(tips, points=_raised(tips.points, coarse.feet(samples_of(tips.points, scale))[2], depth))
    outer = outer[nearest(outer, samples_of(tips.points, scale)) > _LONELY_PITCHES * pitch_px]
    normal, place = coarse.feet(outer)[2], pixels_of(outer, scale)
    sides, height = _sides(light, place, normal, depth.width or cells.wall_px, model)
    if dark is None:
        walls = ~_of_shadows(light, place, normal, height, cells.pitch_px, model)
        sides, normal = sides.take(walls), normal[walls]
    else:
        faint = (sides.sigma >= _FAINT_SIGMA_PX) & (depth.across(place, normal) >= 0.0)
        least = np.where(faint, _INSIDE_PITCHES * cells.pitch_px, np.inf)
        sides = _to_the_table(dark, sides, place, normal, least)
    sides = replace(sides, points=_raised(sides.points, normal, depth))
    if relief is not None:
        sides = _high(relief, sides, tips)
    polarity = "bright" if cells.bright else "dark"
    return BlockEvidence(
        _rings(coarse, tips, sides, _walls(chains, coarse, pitch_px), depth, scale),
        cells.pitch_px,
        cells.wall_px,
        polarity,
        model.blur,
        seen.noise,
        seen.contrast,
        # What is told by top and side together is as unsure as light at full scale: half of a height lies elsewhere.
        _clipped(light, np.concatenate([tips.points, sides.points])) if relief is None else 1.0,
        coarse.leaves,
    )


def border_evidence(
    border: Float64s, seen: WallMask, coarse: CoarseBlock, cells: CellScale, scale: int
) -> BlockEvidence:
    """What is said of a block's outline by places where its comb ends, (N, 2), picture pixels, in the way of
    `block_evidence`; ends of walls say nothing.
    """
    pitch_px = cells.pitch_px / scale
    points = border[np.abs(coarse.depth_at(samples_of(border, scale))) < _BORDER_PITCHES * pitch_px]
    kind = np.full(len(points), WitnessKind.BLUNT, np.int8)
    ends = _Witnesses(points, kind, np.full(len(points), _BORDER_SIGMA_PITCHES * cells.pitch_px))
    walls = _walls(edge_chains(seen.mask, coarse, pitch_px), coarse, pitch_px)
    rings = _rings(coarse, ends, ends.take(kind < 0), walls, Parallax(0.0, np.zeros(2), None), scale)
    told = seen.noise, seen.contrast, 0.0, coarse.leaves
    return BlockEvidence(rings, cells.pitch_px, cells.wall_px, "bright", _USUAL_BLUR_PX, *told)


def _clipped(light: Bytes, points: Float64s) -> float:
    """Share of points beside which light is at full scale."""
    if not len(points):
        return 0.0
    across, down = np.meshgrid(_BESIDE_PX, _BESIDE_PX)
    around = sample_at(light, points[:, :1] + across.ravel(), points[:, 1:] + down.ravel())
    return float(np.mean(around.max(axis=1) >= FULL_SCALE))


def _learnt(light: Bytes, ends: _Ends, cells: CellScale, wall: float, seen: WallMask) -> EndModel:
    """What the straightest ends say of all: blur, usual height, and the true width of walls that measure `wall`."""
    model = EndModel(
        width=true_width(wall, float(np.hypot(_USUAL_BLUR_PX, _MASK_BLUR_PX))),
        blur=_USUAL_BLUR_PX,
        height=None,
        noise=seen.noise,
        reach=float(np.clip(0.3 * cells.pitch_px, 2.5, 2 * cells.wall_px + 4)),
        out=float(np.clip(0.25 * cells.pitch_px, 3.0, 6.0)),
        sign=1.0 if cells.bright else -1.0,
    )
    longest = np.argsort(-ends.straight)[: max(5, min(64, len(ends.tip) // 2))]
    if not len(longest):
        return replace(model, height=max(seen.contrast, 1.0))
    free = fit_ends(light, ends.tip[longest], ends.axis[longest], ends.normal[longest], replace(model, blur_free=True))
    blur = float(np.clip(median(free.blur), *_BLUR_PX))
    width = true_width(wall, float(np.hypot(blur, _MASK_BLUR_PX)))
    return replace(model, width=width, blur=blur, height=max(median(free.height), 1.0))


def _tips(light: Bytes, ends: _Ends, cells: CellScale, model: EndModel) -> _Witnesses:
    """Fitted wall ends; those too faint or too unsure are left out."""
    fitted = fit_ends(light, ends.tip, ends.axis, ends.normal, model)
    good = (fitted.sigma < _MOST_SIGMA_PX) & (fitted.height > _LEAST_HEIGHT * (model.height or 1.0))
    return _ends_of(fitted.point, fitted.sigma, ends, cells).take(good)


def _relief_tips(relief: Relief, ends: _Ends, cells: CellScale, model: EndModel) -> _Witnesses:
    """Ends of walls' tops on a known table; those that top and side tell too little of are left out."""
    fitted = relief_ends(relief, ends.tip, ends.axis, ends.normal, pitch_px=cells.pitch_px, blur_px=model.blur)
    good = (fitted.sigma < _MOST_RELIEF_SIGMA_PX) & (fitted.told > _LEAST_TOLD)
    if good.any():
        good &= fitted.height > _LEAST_RELIEF_HEIGHT * median(fitted.height[good])
    return _ends_of(fitted.point, fitted.sigma, ends, cells).take(good)


def _ends_of(point: Float64s, sigma: Float64s, ends: _Ends, cells: CellScale) -> _Witnesses:
    """Ends of walls fitted to points (N, 2), so unsure by the fit, (N,): clean ones where enough straight wall is."""
    clean = ends.straight > 2 * cells.wall_px + 2
    kind = np.where(clean, WitnessKind.CLEAN, WitnessKind.BLUNT).astype(np.int8)
    return _Witnesses(point, kind, np.hypot(np.where(clean, *_MODEL_SIGMA_PX), sigma))


def _high(relief: Relief, sides: _Witnesses, tips: _Witnesses) -> _Witnesses:
    """Outermost wall points that stand out of a known table, of what ends do, by more than its own shades do."""
    least = _LEAST_SIDE_HEIGHT * median(relief.height_at(tips.points)) if len(tips.points) else 0.0
    good = relief.height_at(sides.points) > least
    return sides.take(good)


def _sides(
    light: Bytes, place: Float64s, normal: Float64s, wall: float, model: EndModel
) -> tuple[_Witnesses, Float64s]:
    """Outermost wall points, moved along the outline's normal to half height where that is near, and by how much light
    falls there, (N,); `wall` is the width of walls at half height.
    """
    across = replace(model, width=1.0, reach=min(model.reach, wall))
    fitted = fit_ends(light, place, normal, normal, across)
    near = np.abs(((fitted.point - place) * normal).sum(axis=1)) < _NEAR_PX
    # Beside a thin wall half height lies outside of it, at its corners and ends inside: a third of the way is left.
    fat = (wall - model.width) / 6
    points = np.where(near[:, None], fitted.point, place) - fat * normal
    sigma = np.where(near, *_SIDE_SIGMA_PX)
    # The outer side of the block, where it is in view below its top, is fainter than any wall.
    sigma = np.where(fitted.height < _FAINT_HEIGHT * (model.height or 1.0), _FAINT_SIGMA_PX, sigma)
    kind = np.full(len(place), WitnessKind.OUTERMOST, np.int8)
    return _Witnesses(points, kind, sigma), fitted.height


def _of_shadows(
    light: Bytes, place: Float64s, normal: Float64s, height: Float64s, pitch_px: float, model: EndModel
) -> Bools:
    """Which outermost points, from which light falls so much, (N,), are of the border of a shadow on a light table."""
    usual = model.height or 1.0
    beyond, within = (
        model.sign * light_beside(light, place, normal, out) for out in (_BEYOND_PX, -_WITHIN_PITCHES * pitch_px)
    )
    lighter = beyond.mean(axis=0) - within.min(axis=0)
    return np.asarray((height < _LEAST_FALL * usual) & (lighter > _LIGHTER_BEYOND * usual))


@dataclass(frozen=True, eq=False)
class _Dark:
    """Dark material: the light it is seen in, the level midway from it to the table, its cells' pitch."""

    light: Bytes
    midway: float
    pitch_px: float


def _to_the_table(dark: _Dark, seen: _Witnesses, place: Float64s, normal: Float64s, least: Float64s) -> _Witnesses:
    """Witnesses at `place`, with those that lie inside of dark material by `least` (N,) pixels or more, where its walls
    show no more, moved out to its edge.
    """
    beyond = dark_beyond(dark.light, place, normal, midway=dark.midway, reach=_DARK_PITCHES * dark.pitch_px)
    moved = (beyond > least) & np.isfinite(beyond)
    edge = place + np.where(moved, beyond, 0.0)[:, None] * normal
    points = np.where(moved[:, None], edge, seen.points)
    sigma = np.where(moved, max(_DARK_SIGMA_PX, _DARK_SIGMA_PITCHES * dark.pitch_px), seen.sigma)
    return _Witnesses(points, np.where(moved, np.int8(WitnessKind.OUTERMOST), seen.kind), sigma)


def _to_tops(tip: Float64s, axis: Float64s, depth: Parallax) -> Float64s:
    """Tips moved across their walls: the top is the half of the band that lies away from the picture's middle."""
    if depth.width is None:
        return tip
    across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    return np.asarray(tip + 0.5 * depth.across(tip, across)[:, None] * across)


def _raised(points: Float64s, normal: Float64s, depth: Parallax) -> Float64s:
    """Points moved from the lower edge of the block's outer side up to its top, where that side is in view."""
    return (
        points + np.minimum(depth.across(points, normal), 0.0)[:, None] * normal if depth.width is not None else points
    )


def _walls(chains: Chains, coarse: CoarseBlock, pitch_px: float) -> Float64s:
    """Points of the walls' boundary near the coarse edge, shape (K, 2), mask pixels."""
    points = chains.points[:: max(1, round(pitch_px / _WALL_POINTS_PER_PITCH))]
    return points[coarse.depth_at(points) < _WALLS_INSIDE * pitch_px]


def _rings(
    coarse: CoarseBlock, tips: _Witnesses, sides: _Witnesses, walls: Float64s, depth: Parallax, scale: int
) -> tuple[RingEvidence, ...]:
    """All witnesses, each at its nearest ring, in order along it, and the walls about it."""
    points = np.concatenate([tips.points, sides.points])
    kind, sigma = np.concatenate([tips.kind, sides.kind]), np.concatenate([tips.sigma, sides.sigma])
    ring, arc, normal = coarse.feet(samples_of(points, scale))
    beside, foot, across = coarse.feet(walls)
    wall_points = EdgePoints(_raised(pixels_of(walls, scale), across, depth), foot * scale, across)
    evidence = []
    for number, one in enumerate(coarse.rings):
        mine = np.flatnonzero(ring == number)
        mine = mine[np.argsort(arc[mine], kind="stable")]
        vertices = pixels_of(one.vertices, scale)
        arcs = arc[mine] * scale
        seen = (points[mine], arcs, normal[mine], sigma[mine], kind[mine], wall_points.take(beside == number))
        evidence.append(RingEvidence(vertices, one.is_hole, *seen))
    return tuple(evidence)
