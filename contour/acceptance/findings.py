"""Why a contour is refused, by the protocol's codes, and the limits it is held against."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np

from contour.acceptance.quality import QualityLimits
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.geometry.arrays import Bools, Float64s
from contour.geometry.rings import Ring

SHOWN_PITCHES = 2.0
"""How large a circle shows a place, cell pitches."""


class Refusal(IntEnum):
    """Why a contour is refused; names and codes are the protocol's reject reasons."""

    IMAGE_QUALITY = 102
    SCENE_MOVED = 103
    NO_BLOCK_FOUND = 110
    TOUCHES_BORDER = 111
    AREA_OUT_OF_LIMITS = 112
    METHODS_DISAGREE = 113
    UNCERTAINTY_TOO_LARGE = 114
    OUTSIDE_WORK_AREA = 115
    SEVERAL_BLOCKS = 116
    EDGE_COVERED = 117
    TOO_MANY_POINTS = 130
    SELF_INTERSECTING = 131

    @property
    def reason(self) -> str:
        """The protocol's name, such as "no_block_found"."""
        return self.name.lower()


@dataclass(frozen=True)
class Limits:
    """What a contour must keep to. Limits in millimetres do not apply without a calibration.

    `work_area_mm` is a polygon in the machine frame, `sure` states the part of the picture that the calibration covers;
    None = not checked, as are `max_uncertainty_mm` and `max_disagreement_pitches`.
    `pieces` one: no other block may be in view; largest: a smaller one may. `block_share` of the traced block's area
    makes another piece of comb a block, below that it is an offcut. `max_bridged_mm` is how long a hidden part of the
    edge may be that is bridged: of straight edges alone, or of arcs and curves, too. Without a calibration none is.
    """

    min_area_mm2: float = 0.0
    max_area_mm2: float = float("inf")
    max_holes: int = 1000
    max_vertices: int = 4000
    border_px: float = 2.0
    work_area_mm: Ring | None = None
    sure: PositionUncertainty | None = None
    max_uncertainty_mm: float | None = None
    max_disagreement_pitches: float | None = None
    pieces: Literal["one", "largest"] = "one"
    block_share: float = 0.04
    max_bridged_mm: float = 0.0
    bridge: Literal["straight", "arcs"] = "straight"
    quality: QualityLimits = field(default_factory=QualityLimits)


@dataclass(frozen=True)
class Finding:
    """One reason to refuse, and a sentence with what was seen, what is expected and what to do.

    `shown_px`: paths in the picture, shape (N, 2), that show where, to be drawn; a ring repeats its first point.
    """

    refusal: Refusal
    text: str
    shown_px: tuple[Float64s, ...] = field(default=(), compare=False)


def edge_of(ring: int) -> str:
    """What a sentence calls the edge of a contour's ring, 0 the exterior."""
    return f"the edge of hole {ring}" if ring else "the block's edge"


def around(x: float, y: float, radius_px: float) -> Float64s:
    """A circle as a path, to show a place by."""
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    return np.array([x, y]) + radius_px * np.column_stack([np.cos(angles), np.sin(angles)])


def closed(ring: Ring) -> Float64s:
    """A ring as a path."""
    return np.vstack([ring, ring[:1]])


def runs_where(ring: Ring, chosen: Bools) -> tuple[Float64s, ...]:
    """The ring's paths through vertices of `chosen` (N,), each with the vertex before and the one after."""
    if chosen.all():
        return (closed(ring),)
    first = int(np.argmin(chosen))  # begins with one that is not
    turned, flags = np.roll(ring, -first, axis=0), np.roll(chosen, -first)
    edges = np.flatnonzero(np.diff(np.r_[flags, False].astype(int)))
    path = np.vstack([turned, turned[:1]])
    return tuple(path[start : end + 2] for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
