"""What speaks against a traced block: no comb, not all in view, not alone, or another than the picture shows."""

from __future__ import annotations

import numpy as np

from contour.acceptance.edge_contrast import shows_table
from contour.acceptance.findings import SHOWN_PITCHES, Finding, Limits, Refusal, around, closed, edge_of, runs_where
from contour.acceptance.quality import QualityLimits, lost_in_noise
from contour.acceptance.trace_check import CheckedTrace
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, area, perimeter
from contour.image.region import Region
from contour.narrow_features.arms import torn
from contour.segmentation.second_opinion import Doubt, SecondOpinion
from contour.tracing.trace import Trace
from contour.walls.comb_likeness import unlike_comb
from contour.walls.pieces import STRIP_PITCHES, Piece

# Of what contour and busy region may be apart in one place, the share that they may be apart everywhere. Of 500
# traceable scenes none lies farther outside than 0.19 pitches; outlines a cell too fat lie 0.33 or more in 98 of 100.
_EVERYWHERE = 0.125
# Cell pitches: what is 95 % sure within a quarter of a cell is hardly anywhere off by half a one.
_SURE_WITHIN_PITCHES = 0.25
_SURE_WITHIN_SHARE = 0.01
# Of the whole outline a small hole is little: of none of its rings may more than this share be no surer than half a
# cell. Of 320 right outlines with holes three are refused for it, two of them 0.3 of a cell off.
_UNSURE_PITCHES, _UNSURE_SHARE = 0.5, 0.2
# Of two blocks whose areas differ by less than this the larger one is a matter of chance.
_EQUAL_SHARE = 0.8


def no_walls(traced: CheckedTrace | None, limits: QualityLimits) -> Finding | None:
    """Walls that stand out too little from noise to be walls."""
    if traced is None or traced.quality is None:
        return None
    why = lost_in_noise(traced.quality, limits)
    return Finding(Refusal.NO_BLOCK_FOUND, f"No block found: {why}.") if why else None


def no_comb(traced: CheckedTrace | None) -> Finding | None:
    """Cells that look like something else than a cut comb."""
    if traced is None or traced.trace.comb is None:
        return None
    blur_px = 0.0 if traced.quality is None else traced.quality.blur_px
    trace, comb = traced.trace, traced.trace.comb
    shown = comb.lattice and shows_table(trace.light, trace.contour, comb.pitch_px, dark=not comb.bright)
    why = unlike_comb(comb, blur_px, cut=not trace.closed, shown=shown)
    return Finding(Refusal.NO_BLOCK_FOUND, f"No block found: {why}.") if why else None


def reaches_frame(traced: Trace | None) -> Finding | None:
    """Walls in the last pixels of what was looked at."""
    if traced is None or not traced.reaches_frame:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        "The block's walls go on to the last pixels of what was looked at: part of it may lie outside. Move the block "
        "so that all of it is in view.",
    )


def touches_border(outlines: list[Ring], frame_size: tuple[int, int], border_px: float) -> Finding | None:
    """Outlines within `border_px` of the picture's edges; `frame_size` is (width, height)."""
    # Pixel (0, 0) is a centre: the frame's edges lie half a pixel outside the first and last ones. A ring reaches
    # farthest at a vertex; the polygon leaves some out, so the ring that it was made of counts too.
    lowest = np.min([outline.min(axis=0) for outline in outlines], axis=0)
    highest = np.max([outline.max(axis=0) for outline in outlines], axis=0)
    low, high = lowest + 0.5, np.asarray(frame_size) - 0.5 - highest
    sides = {"left": low[0], "top": low[1], "right": high[0], "bottom": high[1]}
    side = min(sides, key=lambda name: float(sides[name]))
    if sides[side] > border_px:
        return None
    last = np.asarray(frame_size) - 1.0
    near = [np.minimum(outline, last - outline).min(axis=1) + 0.5 <= border_px for outline in outlines]
    return Finding(
        Refusal.TOUCHES_BORDER,
        f"The contour comes within {max(float(sides[side]), 0.0):.1f} px of the picture's {side} edge, at least "
        f"{border_px:g} px are needed. Move the block so that all of it is in view.",
        tuple(path for outline, on in zip(outlines, near, strict=True) for path in runs_where(outline, on)),
    )


def touches_region(outlines: list[Ring], region: Region | None, border_px: float) -> Finding | None:
    """Outlines within `border_px` of the region's border."""
    if region is None:
        return None
    # A block that goes on outside of the region is cut by its border, along the last pixels' centres.
    margin = min(region.margin(outline) for outline in outlines) + 0.5
    if margin > border_px:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        f"The contour comes within {max(margin, 0.0):.1f} px of the edge of the region of interest, at least "
        f"{border_px:g} px are needed. Move the block so that all of it lies in the region, or correct roi_px or "
        "roi_mm.",
        (closed(region.ring),),
    )


