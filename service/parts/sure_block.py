"""The block as far as a part may count on it: without what its edge may be off by beyond the contour's bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.arrays import Float64s
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, contour_defect, oriented_contour
from contour.placement.place import Placement, placement_at
from service.parts.part import PartFileError

if TYPE_CHECKING:
    import shapely

EVERYWHERE = 2.0
"""Times the 95 % bound, which 5 % of an outline exceeds, and 5 % of outlines: one place can spoil a part."""

_LEAST_MM = 0.01
_SHARPEST = 4.0
"""Times its edges' bound that a corner may be off by; only slits are sharper."""

_APART_MM = 0.001
"""Rings that touch are joined over as much."""


@dataclass(frozen=True)
class SureBlock:
    """A block's outlines as measured, mm, and as far as its true edge keeps `bound_mm` from them: `sure`.

    Stretches that are less sure than that lose the difference. A corner that points into the material is where two
    edges meet that may both be off by their bound b: it lies up to b over the sine of half the angle between them from
    where it was traced.
    """

    measured: Contour
    sure: Contour
    bound_mm: float

    @classmethod
    def of(cls, block: Contour, uncertainty_mm: float, evidence: Sequence[SentStretch] = ()) -> SureBlock | None:
        """The block with its 95 % bound and that of its stretches; None where nothing of it is sure.

        Raises PartFileError where what it needs is not installed.
        """
        bound_mm = EVERYWHERE * uncertainty_mm
        sure = _sure(block, bound_mm, evidence)
        return None if sure is None else cls(block, sure, bound_mm)

    def bound_at(self, part: Contour, placement: Placement) -> float:
        """By how much the true edge may lie nearer to a part laid in the measured block than its margin says."""
        if self.sure is self.measured:
            return self.bound_mm
        return self.bound_mm + max(placement.margin - placement_at(part, self.sure, placement.pose).margin, 0.0)


def _sure(block: Contour, bound_mm: float, evidence: Sequence[SentStretch]) -> Contour | None:
    try:
        import shapely

        from service.parts.shapely_contours import polygon_of
    except ImportError as error:
        raise PartFileError("parts need shapely. Install: pip install 'combtrace[export]'") from error
    known = [(one, one.bound_mm or 0.0) for one in evidence]
    lost: list[shapely.Geometry] = []
    rings = oriented_contour(block, counter_clockwise=True).rings
    for number, (ring, sent) in enumerate(zip(rings, block.rings, strict=True)):
        lengths = RingLengths.of(sent)
        bound = np.full(len(ring), bound_mm)
        for one, own_mm in known:
            if one.ring == number and own_mm > bound_mm + _LEAST_MM:
                path = lengths.path(one.from_mm or 0.0, min(one.to_mm or 0.0, lengths.length))
                band = shapely.LineString(path).buffer(own_mm - bound_mm, cap_style="square", join_style="mitre")
                bound[shapely.intersects_xy(band, ring[:, 0], ring[:, 1])] = own_mm
                lost.append(band)
        factors = _corner_factors(ring)
        sharp = bound * (factors - 1.0) > _LEAST_MM
        for place, off in zip(ring[sharp], (bound * factors - bound_mm)[sharp], strict=True):
            lost.append(shapely.Point(place).buffer(off / np.cos(np.pi / 8), quad_segs=2))
    if not lost:
        return block
    left = polygon_of(block).difference(shapely.unary_union(lost))
    sure = _largest(left)
    if sure is not None and contour_defect(sure) is not None:
        sure = _largest(left.buffer(-_APART_MM, join_style="mitre"))
    return sure


def _largest(left: shapely.Geometry) -> Contour | None:
    """The largest piece of what is left; None of nothing."""
    import shapely

    from service.parts.shapely_contours import contour_of

    pieces = [piece for piece in shapely.get_parts(left) if piece.area > 0]
    return contour_of(max(pieces, key=lambda piece: piece.area)) if pieces else None


def _corner_factors(ring: Ring) -> Float64s:
    """How many times as far as its edges each corner may be off that points into the material, else 1, shape (N,)."""
    way = np.roll(ring, -1, axis=0) - ring
    heading = np.arctan2(way[:, 1], way[:, 0])
    turn = np.remainder(heading - np.roll(heading, 1) + np.pi, 2 * np.pi) - np.pi
    # To its left the ring has material: a turn to the right leaves (pi - turn) of void.
    return np.asarray(np.where(turn < 0, np.minimum(1.0 / np.maximum(np.cos(turn / 2), 1e-9), _SHARPEST), 1.0))
