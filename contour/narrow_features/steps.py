"""Low steps near a corner, as a strip of cells makes that lies against an edge; jogs; and horns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.geometry.arrays import Float64s, rolled
from contour.geometry.rings import Ring
from contour.image.opencv import fewer_vertices
from contour.narrow_features.feature import DEPTH, NarrowFeature

# In cell pitches.
# A step: of outlines without what is smaller than this it turns in and out by so much, or the other way around, and
# goes on as before but for that; so low, and a corner comes so soon behind it.
_EVEN, _TURN_DEG, _TURNED_DEG, _STEP_HIGH, _STEP_LONG = 0.3, 45.0, 35.0, (0.75, 4.5), 10.0
# Where it has turned in by more before it turns out, there is a notch before it.
_NOTCH_RAD = float(np.radians(135.0))
# A jog: an edge goes on as before, but for this angle, so far aside; it has so much of it on both sides, and what lies
# between turns away and back by so much. Of 260 right outlines none has one, of wrong ones one along inked cells.
_JOG_EVEN, _JOG_HIGH, _JOG_LONG, _JOG_ASIDE_DEG, _JOG_TURN_DEG = 0.12, (0.35, 0.95), 1.0, 20.0, 30.0
# A horn: a corner so sharp, its interior angle, and so near to one that turns out by so much, as a wire makes or a mark
# on the table that leads away from the block, or glare. Of outlines followed so closely that no curve has such a
# corner; of 1500 random ones and 120 cut lattices none has, only teeth of closed cells.
_HORN_DEG, _HORN_LONG, _HORN_FOOT_DEG, _HORN_EVEN = 75.0, 5.0, 40.0, 0.1


def steps(ring: Ring, pitch_px: float, large: float, *, notches: bool) -> list[NarrowFeature]:
    """Low steps out of an edge that end in a corner soon, less than `large`, squares of the pitch; `notches`: what is
    beside a notch is none.
    """
    even = fewer_vertices(ring, _EVEN * pitch_px)
    # Either way around; a contour in pixels has the block on its left as seen with y down: it turns left at corners.
    mirrored = np.stack([-even[::-1, 0], even[::-1, 1]], axis=1)
    found = _steps_along(even, pitch_px, notches=notches) + [
        replace(step, place_px=(-step.place_px[0], step.place_px[1]))
        for step in _steps_along(mirrored, pitch_px, notches=notches)
    ]
    return [step for step in found if step.depth_pitches * step.width_pitches < large]


def _edges(corners: Ring, pitch_px: float) -> tuple[Float64s, Float64s]:
    """How long the edge from each corner of a ring is, pitches, and by how much the ring turns there, radians, positive
    where it turns around the material, (N,) both.
    """
    edges = rolled(corners, -1) - corners
    heading = edges[:, 0] + 1j * edges[:, 1]
    return np.hypot(*edges.T) / pitch_px, -np.angle(heading / rolled(heading, 1))


def _steps_along(corners: Ring, pitch_px: float, *, notches: bool) -> list[NarrowFeature]:
    long, turn = _edges(corners, pitch_px)
    least, turned = np.radians([_TURN_DEG, _TURNED_DEG])
    after = rolled(turn, -1)
    high = long * np.sin(np.abs(after))
    rises = (turn < -least) & (after > least) & (np.abs(turn + after) < turned)
    rises &= (high > _STEP_HIGH[0]) & (high < _STEP_HIGH[1])
    found = []
    for foot in np.flatnonzero(rises).tolist():
        top = rolled(np.arange(len(corners)), -foot - 1)
        if notches and _turned_in(turn[top[::-1]]) > _NOTCH_RAD:
            continue
        turned_by = np.cumsum(turn[top[1:]])  # a corner may be a round one
        end = int(np.argmax(np.abs(turned_by) > least)) + 1
        # At its foot: slanting sides are as wide as they are long there.
        sides = [foot, top[end]] if long[top[end]] < _STEP_HIGH[1] else [foot]
        wide = long[top[:end]].sum() + (long[sides] * np.cos(turn[[top[0], top[end]]][: len(sides)])).sum()
        if turned_by[end - 1] > least and wide < _STEP_LONG:
            x, y = corners[top[0]].tolist()
            found.append(NarrowFeature(float(high[foot]), float(wide), (x, y), True))
    return found


def _turned_in(turn: Float64s) -> float:
    """By how much a ring that turns so, backwards from a corner, turns in until it last turned out, radians."""
    return -float(turn[: int(np.argmax(turn > 0.0))].sum())


def jogs(ring: Ring, pitch_px: float) -> list[NarrowFeature]:
    """Where an edge goes on less than a cell aside."""
    corners = fewer_vertices(ring, _JOG_EVEN * pitch_px)
    long, turn = _edges(corners, pitch_px)
    after = rolled(turn, -1)
    least, turned = np.radians([_JOG_TURN_DEG, _JOG_ASIDE_DEG])
    beside = np.minimum(rolled(long, 1), rolled(long, -1))
    aside = long * np.abs(np.sin(0.5 * (turn - after)))
    chosen = (np.minimum(np.abs(turn), np.abs(after)) > least) & (turn * after < 0.0)
    chosen &= (np.abs(turn + after) < turned) & (beside > _JOG_LONG)
    chosen &= (aside > _JOG_HIGH[0]) & (aside < _JOG_HIGH[1])
    found = []
    for foot in np.flatnonzero(chosen).tolist():
        x, y = corners[foot].tolist()
        found.append(NarrowFeature(float(aside[foot]), float(beside[foot]), (x, y), bool(turn[foot] < 0.0)))
    return found


def horns(ring: Ring, pitch_px: float) -> list[NarrowFeature]:
    """Sharp corners that stand out of the outline beside them."""
    corners = fewer_vertices(ring, _HORN_EVEN * pitch_px)
    long, turn = _edges(corners, pitch_px)
    turn_deg = np.degrees(turn)
    found = []
    for tip in np.flatnonzero(turn_deg > 180.0 - _HORN_DEG).tolist():
        sides = ((long[tip - 1], turn_deg[tip - 1]), (long[tip], turn_deg[(tip + 1) % len(corners)]))
        feet = [side for side, foot_deg in sides if side < _HORN_LONG and foot_deg < -_HORN_FOOT_DEG]
        if feet and min(feet) > DEPTH:
            wide = 2.0 * min(feet) * np.sin(np.radians(0.5 * (180.0 - turn_deg[tip])))
            x, y = corners[tip].tolist()
            found.append(NarrowFeature(float(min(feet)), float(wide), (x, y), True))
    return found