def _other_blocks(traced: Trace, limits: Limits) -> list[Piece]:
    """The pieces beside the traced block for which it is refused, largest first."""
    share = max(limits.block_share, _EQUAL_SHARE) if limits.pieces == "largest" else limits.block_share
    wide_px = STRIP_PITCHES * (traced.pitch_px or 0.0)
    least_px2 = share * area(traced.contour)
    return [piece for piece in traced.others if piece.area_px2 >= least_px2 and piece.width_px > wide_px]


def several_blocks(traced: Trace | None, limits: Limits) -> Finding | None:
    """Another block beside the traced one."""
    blocks = [] if traced is None else _other_blocks(traced, limits)
    if traced is None or not blocks:
        return None
    own = area(traced.contour)
    left, top, right, bottom = blocks[0].box_px
    seen = (
        f"Beside the traced block of {own:.0f} px² lies another of {blocks[0].area_px2:.0f} px² "
        f"(x {left} to {right}, y {top} to {bottom} px)" + (f", and {len(blocks) - 1} more" if blocks[1:] else "")
    )
    shown = tuple(closed(block.outline_px) for block in blocks if len(block.outline_px))
    if limits.pieces == "largest":
        return Finding(
            Refusal.SEVERAL_BLOCKS,
            f"{seen}. For pieces: largest others may reach {100 * _EQUAL_SHARE:.0f} % of it, else the largest is a "
            "guess. Take one of them away.",
            shown,
        )
    return Finding(
        Refusal.SEVERAL_BLOCKS,
        f"{seen}. The recipe allows one, and offcuts up to {100 * limits.block_share:g} % of it. Leave one block on "
        "the table, or use a recipe with pieces: largest.",
        shown,
    )


def parted(traced: CheckedTrace | None) -> Finding | None:
    """A seam through the traced block."""
    part = None if traced is None else traced.trace.parted
    if traced is None or part is None:
        return None
    left, top, right, bottom = part.box_px
    rest = area(traced.trace.contour) - part.area_px2
    return Finding(
        Refusal.SEVERAL_BLOCKS,
        f"Hardly any walls lead from {part.area_px2:.0f} px² of the traced block (x {left} to {right}, y {top} to "
        f"{bottom} px) to the other {rest:.0f} px²: two blocks seem to lie against each other. Leave one on the table, "
        "or more than a cell between them, or set max_disagreement_pitches: 0 for blocks with such a seam.",
        (closed(part.outline_px),),
    )


def disagrees(traced: CheckedTrace | None, limit: float | None) -> Finding | None:
    """Contour and busy picture farther apart than `limit` pitches, or an edge that is none of a block."""
    if traced is None or traced.disagreement is None or limit is None:
        return None
    shown_px = SHOWN_PITCHES * (traced.trace.pitch_px or 0.0)
    at_edge = _odd_edge(traced, shown_px)
    if at_edge is not None:
        return at_edge
    apart = traced.disagreement
    advice = "Look at the overlay; check light and table, and that nothing lies against the block."
    if apart.pitches > limit:
        what = "takes for block what looks like table" if apart.claimed else "leaves out what looks like block"
        x, y = apart.place_px
        return _disagreement_at(
            (x, y),
            shown_px,
            f"The contour {what} near ({x:.0f}, {y:.0f}) px, by {apart.pitches:.1f} cells, {limit:g} are allowed. "
            f"{advice}",
        )
    if apart.outside_pitches > _EVERYWHERE * limit:
        return Finding(
            Refusal.METHODS_DISAGREE,
            f"Most of the contour lies outside of what looks like block, by {apart.outside_pitches:.2f} cells, "
            f"{_EVERYWHERE * limit:g} are allowed. {advice}",
        )
    return None


