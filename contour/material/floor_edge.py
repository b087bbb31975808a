"""Where the floors of cells end: a block's edge between the ends of its walls, wherever the table is of another light.

Floors lie in the shade of the walls around them, the table beside the block does not. How sharply the one passes into
the other depends on light and depth, but it does so alike along an edge: a place at which floors end as they do on both
sides of it is the edge's own, and a corner that they end well within may be a rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, with_sides
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.geometry.signed_distance import nearest
from contour.image.pixel_sampling import light_beside

# Pitches: places along the ring, and beside each how far in and out and along it light is looked at. Of what lies side
# by side a quarter is floor, whatever walls stand there.
_SPACING, _SMOOTHED = 0.25, 0.5
_OUT, _BESIDE = np.arange(-1.0, 1.01, 0.1), np.linspace(-0.3, 0.3, 5)
_FLOOR = 1
_FLOORS, _TABLE = (_OUT > -0.95) & (_OUT < -0.25), _OUT > 0.45
# So many places about one, and which of them are near to it; of the others so many must agree within so much, pitches.
_ABOUT, _NEAR = 32, slice(12, 21)
_AGREE, _ALIKE, _LEAST_LIGHT = 0.75, 0.21, 6.0
# A place of the ring, no farther from a point, is the edge's own within that, pitches: a corner that may as well be
# round, or a rounding that may be a corner, lies half a pitch off.
_AT, _OWN = 1.0, 0.3
# A corner turns by more about so many places, none of its witnesses is so near, and floors end so far within it on
# average, where the table is clearly of another light. Of some 300 right outlines none has one; both corners that were
# drawn for roundings of a pitch and a half do, and one of eleven for roundings of a pitch.
_CORNER, _ABOUT_CORNER, _UNSEEN, _WITHIN, _CLEAR_LIGHT = np.radians(30.0), 6, 0.6, -0.39, 20.0
# Or so far where it is less clearly so. Of 26 corners drawn whole for cuts and roundings of a cell or two, beside
# which light is mostly no clearer, six do, of 300 right ones none; one does in a light that differs by ten levels.
_FAR_WITHIN, _FAINT_LIGHT = -0.5, 12.0
# Floors end so far beyond a rounding about so many places, where nearly all others agree; farther, and it is no floor.
# Of 60 outlines that a network told one that was off by 0.8 of a cell at a corner has such a place, no right one.
_ABOUT_TIP, _ALL_AGREE, _BEYOND = 3, 0.95, (0.36, 0.9)


@dataclass(frozen=True, eq=False)
class FloorEdge:
    """Places along a ring, (N, 2), pixels; at which floors end as beside them, well within a corner, and well beyond a
    rounding, (N,) each.
    """

    places: Float64s
    own: Bools
    within: Bools
    beyond: Bools

    def tells(self, points: Float64s, pitch_px: float) -> Bools:
        """Which points (K, 2) at the ring are its own, shape (K,)."""
        away = np.hypot(*(self.places - points[:, None]).transpose(2, 0, 1))
        return np.asarray(self.own[away.argmin(axis=1)] & (away.min(axis=1) < _AT * pitch_px))

    def passed(self, witnesses: Float64s, pitch_px: float) -> Float64s:
        """Places about corners near none of these (K, 2), and well within which floors end, (M, 2), pixels."""
        places = self.places[self.within]
        return places[nearest(places, witnesses) > _UNSEEN * pitch_px]


def floor_edge(light: Bytes, ring: Ring, pitch_px: float, *, bright: bool) -> FloorEdge:
    """Where floors end along a ring with material on its left, pixels, in light (H, W), uint8, of a block with walls
    lighter than floors, or darker.
    """
    lengths = RingLengths.of(ring)
    at = np.arange(0.0, lengths.length, _SPACING * pitch_px)
    places, normal = lengths.at(at), lengths.normals(at, _SMOOTHED * pitch_px)
    ends, step = _ends(light, places, normal, pitch_px, bright=bright)
    about = with_sides(ends, _ABOUT)
    beside = np.delete(about, _NEAR, axis=1)
    usual = np.median(beside, axis=1)
    share = np.mean(np.abs(beside - usual[:, None]) < _ALIKE, axis=1)
    agree = share >= _AGREE
    own = agree & (np.abs(about[:, _NEAR] - usual[:, None]).max(axis=1) < _OWN) & (np.abs(usual) < _OWN)
    heading = with_sides(normal[:, 0] + 1j * normal[:, 1], _ABOUT_CORNER)
    corner = np.abs(np.angle(heading[:, 0] * heading[:, -1].conj())) > _CORNER
    off = with_sides(ends, _ABOUT_CORNER).mean(axis=1) - usual
    clearly = (off < _WITHIN) & (np.abs(step) > _CLEAR_LIGHT)
    faintly = (off < _FAR_WITHIN) & (np.abs(step) > _FAINT_LIGHT)
    within = agree & corner & (clearly | faintly)
    tip = with_sides(ends, _ABOUT_TIP).mean(axis=1) - usual
    beyond = corner & (share >= _ALL_AGREE) & (tip > _BEYOND[0]) & (tip < _BEYOND[1])
    return FloorEdge(places, own, within, beyond)


def _ends(
    light: Bytes, places: Float64s, normal: Float64s, pitch_px: float, *, bright: bool
) -> tuple[Float64s, Float64s]:
    """How far out of places (N, 2) with outward normals (N, 2) floors end, pitches, nan where the table is as light,
    and by how much it is lighter, (N,) each.
    """
    along = pitch_px * np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    beside = (places + aside * along for aside in _BESIDE)
    seen = np.stack([light_beside(light, one, pitch_px * normal, _OUT) for one in beside])
    profile = np.sort(seen if bright else -seen, axis=0)[_FLOOR]
    floor, table = (
        np.median(with_sides(np.median(profile[part], axis=0), _ABOUT), axis=1) for part in (_FLOORS, _TABLE)
    )
    step = np.where(np.abs(table - floor) < _LEAST_LIGHT, np.nan, table - floor)
    # From the table inwards, the first light that is nearer to that of floors.
    like_floor = (profile - floor) / step < 0.5
    ends = np.where(like_floor.any(axis=0), _OUT[::-1][like_floor[::-1].argmax(axis=0)], _OUT[0])
    return np.where(np.isnan(step), np.nan, ends), step
