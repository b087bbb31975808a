"""Parts of an outline that have no cells behind them, or some beyond them: there it runs over the table, over a label
or along a cable, or leaves out comb whose walls are faint.

Just within a cut edge light changes from cell to cell as it does farther in. Where it does not, and what lies on both
sides of the outline is alike, the outline has left the block. Where the two differ something ends there: filled cells,
cut with those on both sides and in line with them, or a thing. Just beyond the edge light is as even as the table is.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.edge.edge_parts import EdgePart, changes, longest_part
from contour.edge.ring_places import runs_of
from contour.edge.stretches import hidden_or_filled
from contour.geometry.arrays import Bools, Bytes, Float64s, median, with_sides
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import signed_area
from contour.image.pixel_grid import averaged, samples_of
from contour.image.pixel_sampling import light_beside
from contour.tracing.trace import Trace

# Cell pitches: along the outline, and out of it.
_SPACING = 0.1
_WITHIN = np.array([-0.35, -0.55, -0.75])
_FARTHER_IN, _BEYOND, _FARTHER_OUT = np.array([-1.5, -2.0]), np.array([0.4, 0.6, 0.8]), np.array([1.6, 2.0, 2.4])
# No line through comb goes so far without a wall; what is finer is noise. Over how much of the edge the comb farther in
# is taken together, and how near to what hides or fills it nothing is said.
_CELL, _FINE, _COMB_OVER, _COMB_LEAST, _BESIDE = 1.3, 0.12, 6.0, 0.3, 1.0
# Light without what is finer has so many samples over that.
_SAMPLES = 3
# In a shadow walls and cells are darker alike: light changes by that share of its brightest as it does in comb without
# one (0.86 and more along shaded edges, 0.42 and less on compound and labels), and by so many times what it does on the
# table beside (7.7 and more), or grey levels: what is darker tells nothing.
_SHADED, _SHADED_OVER_TABLE = 0.75, 5.0
# What lies within is lighter than the table beyond by so many grey levels, and so many times what that changes by: no
# table, be it shaded or not.
_LEAST_LIGHTER = 6.0
# Nothing is looked at so far out, nor what blurs into it.
_AROUND = 2.6
# Of the changes of light farther in: those where no cells are, and what both sides of the outline differ by where they
# are alike; and over how much of it, pitches. The more bare and alike, the shorter: a corner drawn past the block's own
# is no longer than that.
_BARE = ((0.25, 0.2, 0.75), (0.45, 0.3, 1.25), (0.45, np.inf, 2.5))
# Comb goes on beyond an edge where light changes there by so much of what it does in comb, and so many times what it
# does on the table about; over more cells than specks, swarf and mirrored walls take: of 860 right outlines one has
# 3.4, the others up to 2.5. Walls are narrower than so much; light changes at wide shadows, too.
_FAINT, _OVER_TABLE, _TABLE_OVER, _GOES_ON, _NARROW = 0.2, 3.0, 4.0, 4.0, 0.5
# Lines on which the edge goes on on both sides run through so much of it.
_FLANK = (0.2, 3.0)
# Filled cells stand so little out of these lines, up to the corner where they meet, or, on a curve, lie so little
# within; most of them.
_FLUSH, _SUNK, _MOSTLY = 0.18, 0.5, 0.8
# Where the corner comes first, its last cell belongs to the edge beyond it.
_LAST_CELL = 1.0


def comb_at_edge(traced: Trace, pitch_px: float) -> tuple[EdgePart | None, EdgePart | None]:
    """The longest part of a traced outline without cells behind it, and the longest of its exterior with comb beyond
    it; None where none is long.

    What the trace's evidence tells as hidden or filled is left out.
    """
    light, first, step = _about(traced, pitch_px)
    narrow = _narrow(light, pitch_px / step, dark=traced.polarity == "dark")
    out_px = float(np.sign(signed_area(traced.contour.exterior))) * pitch_px
    bare: list[EdgePart] = []
    beyond: EdgePart | None = None
    for number, ring in enumerate(traced.contour.rings):
        lengths = RingLengths.of(ring)
        at = np.arange(0.0, lengths.length, _SPACING * pitch_px)
        place, outward = lengths.at(at), out_px * lengths.normals(at, 5.0 * _SPACING * pitch_px)
        sample, sample_out = samples_of(place - first, step), outward / step
        changes, apart, lighter = _beside(light, sample, sample_out)
        judged = ~hidden_or_filled(traced.evidence or (), number, at, _BESIDE * pitch_px)
        for quiet, alike, long in _BARE:
            chosen = judged & (changes < quiet) & (apart < alike)
            for run in runs_of(chosen) if chosen.any() else []:
                if np.isinf(alike) or np.mean(lighter[run]) > _MOSTLY:
                    chosen[run] = not _in_line(_out_of_line(lengths, at[run], out_px))
            part = longest_part(chosen, lengths, at, _SPACING)
            if part is not None and part.length_pitches > long:
                bare.append(part)
        if number == 0:
            goes_on = _goes_on(narrow, sample, sample_out) & ~_loose_beside(traced, place, outward)
            part = longest_part(judged & goes_on, lengths, at, _SPACING)
            beyond = part if part is not None and part.length_pitches > _GOES_ON else None
    return max(bare, key=lambda one: one.length_pitches) if bare else None, beyond


def _about(traced: Trace, pitch_px: float) -> tuple[Bytes, Float64s, int]:
    """Light about the contour without what is finer than a share of a cell, in samples of so many pixels, and the
    first one's first pixel (x, y).
    """
    fine = max(1, round(_FINE * pitch_px))
    step = max(1, fine // _SAMPLES)
    exterior, margin = traced.contour.exterior, _AROUND * pitch_px
    left, top = np.maximum(np.floor(exterior.min(axis=0) - margin), 0).astype(int).tolist()
    right, bottom = np.maximum(np.ceil(exterior.max(axis=0) + margin), 0).astype(int).tolist()
    about = traced.light[top : bottom + 1, left : right + 1]
    few, wide = averaged(about, step, cv2.BORDER_REPLICATE), max(1, round(fine / step))
    return np.asarray(cv2.blur(few, (wide, wide)), np.uint8), np.array([left, top], np.float64), step


def _narrow(light: Bytes, pitch_px: float, *, dark: bool) -> Bytes:
    """By how much narrow parts, as walls are, are lighter than what lies around them, or darker."""
    side = max(3, 2 * round(0.5 * _NARROW * pitch_px) + 1)
    way = cv2.MORPH_BLACKHAT if dark else cv2.MORPH_TOPHAT
    return np.asarray(cv2.morphologyEx(light, way, np.ones((side, side), np.uint8)), np.uint8)


def _loose_beside(traced: Trace, place: Float64s, outward: Float64s) -> Bools:
    """At which places along a ring pieces that were told from the block lie beyond it or within a cell of there."""
    if traced.look is None:
        return np.zeros(len(place), np.bool_)
    there = np.any([traced.look.loose_at(place + pitches * outward) for pitches in _BEYOND], axis=0)
    return np.asarray(with_sides(there, _CELL / _SPACING).any(axis=1))


def _out_of_line(lengths: RingLengths, at: Float64s, out_px: float) -> Float64s:
    """How far places along a part of a ring lie out of the lines through it before and behind that part, (N, 2),
    pitches.
    """
    near, far = (reach * abs(out_px) for reach in _FLANK)
    stops = np.array([at[0] - 0.5 * (near + far), at[-1] + 0.5 * (near + far)])
    outward = lengths.normals(stops, 0.5 * (far - near)) / out_px
    return np.asarray(((lengths.at(at)[:, None] - lengths.at(stops)) * outward).sum(axis=2))


def _in_line(out: Float64s) -> bool:
    """Whether a part of a ring ends where the lines before and behind it do, up to the corner where these meet."""
    near = (out < _FLUSH) & (out > -_SUNK)
    most = np.mean(near[np.arange(len(out)), out.argmax(axis=1)]) > _MOSTLY
    ends = out[[0, -1], [0, 1]]
    return bool(most and (ends < _FLUSH).all() and (ends > -_LAST_CELL).all())


def _beside(light: Bytes, place: Float64s, outward: Float64s) -> tuple[Float64s, Float64s, Bools]:
    """By how much light changes just within places along a ring, (N, 2), with vectors of a pitch outwards, and by how
    much both sides of it differ, of what it changes by farther in, and where it is lighter within than the table
    beyond, shape (N,) each.
    """
    within, beyond, farther_in, farther_out = (
        light_beside(light, place, outward, pitches) for pitches in (_WITHIN, _BEYOND, _FARTHER_IN, _FARTHER_OUT)
    )
    deeper = _changes(farther_in)
    usual = median(deeper)
    # Comb all along the outline tells how little of it may be left behind a part: under a hand there is none.
    comb = np.maximum(with_sides(deeper, _COMB_OVER / _SPACING).mean(axis=1), max(_COMB_LEAST * usual, 1.0))
    table = _of_table(farther_out)
    changes = _changes(within)
    in_shade = _SHADED * median(deeper / _brightest(farther_in)) * _brightest(within)
    changes = np.where(changes > np.maximum(in_shade, _SHADED_OVER_TABLE * table), comb, changes)
    step = within.mean(axis=0) - beyond.mean(axis=0)
    return changes / comb, np.abs(step) / comb, step > np.maximum(_LEAST_LIGHTER, _OVER_TABLE * table)


def _goes_on(narrow: Bytes, place: Float64s, outward: Float64s) -> Bools:
    """At which places along a ring light that is narrow as walls are changes beyond it as in comb, shape (N,)."""
    beyond, farther_in, farther_out = (
        light_beside(narrow, place, outward, pitches) for pitches in (_BEYOND, _FARTHER_IN, _FARTHER_OUT)
    )
    usual = median(_changes(farther_in))
    return _changes(beyond) > np.maximum(_FAINT * usual, _OVER_TABLE * _of_table(farther_out))


def _of_table(farther_out: Float64s) -> Float64s:
    """What light changes by on the table about each place, or a grey level, (N,)."""
    return np.asarray(np.maximum(with_sides(_changes(farther_out), _TABLE_OVER / _SPACING).mean(axis=1), 1.0))


def _brightest(light: Float64s) -> Float64s:
    """The brightest light over a cell about each place along lines beside a ring, (K, N), or a grey level, (N,)."""
    return np.asarray(np.maximum(with_sides(light.max(axis=0), _CELL / _SPACING).max(axis=1), 1.0))


def _changes(light: Float64s) -> Float64s:
    """The most that light along lines beside a ring, (K, N), changes by over a cell about each place, (N,)."""
    return np.asarray(changes(light, _CELL / _SPACING).max(axis=0))