def _odd_edge(traced: CheckedTrace, shown_px: float) -> Finding | None:
    """A chip's bump or dent, a part of the edge without cells behind it or with comb beyond it, or cells or a hole that
    are left out.
    """
    if traced.narrow is not None:
        narrow = traced.narrow
        what = "stands out of its edge" if narrow.outwards else "goes into its edge"
        x, y = narrow.place_px
        return _disagreement_at(
            (x, y),
            shown_px,
            f"The contour {what} by {narrow.depth_pitches:.1f} cells over {narrow.width_pitches:.1f} cells near "
            f"({x:.0f}, {y:.0f}) px: so narrow a part may be a chip, a strip or a label on the block, or cells lost. "
            "Look at the overlay; take it away, or set max_disagreement_pitches: 0 for parts that narrow.",
        )
    if traced.bare is not None:
        x, y = traced.bare.place_px
        return _no_cells(traced.bare.length_pitches, (x, y), shown_px)
    if traced.trace.opening_px is not None:
        x, y, wide = traced.trace.opening_px
        return _disagreement_at(
            (x, y),
            shown_px,
            f"Walls are missing over {wide / (traced.trace.pitch_px or wide):.1f} cells around ({x:.0f}, {y:.0f}) px: "
            "cells are lost there, or it is a hole, which is traced from 2.2 cells on. Look at the overlay; take "
            "another block, or set max_disagreement_pitches: 0 for blocks from which cells are missing.",
        )
    if traced.beyond is not None:
        x, y = traced.beyond.place_px
        return _disagreement_at(
            (x, y),
            shown_px,
            f"Along {traced.beyond.length_pitches:.1f} cells of the contour, near ({x:.0f}, {y:.0f}) px, comb seems to "
            "go on beyond it, its walls faint, or something lies against the block there. Look at the overlay; check "
            "light and exposure, and clear the edge.",
        )
    if traced.trace.outside_px is not None:
        x, y = traced.trace.outside_px
        return _disagreement_at(
            (x, y),
            shown_px,
            f"Beside a corner of the contour a wall ends outside of it, near ({x:.0f}, {y:.0f}) px: the corner may lie "
            "elsewhere. Look at the overlay; take away what lies beside the block, and check light and focus.",
        )
    return None


def judge_opinion(opinion: SecondOpinion, pitch_px: float) -> tuple[Finding, ...]:
    """What a second opinion says against the contour of a block with cells of that pitch."""
    findings = []
    if opinion.beyond is not None:
        findings.append(_left_out(opinion.beyond, pitch_px))
    if opinion.over is not None:
        findings.append(_lies_over(opinion.over, pitch_px))
    if opinion.bare is not None:
        findings.append(_no_cells(opinion.bare.pitches, opinion.bare.place_px, SHOWN_PITCHES * pitch_px))
    if opinion.hole is not None:
        findings.append(_hole_left_out(opinion.hole, pitch_px))
    if opinion.corner is not None:
        findings.append(_corner_beyond(opinion.corner, pitch_px))
    if opinion.seam is not None:
        findings.append(_seam(opinion.seam, pitch_px))
    if opinion.laid is not None:
        findings.append(_no_hole(opinion.laid, pitch_px))
    return tuple(findings)


def _no_hole(laid: Doubt, pitch_px: float) -> Finding:
    (x, y), wide = laid.place_px, laid.pitches
    return _finding_at(
        Refusal.EDGE_COVERED,
        (x, y),
        0.5 * wide * pitch_px,
        f"Something seems to lie on the block near ({x:.0f}, {y:.0f}) px, {wide:.1f} cells wide, where a "
        "hole was traced. Look at the overlay; take it away, or set max_disagreement_pitches: 0 for such a hole.",
    )


def _left_out(beyond: Doubt, pitch_px: float) -> Finding:
    (x, y), far = beyond.place_px, beyond.pitches
    return _disagreement_at(
        (x, y),
        SHOWN_PITCHES * pitch_px,
        f"Comb seems to reach {far:.1f} cells beyond the contour near ({x:.0f}, {y:.0f}) px: its walls may be faint "
        "there, or something lies over the block or against it. Look at the overlay; check light and table, and clear "
        "the edge.",
    )


def _lies_over(over: Doubt, pitch_px: float) -> Finding:
    (x, y), long = over.place_px, over.pitches
    return _finding_at(
        Refusal.EDGE_COVERED,
        (x, y),
        SHOWN_PITCHES * pitch_px,
        f"Something seems to lie over {long:.1f} cells of the block's edge near ({x:.0f}, {y:.0f}) px, or glare to "
        "hide it. Look at the overlay; clear the edge, and check the light.",
    )


def _no_cells(long: float, place_px: tuple[float, float], shown_px: float) -> Finding:
    x, y = place_px
    return _disagreement_at(
        (x, y),
        shown_px,
        f"Along {long:.1f} cells of the contour, near ({x:.0f}, {y:.0f}) px, no cells lie just within it: it may run "
        "over the table, a label or along a cable there. Look at the overlay; clear the edge, check light and table, "
        "or set max_disagreement_pitches: 0 for blocks with filled cells.",
    )


def _hole_left_out(hole: Doubt, pitch_px: float) -> Finding:
    (x, y), wide = hole.place_px, hole.pitches
    return _disagreement_at(
        (x, y),
        0.5 * wide * pitch_px,
        f"Within the contour, near ({x:.0f}, {y:.0f}) px, there are no cells over {wide:.1f} cells: a hole or a slot "
        "that was not traced, or something that lies on the block. Look at the overlay; take it away, or set "
        "max_disagreement_pitches: 0 for blocks with filled cells.",
    )


