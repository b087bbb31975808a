"""What of an outline is too narrow to be the block's own."""

from __future__ import annotations

from contour.geometry.rings import Contour, Ring, area
from contour.narrow_features.arms import arms, slits
from contour.narrow_features.bumps import deepest_bump
from contour.narrow_features.feature import NOTCH, WIDTH, NarrowFeature
from contour.narrow_features.steps import horns, jogs, steps
from contour.seams.inner_corners import hanging

# Blocks of few cells have arms and steps as narrow; but chips and strips are less than this share of a block.
_LARGE = 1.0 / 7.0
# What hangs on a neck reaches so many pitches beyond it.
_LONG = 2.5


def narrow_feature(contour: Contour, pitch_px: float, *, notches: bool = False) -> NarrowFeature | None:
    """The deepest bump or dent of a contour in pixels on an edge that goes on in its own direction, or that stands out
    of a curve or a corner at both its feet; None without one. `notches`: dents that may have been cut are none.

    A corner is none, nor is the end of an arm: there the edges beside it run another way, and no foot is beside them.
    """
    bumps = (deepest_bump(ring, pitch_px, notches=notches) for ring in contour.rings)
    found = [bump for bump in bumps if bump is not None]
    large = _LARGE * area(contour) / pitch_px**2
    found += arms(contour, pitch_px, large) + slits(contour, pitch_px, NOTCH if notches else WIDTH)
    found += _necks(contour.exterior, pitch_px)
    found += [
        one
        for ring in contour.rings
        for one in (*steps(ring, pitch_px, large, notches=notches), *jogs(ring, pitch_px), *horns(ring, pitch_px))
    ]
    return max(found, key=lambda one: one.depth_pitches) if found else None


def _necks(exterior: Ring, pitch_px: float) -> list[NarrowFeature]:
    """What hangs on a block by as little as an offcut does that touches it."""
    found = []
    for one in hanging(exterior, pitch_px):
        if one.width_px < WIDTH * pitch_px and one.depth_px > _LONG * pitch_px:
            x, y = one.part.mean(axis=0).tolist()
            found.append(NarrowFeature(one.depth_px / pitch_px, one.width_px / pitch_px, (x, y), outwards=True))
    return found
