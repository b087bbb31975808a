"""Where along an outline the table is as light as the block's walls, so that it does not show where these end; and
whether it is as light as the floors of its cells, which show it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contour.edge.edge_parts import EdgePart, longest_part
from contour.geometry.arrays import Bools, Bytes, Float64s, median, quantiles, with_sides
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, signed_area
from contour.image.pixel_sampling import light_beside, planes_of

# Cell pitches: along the outline, out of it, and into the block.
_SPACING = 0.25
_OUT = np.array([0.4, 0.6, 0.8, 1.0])
_IN = np.array([0.6, 1.0, 1.4, 1.8])
# Over how much of the edge the table's light is taken together, and that of cells and walls besides the whole: a shadow
# makes a table as dark as dark walls elsewhere, and here and there walls are faint.
_TABLE_OVER, _BLOCK_OVER = 2.0, 6.0
# Of what is inside: cells, and walls.
_CELLS, _WALLS = 0.1, 0.97
# What table and walls differ by, of what walls and cells do.
_ALIKE = 0.3
# And table and floors, which lie in the walls' shade: 0.52 at most on 13 lattices of wide webs, 1.0 of ink on a sheet.
_SHOWN = 0.75


def alike_edge(picture: Bytes, contour: Contour, pitch_px: float, *, dark: bool) -> EdgePart | None:
    """Where table and walls are alike, in all channels of a picture, grey (H, W) or BGR (H, W, 3), uint8; None where
    they are nowhere.

    The contour's holes run the other way around than its exterior. `dark`: walls are darker than their cells. A shadow
    beside the block parts the two as well as a table does.
    """
    planes = planes_of(picture)
    side = float(np.sign(signed_area(contour.exterior)))
    found = [one for ring in contour.rings for one in [_longest(planes, ring, side * pitch_px, dark=dark)] if one]
    return max(found, key=lambda one: one.length_pitches) if found else None


def shows_table(light: Bytes, contour: Contour, pitch_px: float, *, dark: bool) -> bool:
    """Whether floors of cells along a contour's exterior are as light as the table beyond, (H, W), uint8. `dark`: walls
    are darker than their cells.
    """
    lengths = RingLengths.of(contour.exterior)
    out_px = float(np.sign(signed_area(contour.exterior))) * pitch_px
    at = np.arange(0.0, lengths.length, _SPACING * pitch_px)
    beyond, within = _sampled(light, lengths, at, out_px)
    floors, walls = quantiles(within.ravel(), _tails(dark=dark))
    return bool(abs(median(beyond) - floors) < _SHOWN * abs(walls - floors))


def _longest(planes: list[Bytes], ring: Ring, out_px: float, *, dark: bool) -> EdgePart | None:
    """On one ring; `out_px`: the cell pitch, negative where its material lies to the right of its direction."""
    lengths = RingLengths.of(ring)
    at = np.arange(0.0, lengths.length, _SPACING * abs(out_px))
    alike = _alike(planes, lengths, at, out_px, dark=dark)
    return longest_part(alike, lengths, at, _SPACING)


def _alike(planes: list[Bytes], lengths: RingLengths, at: Float64s, out_px: float, *, dark: bool) -> Bools:
    """At which lengths along a ring what lies beyond is nowhere told from the walls, shape (N,)."""
    tails = _tails(dark=dark)
    sampled = [_sampled(plane, lengths, at, out_px) for plane in planes]
    by_all = _like_walls(sampled, lambda within: quantiles(within.ravel(), tails)[:, None])
    if not by_all.any():
        return by_all

    def nearby(within: Float64s) -> Float64s:
        beside = with_sides(within, _BLOCK_OVER / _SPACING).transpose(0, 2, 1)
        return quantiles(beside.reshape(-1, within.shape[1]), tails)

    return by_all & _like_walls(sampled, nearby)


def _sampled(light: Bytes, lengths: RingLengths, at: Float64s, out_px: float) -> tuple[Float64s, Float64s]:
    """Light beyond and within a ring, at lengths along it, (K, N) each."""
    place, outward = lengths.at(at), out_px * lengths.normals(at, _SPACING * abs(out_px))
    return light_beside(light, place, outward, _OUT), light_beside(light, place, outward, -_IN)


def _tails(*, dark: bool) -> tuple[float, float]:
    """Which quantiles of light within are those of cells, and of walls."""
    return (1.0 - _CELLS, 1.0 - _WALLS) if dark else (_CELLS, _WALLS)


def _like_walls(sampled: list[tuple[Float64s, Float64s]], levels: Callable[[Float64s], Float64s]) -> Bools:
    """Where what lies beyond an edge is somewhere as light as walls, shape (N,), by light sampled beyond it and within
    the block, (K, N) each in each channel; `levels` tells from the latter that of cells and of walls, (2, N) or (2, 1).
    """
    apart, contrast = np.zeros_like(sampled[0][0]), np.ones(1)
    for beyond, within in sampled:
        cells, walls = levels(within)
        contrast = np.maximum(contrast, np.abs(walls - cells))
        apart = np.maximum(apart, np.abs(walls - with_sides(beyond, _TABLE_OVER / _SPACING).mean(axis=2)))
    return np.asarray(apart.min(axis=0) < _ALIKE * contrast)