def _corner_beyond(corner: Doubt, pitch_px: float) -> Finding:
    (x, y), far = corner.place_px, corner.pitches
    return _disagreement_at(
        (x, y),
        SHOWN_PITCHES * pitch_px,
        f"A corner of the contour reaches {far:.1f} cells beyond comb, near ({x:.0f}, {y:.0f}) px: it may be rounded "
        "there, or a wall lies beside it. Look at the overlay; take away what lies beside the block, and check light "
        "and focus.",
    )


def _seam(seam: Doubt, pitch_px: float) -> Finding:
    (x, y), long = seam.place_px, seam.pitches
    return _finding_at(
        Refusal.SEVERAL_BLOCKS,
        (x, y),
        SHOWN_PITCHES * pitch_px,
        f"A seam of {long:.0f} cells seems to run through the block near ({x:.0f}, {y:.0f}) px, as between two that "
        "lie against each other. Look at the overlay; leave one on the table, or more than a cell between them, or set "
        "max_disagreement_pitches: 0 for blocks with such a seam.",
    )


def _disagreement_at(place_px: tuple[float, float], shown_px: float, text: str) -> Finding:
    """Another account of the block at a place, pixels, that is shown so far around."""
    return _finding_at(Refusal.METHODS_DISAGREE, place_px, shown_px, text)


def _finding_at(refusal: Refusal, place_px: tuple[float, float], shown_px: float, text: str) -> Finding:
    """What speaks against a contour at a place, pixels, that is shown so far around."""
    return Finding(refusal, text, (around(*place_px, shown_px),))


def vague(traced: Trace | None) -> Finding | None:
    """Whatever the recipe allows: beyond some cells it is not known which of them belong to the block."""
    if traced is None or traced.uncertainty_px is None or not traced.pitch_px:
        return None
    if traced.untold_px is not None:
        x, y = traced.untold_px
        return Finding(
            Refusal.UNCERTAINTY_TOO_LARGE,
            f"Near ({x:.0f}, {y:.0f}) px the wall ends hardly tell a round contour from one with a corner half a "
            "cell off. Look at the overlay; take away what lies against the block, and check light and focus.",
            (around(x, y, SHOWN_PITCHES * traced.pitch_px),),
        )
    cells = traced.uncertainty_px / traced.pitch_px
    if cells <= _SURE_WITHIN_PITCHES or _sure_of_material(traced, traced.uncertainty_px, traced.pitch_px):
        return _vague_ring(traced, traced.pitch_px)
    return Finding(
        Refusal.UNCERTAINTY_TOO_LARGE,
        f"The contour is sure within {traced.uncertainty_px:.1f} px only, {cells:.2g} cells, {_SURE_WITHIN_PITCHES:g} "
        "are allowed: walls end far away from it. Look at the overlay; check light and table, and that no straight "
        "light lines or cables lie in view.",
    )


def _sure_of_material(traced: Trace, uncertainty_px: float, pitch_px: float) -> bool:
    """Whether the edge of material, which is seen without its cells, is sure to a share of the block, and not torn."""
    gross_px = _SURE_WITHIN_SHARE * area(traced.contour) ** 0.5
    return traced.closed and uncertainty_px <= gross_px and not torn(traced.contour, pitch_px)


def _vague_ring(traced: Trace, pitch_px: float) -> Finding | None:
    """The ring of which the largest share is hardly known."""
    vague: list[tuple[float, int, float]] = []
    for number, ring in enumerate(traced.contour.rings):
        parts = [one for one in traced.evidence or () if one.ring == number and one.state == "seen"]
        unsure = [one for one in parts if one.bound_px > _UNSURE_PITCHES * pitch_px]
        share = sum(one.length_px for one in unsure) / perimeter(ring)
        if share > _UNSURE_SHARE:
            longest = max(unsure, key=lambda one: one.length_px)
            vague.append((share, number, 0.5 * (longest.from_px + longest.to_px)))
    if not vague:
        return None
    share, number, middle = max(vague)
    x, y = RingLengths.of(traced.contour.rings[number]).at(np.array([middle]))[0]
    return Finding(
        Refusal.UNCERTAINTY_TOO_LARGE,
        f"Of {edge_of(number)} {100 * share:.0f} %, the longest part near ({x:.0f}, {y:.0f}) px, is no surer than half "
        "a cell: few walls end on it. Look at the overlay; check light and focus, and take away what lies against the "
        "block.",
        (around(float(x), float(y), SHOWN_PITCHES * pitch_px),),
    )
