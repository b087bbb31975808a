"""What a picture says about a block's outline: witnesses along each coarse ring, the border between seeing and
fitting.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Bytes, Float64s, Indices
from contour.geometry.rings import Ring
from contour.walls.comb_likeness import Comb
from contour.walls.pieces import Piece


class WitnessKind(IntEnum):
    """How well a witness was seen, best first."""

    CLEAN = 0  # the end of a wall that sticks out: a cut wall seen whole
    BLUNT = 1  # an end that is wide, short or merged with a neighbour: less sure along its axis
    OUTERMOST = 2  # no wall end within a pitch: the outermost wall point there (a wall that lies along the cut)
    BOUND = 3  # no witness of the edge: a wall that the outline must not leave outside, however deep it lies inside


@dataclass(frozen=True, eq=False)
class EdgePoints:
    """Points along a ring's edge and the outward normals there (K, 2), arc lengths of their feet on the coarse ring
    (K,), all in pixels.
    """

    points: Float64s = field(default_factory=lambda: np.empty((0, 2)))
    position: Float64s = field(default_factory=lambda: np.empty(0))
    normal: Float64s = field(default_factory=lambda: np.empty((0, 2)))

    def take(self, index: Bools | Indices) -> EdgePoints:
        """The points at `index`."""
        return EdgePoints(self.points[index], self.position[index], self.normal[index])


@dataclass(frozen=True, eq=False)
class RingEvidence:
    """Witnesses of one ring of the outline, in order along the coarse ring, which runs with the material on its left
    in the y-down picture coordinates' own shoelace sense given by `is_hole` (exterior: positive shoelace in pixels;
    hole: negative).

    coarse: coarse ring, shape (M, 2), pixels. points: where the material ends, shape (N, 2), float64, pixels, sub-
    pixel. position: arc length of each witness's foot on the coarse ring, shape (N,), pixels, rising. normal: outward
    unit normal of the material at the foot, smoothed over about two pitches, shape (N, 2). sigma: expected standard
    deviation of the witness across the outline, shape (N,), pixels. kind: shape (N,), WitnessKind. walls: the boundary
    of all that was seen of walls near the edge, whether it witnesses the outline or not, some eight points a pitch,
    each chain's in order. beside: what may be material as well, strands of wall that hang on nothing and the edge of
    dark material, shape (M, 2), pixels, some four points a pitch.
    """

    coarse: Ring
    is_hole: bool
    points: Float64s
    position: Float64s
    normal: Float64s
    sigma: Float64s
    kind: NDArray[np.int8]
    walls: EdgePoints = field(default_factory=EdgePoints)
    beside: Float64s = field(default_factory=lambda: np.empty((0, 2)))

    def take(self, index: Bools | Indices) -> RingEvidence:
        """The evidence with its witnesses at `index` only."""
        return replace(
            self,
            points=self.points[index],
            position=self.position[index],
            normal=self.normal[index],
            sigma=self.sigma[index],
            kind=self.kind[index],
        )

    def joined_by(self, more: EdgePoints, sigma_px: float, kind: WitnessKind) -> tuple[RingEvidence, Indices]:
        """The evidence with more points among its witnesses, and which witness came to each place: of its own, the
        new ones numbered on behind them.
        """
        new = len(more.points)
        both = replace(
            self,
            points=np.concatenate([self.points, more.points]),
            position=np.concatenate([self.position, more.position]),
            normal=np.concatenate([self.normal, more.normal]),
            sigma=np.concatenate([self.sigma, np.full(new, sigma_px)]),
            kind=np.concatenate([self.kind, np.full(new, kind, np.int8)]),
        )
        order = np.argsort(both.position, kind="stable")
        return both.take(order), order


@dataclass(frozen=True)
class BlockEvidence:
    """All that was seen of one block: its rings (exterior first), cell pitch and wall width in pixels, polarity.

    leaves_picture: whether the block runs out of the picture, so that its rings follow the picture's border there.
    others: other pieces of comb beside it, in pixels. reaches_frame: whether a wall of it lies in the picture's last
    pixels. comb: what its cells look like. clipped: share of its witnesses beside which light is at full scale. loose:
    walls of small pieces that were told from it, however near they lie, uint8, 255 there, on a grid over the picture.
    mask: all other walls, on the same grid. openings: x and y of inner openings that may be holes or missing cells, and
    radii of discs that fit there, (K, 3), pixels.
    """

    rings: tuple[RingEvidence, ...]
    pitch_px: float
    wall_px: float
    polarity: str
    blur_px: float
    noise: float
    contrast: float
    clipped: float
    leaves_picture: bool = False
    others: tuple[Piece, ...] = ()
    reaches_frame: bool = False
    comb: Comb | None = None
    loose: Bytes | None = None
    mask: Bytes | None = None
    openings: Float64s = field(default_factory=lambda: np.empty((0, 3)))
