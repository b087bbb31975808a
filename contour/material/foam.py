"""Slabs of foam whose cells are closed: rough all over, sawn at right angles, and no two cells alike."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median, quantile
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.image.opencv import closed_by_disc, fewer_vertices, outer_contours, pieces_and_areas
from contour.image.pixel_sampling import sample_at
from contour.material.closed_cells import MaterialEdge, outlined, outwards
from contour.walls.coarse_rings import cyclic_mean

# Foam is nowhere flat: of 13 slabs it is so over 0.08 at most, of prints and codes over 0.67 and more.
_LITTLE, _MOST_FLAT = 0.3, 0.2
# How far behind the outline around material the slab may begin, what lies between being its shadow, in pitches; and
# over how long a part of it what is smooth there is told from what is rough.
_DEEPEST_PITCHES, _ALONG_PITCHES = 0.7, 0.5
# What changes over so many pixels along the border, of what does behind: surely smooth, smooth, and surely rough.
_CHANGE_PX, _ROUGH = 4, (0.2, 0.35, 0.5)
# Lamps cast shadows to some sides; what is smooth all around has a rim, as a print has.
_ROUGH_AT_ONCE, _ON_IT_PX = 0.35, 2.0
_TURN_PX, _DISC = 3, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
# Bubbles at the border that are as light as the table are as deep.
_DENT_PITCHES = 0.4
# Slabs are sawn at right angles, within so much of a side's direction; heaps of chips run along all.
_NEAR_PITCHES, _ALONG_IT, _MOST_SQUARE = 0.35, np.radians(10.0), 0.7


def foam_edge(light: Bytes, material: MaterialEdge, pitch_px: float) -> MaterialEdge | None:
    """The outline of a slab of foam, pixels, without its shadow; None where material is none: not rough all over, or
    not sawn at right angles.

    `light`: the picture's lightness, (H, W). A shadow is as smooth as the table it falls on, and foam is not: along the
    border of what is darker than the table, light changes where the slab begins. What lies before is taken off.
    """
    region = material.apart.region
    if _flat(light, region) > _MOST_FLAT:
        return None
    ring = cyclic_mean(_around(region), _TURN_PX)
    inwards = -outwards(ring, _TURN_PX)
    least, begins, most = _begins(light, ring, inwards, pitch_px)
    if np.count_nonzero(begins <= _ON_IT_PX) < _ROUGH_AT_ONCE * len(begins):
        return None
    slab = closed_by_disc(_taken_off(region, ring, begins, inwards), _DENT_PITCHES * pitch_px)
    if _square(_around(slab), pitch_px) < _MOST_SQUARE:
        return None
    found = outlined(material, slab)
    return replace(found, bound_px=float(np.hypot(found.bound_px, quantile(most - least, 0.95))))


def _flat(light: Bytes, region: Bytes) -> float:
    """The share of a region over which light changes little from pixel to pixel, of what it does on the mean."""
    change = cv2.morphologyEx(light, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))[region > 0]
    return float(np.mean(change < _LITTLE * change.mean()))


def _begins(light: Bytes, ring: Ring, inwards: Float64s, pitch_px: float) -> Float64s:
    """How far behind each point of a ring, (N, 2), along unit vectors `inwards`, light begins to change along the ring
    as it does far behind, pixels, 0 where it never does: at least, usually, at most, by what change counts, (3, N).
    """
    depth = np.arange(0.0, _DEEPEST_PITCHES * pitch_px, 1.0)
    places = ring[:, None, :] + depth[None, :, None] * inwards[:, None, :]
    band = sample_at(light, places[:, :, 0], places[:, :, 1])
    half = _CHANGE_PX // 2
    change = np.abs(np.roll(band, -half, axis=0) - np.roll(band, half, axis=0)).astype(np.float32)
    window = 2 * round(0.5 * _ALONG_PITCHES * pitch_px) + 1
    rough = cv2.blur(np.concatenate([change[-window:], change, change[:window]]), (1, window))[window:-window]
    usual = median(rough[::3, len(depth) // 2 :].astype(np.float64).ravel())
    slab = rough[None] > usual * np.reshape(_ROUGH, (3, 1, 1))
    return np.where(slab.any(axis=2), depth[np.argmax(slab, axis=2)], 0.0)


def _taken_off(region: Bytes, ring: Ring, begins: Float64s, inwards: Float64s) -> Bytes:
    """The region without what lies between a ring and where its slab begins."""
    shade = begins > 0
    ends = np.stack([ring - 2.0 * inwards, ring + begins[:, None] * inwards], axis=1)[shade]
    left = region.copy()
    cv2.polylines(left, list(np.rint(ends).astype(np.int32)), False, 0, 2)
    left = np.asarray(cv2.morphologyEx(left, cv2.MORPH_OPEN, _DISC), np.uint8)
    pieces, area = pieces_and_areas(left, 4)
    return np.asarray(pieces == int(np.argmax(area)), np.uint8)


def _square(ring: Ring, pitch_px: float) -> float:
    """The share of a ring that runs along one of two directions at right angles, those that most of it runs along; 0 of
    one too small to run along any.
    """
    edges = RingLengths.of(fewer_vertices(ring, _NEAR_PITCHES * pitch_px)).edges
    length = np.hypot(*edges.T)
    if not length.any():
        return 0.0
    turned = np.arctan2(edges[:, 1], edges[:, 0])
    off = np.abs(np.remainder(turned[:, None] - turned + 0.25 * np.pi, 0.5 * np.pi) - 0.25 * np.pi)
    return float(((off < _ALONG_IT) @ length).max() / length.sum())


def _around(region: Bytes) -> Ring:
    """The longest outline of a region, through pixels' centres, (N, 2)."""
    return max(outer_contours(region), key=len).astype(np.float64)
