"""`wall-tips`: the line along which a block was cut, through the ends of its cell walls."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from contour.edge.edge_evidence import ring_evidence
from contour.edge.edge_parts import EdgePart
from contour.edge.mirrored_block import is_mirrored, mirrored_block
from contour.edge.open_cells import without_open_cells
from contour.edge.stretches import Stretch
from contour.edge.table_look import TableLook, table_look
from contour.edge.visible_edge import doubtful, visible_rings
from contour.errors import NoBlockFound, ParameterError
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, oriented_contour, perimeter, signed_area
from contour.image.opencv import grey
from contour.material.floor_edge import floor_edge
from contour.outline.uncertainty import uncertainty
from contour.relief.reach import reach
from contour.relief.relief import Relief
from contour.seams.seam import parted_by_seam
from contour.seams.splice import spliced
from contour.tracing.edge_kind import (
    check_promise,
    may_be_closed,
)
from contour.tracing.evidence_check import (
    check_against_evidence,
    check_against_relief,
    check_on_walls,
    check_own_ends,
    check_reached,
    check_unseen,
    ends_outside_corners,
    untold_corners,
)
from contour.tracing.plates import check_sheet, onto_webs
from contour.tracing.solid import Solid
from contour.tracing.trace import OnStage, Trace, TraceSettings
from contour.tracing.wide_lines import wide_line
from contour.walls.lightness import wall_light
from contour.walls.pieces import Piece, with_earlier
from contour.walls.see_block import Outline, SeenWalls, Source, see_block, see_walls, strong_walls
from contour.walls.wall_evidence import BlockEvidence, RingEvidence

# Bounds that are wider than that share of a pitch are refused.
_SURE_PITCHES = 0.25
# On a table as light as walls a part known no better than that may be off by half a cell: of 385 outlines it alone held
# back two that were, own bounds 0.86 and 1.16 there.
_GROSS_PITCHES = 0.8
# An even table that was not taught is less surely known: of 41 outlines on such tables 10 broke their bounds, of
# which seven were off by up to so many times these.
_ON_EVEN_TABLE = 1.4
# On a known table: of 490 right outlines none is reached by no wall over more than 2.1 pitches, which one is.
_GAP_PITCHES = 2.5
# Beside comb that a network tells, shadows and grain of a table look like things along fewer cells than that: of 38
# right outlines three do along more. A sheet of paper, a weight in the block and a tape that it took for table did.
_LIES_BESIDE, _PLACES_PER_PITCH = 4.0, 4
# With more of the outline unseen than this there is nothing to say about its corners.
_MOST_UNSEEN = 0.5
# What of a thing lay inside the block as it was first seen shows once the rest of it is known.
_LOOKS = 3


def wall_tips(
    picture: Bytes,
    settings: TraceSettings,
    *,
    rectifier: Rectifier | None = None,
    relief: Relief | None = None,
    source: Source | None = None,
    on_stage: OnStage = lambda _name: None,
) -> Trace:
    """The outline of the largest block in `picture`, grey (H, W) or BGR (H, W, 3), uint8, exterior and holes, in
    pixels.

    `rectifier`, where the lens is known, lets straight edges be fitted in undistorted coordinates. `relief`: of a
    picture that is the difference from a known table. `source`: what `picture` was drawn from. `on_stage` hears "mask"
    and "trace". Raises PictureError, ParameterError, NoBlockFound, EdgeContradicted.
    """
    if settings.binarize != "flat":
        raise ParameterError(
            f"binarize is {settings.binarize!r}, but wall-tips finds its own threshold; use flat, or another method"
        )
    light = wall_light(picture)
    # Whatever differs from a known table is light; what lies over the block's edge shows in how that is lit.
    polarity = settings.polarity if relief is None else "bright"
    solid = Solid(picture, light, polarity, on_stage)
    if settings.edge == "cells":
        return solid.closed()
    if source is not None and source.outline is not None:
        return _told(source.outline, light, source.picture)
    walls = replace(see_walls(picture, light, polarity, solid.cells), relief=relief, source=source)
    if settings.least_rise is not None:
        walls = strong_walls(walls, settings.least_rise)
    foam = None if walls.cells.comb.cellular else solid.foam()
    found = foam or _of_comb(solid, walls, settings.edge, rectifier)
    if source is None or source.border is None or found.untold_px:
        return found
    return _told_of(found, source.light)


def _of_comb(solid: Solid, walls: SeenWalls, promise: str, rectifier: Rectifier | None) -> Trace:
    """The outline of a block of cells, or of a sheet with holes, whose border is `auto`, or promised to be `cut`."""
    light, on_stage = solid.light, solid.on_stage
    lit = solid.picture if walls.relief is None else walls.relief.lit
    seen, look = _looked_at_source(lit, walls, on_stage)
    plate = solid.plate(seen) if promise == "auto" else None
    if isinstance(plate, Trace):
        return plate
    if plate is not None:
        seen = plate
    # Webs end all around a sheet that was cut along more than one line, or show no ends. Nor do fainter walls where
    # these are left out: a cut border was drawn along its closed cells so.
    ends_tell = plate is None and not walls.strong
    closed, kind = solid.if_closed(seen) if ends_tell and may_be_closed(seen) else (None, None)
    # Where something hides the border no walls end either.
    if kind is not None and (kind != "mixed" or not doubtful(seen.rings[0], look).any()):
        check_promise(promise, kind, traced=closed is not None)
        if closed is not None:
            return closed
    if seen.leaves_picture:
        return _cut_off(light, seen, on_stage)
    try:
        found = _cut_or_mirrored(lit, light, walls, (seen, look), rectifier, on_stage)
        if kind == "mixed" and not any(part.hidden_or_filled for part in found.evidence or ()):
            # What seemed to hide it does not.
            check_promise(promise, kind, traced=closed is not None)
            found = closed or found
        if plate is not None:
            found = replace(found, contour=onto_webs(solid.edge, found.contour, seen.pitch_px))
            check_sheet(solid.edge, found.contour, seen.pitch_px)
        if promise == "auto" and plate is None and kind is None:
            solid.check_fine(seen, found.contour)
        return replace(found, parted=parted_by_seam(walls, seen, found.contour.exterior), wide=_wide(found, walls))
    except NoBlockFound as error:
        # A rim with screws has ends of walls around it, too, and lines through them lead nowhere.
        if kind is None and promise != "cut" and ends_tell:
            closed, _ = solid.if_closed(seen)
        if promise == "cut" or closed is None:
            error.edge = "cut"
            raise
        return closed


def _looked_at_source(lit: Bytes, walls: SeenWalls, on_stage: OnStage) -> tuple[BlockEvidence, TableLook]:
    """As `looked_at`; what lies over ends of walls that were drawn shows in the picture that they were drawn from.
    Where comb is known to end, raise NoBlockFound if that shows much beside it.
    """
    source = walls.source
    if source is None or source.border is None:
        return looked_at(lit if source is None else source.picture, walls, on_stage)
    seen, look = looked_at(lit, walls, on_stage)
    _check_beyond(source.picture, seen)
    return seen, look


def _check_beyond(picture: Bytes, seen: BlockEvidence) -> None:
    """Raise NoBlockFound where the picture that comb was drawn from shows something beside it that is no table."""
    look = table_look(picture, seen)
    long = max(look.lit_along(ring) for ring in seen.rings) / seen.pitch_px
    if long > _LIES_BESIDE:
        raise NoBlockFound(f"no block found: along {long:.0f} cells of what looks like comb something lies beside it")


def _told_of(found: Trace, light: Bytes) -> Trace:
    """The trace with a place where the light that comb was drawn from shows floors beyond a rounding, if it does."""
    pitch_px = found.pitch_px or 0.0
    sides = [(ring[::-1], bright) for ring in found.contour.rings for bright in (True, False)]
    floors = (floor_edge(light, ring, pitch_px, bright=bright) for ring, bright in sides)
    return replace(found, untold_px=_first(one.places[one.beyond] for one in floors))


def _told(outline: Outline, light: Bytes, picture: Bytes) -> Trace:
    """The trace of an outline that was told, of comb drawn in that light from a picture. Raises NoBlockFound where that
    shows something beside it that is no table, nor a shadow.
    """
    pitch_px = outline.pitch_px
    # Its witnesses run with the material on their left in pixels.
    rings = tuple(
        _told_ring(ring, pitch_px) for ring in oriented_contour(outline.contour, counter_clockwise=True).rings
    )
    _check_beyond(picture, BlockEvidence(rings, pitch_px, 0.0, "bright", 0.0, 0.0, 0.0, 0.0))
    # As any other is traced, with the material on its left seen with y up.
    contour = oriented_contour(outline.contour, counter_clockwise=False)
    seen = (
        Stretch(number, 0.0, perimeter(ring), "seen", None, outline.bound_px)
        for number, ring in enumerate(contour.rings)
    )
    return Trace(
        "wall-tips",
        "bright",
        pitch_px,
        contour,
        light,
        uncertainty_px=outline.bound_px,
        edge="cut",
        evidence=tuple(seen),
    )


def _told_ring(ring: Ring, pitch_px: float) -> RingEvidence:
    """Some places of a ring that was told, with the material on its left by its shoelace, as what witnesses it."""
    lengths = RingLengths.of(ring)
    position = np.arange(0.0, lengths.length, pitch_px / _PLACES_PER_PITCH)
    normal, of_all = lengths.normals(position, pitch_px), np.zeros(len(position))
    return RingEvidence(
        ring, signed_area(ring) < 0.0, lengths.at(position), position, normal, of_all, of_all.astype(np.int8)
    )


def _wide(found: Trace, walls: SeenWalls) -> EdgePart | None:
    """The longest line along a cut outline that is wider than its walls."""
    if found.evidence is None or found.pitch_px is None:
        return None
    return wide_line(
        walls.mask.mask,
        found.contour,
        found.evidence,
        pitch_px=found.pitch_px,
        wall_px=walls.cells.wall_px,
        scale=walls.scale,
    )


def _cut_or_mirrored(
    picture: Bytes,
    light: Bytes,
    walls: SeenWalls,
    looked: tuple[BlockEvidence, TableLook],
    rectifier: Rectifier | None,
    on_stage: OnStage,
) -> Trace:
    """As `_cut`; where that is in doubt, without the walls that a polished table mirrors: it is darker than they."""
    if walls.relief is not None:
        found = _cut(picture, light, looked, rectifier, on_stage, walls.relief)
        return _no_surer_than_anywhere(found, _ON_EVEN_TABLE if walls.relief.even else 1.0)
    if walls.strong:
        return _cut(picture, light, looked, rectifier, on_stage)
    try:
        found = _cut(picture, light, looked, rectifier, on_stage)
    except NoBlockFound:
        mirrored = _mirrored(picture, light, walls, None, rectifier, on_stage)
        if mirrored is None:
            raise
        return mirrored
    return found if _sure(found) else _mirrored(picture, light, walls, found.contour, rectifier, on_stage) or found


def _no_surer_than_anywhere(found: Trace, times: float) -> Trace:
    """The trace with bounds so many times wider, no surer as a whole than where it is least sure, if that is most of a
    cell.
    """
    evidence = tuple(replace(part, bound_px=times * part.bound_px) for part in found.evidence or ())
    worst = max((part.bound_px for part in evidence), default=0.0)
    unsure = worst > _GROSS_PITCHES * (found.pitch_px or 0.0)
    whole = None if found.uncertainty_px is None else times * found.uncertainty_px
    return replace(found, uncertainty_px=max(worst, whole or 0.0) if unsure else whole, evidence=evidence)


def _sure(found: Trace) -> bool:
    """Whether all of an outline is seen, and known to a share of a cell."""
    seen = all(stretch.state == "seen" for stretch in found.evidence or ())
    return seen and found.untold_px is None and (found.uncertainty_px or 0.0) <= _SURE_PITCHES * (found.pitch_px or 0.0)


def _mirrored(
    picture: Bytes,
    light: Bytes,
    walls: SeenWalls,
    first: Contour | None,
    rectifier: Rectifier | None,
    on_stage: OnStage,
) -> Trace | None:
    """The outline along which the table mirrors the block, sure where one is; None without any."""
    best = None
    for looked in mirrored_block(picture, walls, first, rectifier):
        try:
            found = _cut(picture, light, looked, rectifier, on_stage)
        except NoBlockFound:
            continue
        if is_mirrored(walls, found.contour):
            # What ends outside is the block's image.
            found = replace(found, outside_px=None)
            if _sure(found):
                return found
            best = best or found
    return best


def _cut(
    picture: Bytes,
    light: Bytes,
    looked: tuple[BlockEvidence, TableLook],
    rectifier: Rectifier | None,
    on_stage: OnStage,
    relief: Relief | None = None,
) -> Trace:
    """The line along which a block was cut, through the ends of its walls."""
    seen, look = looked
    visible = visible_rings(picture, seen, look, rectifier)
    for one in visible:
        check_against_evidence(one.evidence, one.fitted.ring, one.fitted.inlier, seen.pitch_px, rectifier)
        if relief is not None:
            check_against_relief(one.evidence, one.fitted.ring, relief, seen.pitch_px, rectifier)
    rings = [one.fitted for one in visible]
    exterior = rings[0]
    if exterior.unseen_share > _MOST_UNSEEN:
        raise NoBlockFound(
            f"no block found: wall ends witness {100 * (1 - exterior.unseen_share):.0f} % of the outline, "
            f"expected at least {100 * (1 - _MOST_UNSEEN):.0f} %. "
            "Check the light, and that all of the block lies in view"
        )
    # Rings are fitted with the material on their left in pixels; seen in the work frame, whose y runs up, that is
    # clockwise.
    contour = Contour(exterior.ring[::-1].copy(), tuple(hole.ring[::-1].copy() for hole in rings[1:]))
    reaches = None if relief is None else [reach(relief, one.ring, seen.pitch_px, rectifier) for one in rings]
    bounds = uncertainty(
        [(one.evidence, one.fitted) for one in visible],
        pitch_px=seen.pitch_px,
        blur_px=seen.blur_px,
        clipped=seen.clipped,
        unreached=None if reaches is None else [one.gaps(_GAP_PITCHES * seen.pitch_px) for one in reaches],
    )
    on_stage("trace")
    evidence = tuple(
        stretch
        for number, (ring, one) in enumerate(zip(contour.rings, visible, strict=True))
        for stretch in ring_evidence(number, ring, one, look, rectifier, bounds[number])
    )
    if all(stretch.state == "seen" for stretch in evidence):
        for one in visible:
            if relief is None:
                check_on_walls(one.evidence, one.fitted.inlier, light, seen.pitch_px)
            check_unseen(one.evidence, one.fitted.ring, one.fitted.inlier, light, seen.pitch_px, rectifier)
            check_own_ends(one.evidence, one.fitted, seen.pitch_px, rectifier)
        check_reached(reaches or (), _GAP_PITCHES * seen.pitch_px)
    lit = light if relief is None else grey(picture)
    untold = _first(untold_corners(one, lit, seen, exterior=one is visible[0]) for one in visible)
    outside = _first(
        ends_outside_corners(one.evidence, one.fitted.ring, one.fitted.inlier, seen.pitch_px, rectifier)
        for one in visible
    )
    found = _trace(seen, contour, light, uncertainty_px=bounds[0].whole_px)
    # What fills cells hides walls, too; but what is dark may be a hole in the block's shade.
    middles = seen.openings[:, :2]
    clear = ((look.foreign_at(middles) > 0.0) | ~look.lighter_at(middles)) & ~look.solid_at(middles)
    opening = next(((float(x), float(y), 2.0 * float(radius)) for x, y, radius in seen.openings[clear]), None)
    return replace(
        found,
        edge="cut",
        evidence=evidence,
        look=look,
        untold_px=untold,
        outside_px=outside,
        opening_px=opening,
    )


def _first(rings: Iterable[Float64s]) -> tuple[float, float] | None:
    """The first of the places (x, y) told of rings one by one, (K, 2) each; None without any."""
    return next(((float(x), float(y)) for places in rings for x, y in places), None)


def looked_at(picture: Bytes, walls: SeenWalls, on_stage: OnStage) -> tuple[BlockEvidence, TableLook]:
    """What is seen of the block, and of what lies on it and around it: once more where that hides some of its edge."""
    hidden: Bytes | None = None
    joining: Bytes | None = None
    plain = False
    earlier: tuple[Piece, ...] = ()
    for _ in range(_LOOKS):
        seen = see_block(walls, lambda: on_stage("mask"), hidden=hidden, joining=joining)
        earlier = with_earlier(seen.others, earlier, seen.rings[0].coarse)
        seen = replace(seen, others=earlier)
        look = table_look(picture, seen, plain=plain)
        if walls.relief is not None:
            look = without_open_cells(replace(look, shade=np.zeros_like(look.shade)), walls.relief)
        if not (seen.leaves_picture or any(doubtful(ring, look).any() for ring in seen.rings)):
            break
        known = np.zeros_like(look.hiding) if hidden is None else hidden
        hidden, plain = look.hiding, look.plain
        splice = spliced(look.things, look.table, look.light, seen, look.step)
        if splice is not None:
            between, part = splice
            joining = _with(joining, between.astype(np.uint8))
            hidden = np.where(part & ~between, np.uint8(0), hidden)
            earlier = ()
            continue
        # Where the pitch was told anew, so may be the maps' grid.
        if hidden.shape == known.shape and not (hidden > known).any():
            break
    return seen, look


def _with(known: Bytes | None, more: Bytes) -> Bytes:
    """A map and what was known before, on the same grid; more alone where that is another one."""
    return more if known is None or known.shape != more.shape else known | more


def _cut_off(light: Bytes, seen: BlockEvidence, on_stage: OnStage) -> Trace:
    """The coarse outline of a block that leaves the picture, along its border there: for a refusal to show."""
    last = np.array([light.shape[1] - 1.0, light.shape[0] - 1.0])
    rings = [np.clip(ring.coarse, 0.0, last)[::-1].copy() for ring in seen.rings]
    on_stage("trace")
    return _trace(seen, Contour(rings[0], tuple(rings[1:])), light)


def _trace(seen: BlockEvidence, contour: Contour, light: Bytes, *, uncertainty_px: float | None = None) -> Trace:
    return Trace(
        "wall-tips",
        "dark" if seen.polarity == "dark" else "bright",
        seen.pitch_px,
        contour,
        light,
        uncertainty_px=uncertainty_px,
        others=seen.others,
        comb=seen.comb,
        reaches_frame=seen.reaches_frame,
    )
