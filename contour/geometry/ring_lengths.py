"""Places on a closed ring, told by their length along it from the first vertex on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Float64s, Indices, rolled
from contour.geometry.rings import Ring

_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class RingLengths:
    """A ring's vertices and edges, shape (N, 2) both, the length at which each edge begins, (N,), and the ring's own.

    All in the ring's unit.
    """

    ring: Ring
    edges: Float64s
    starts: Float64s
    length: float

    @classmethod
    def of(cls, ring: Ring) -> RingLengths:
        """The lengths along a ring."""
        edges = rolled(ring, -1) - ring
        ends = np.cumsum(np.hypot(*edges.T))
        return cls(ring, edges, np.concatenate([[0.0], ends[:-1]]), float(ends[-1]))

    def places(self, lengths: Float64s) -> tuple[Indices, Float64s]:
        """The edge on which each length from 0 to the ring's ends, and the share of the edge up to there, (M,) both."""
        edge = np.clip(np.searchsorted(self.starts, lengths, side="right") - 1, 0, len(self.ring) - 1)
        share = (lengths - self.starts[edge]) / self._edge_lengths(edge)
        return edge, np.clip(share, 0.0, 1.0)

    def at(self, lengths: Float64s) -> Float64s:
        """The points at lengths, which go on around the ring, shape (M, 2)."""
        edge, share = self.places(np.mod(lengths, self.length))
        return np.asarray(self.ring[edge] + share[:, None] * self.edges[edge])

    def normals(self, lengths: Float64s, reach: float) -> Float64s:
        """Unit normals at lengths, of the chord over so much on either side, shape (M, 2): out of a ring with positive
        shoelace, into one with negative.
        """
        along = self.at(lengths + reach) - self.at(lengths - reach)
        along /= np.maximum(np.hypot(*along.T)[:, None], np.finfo(float).tiny)
        return np.column_stack([along[:, 1], -along[:, 0]])

    def turns(self, lengths: Float64s, reach: float) -> Float64s:
        """By how much the ring turns at lengths, from the chord over so much before each to that after it, shape (M,),
        radians, positive from x to y.
        """
        before, here, after = (self.at(lengths + step) for step in (-reach, 0.0, reach))
        one, two = (part[:, 0] + 1j * part[:, 1] for part in (here - before, after - here))
        return np.asarray(np.angle(two * one.conjugate()))

    def path(self, start: float, end: float) -> Float64s:
        """The ring from one length to a later one, no farther on than its end: both places and the vertices between."""
        between = self.ring[(self.starts > start) & (self.starts < end)]
        return np.vstack([self.at(np.array([start])), between, self.at(np.array([end]))])

    def along_edge(self, edge: Indices, points: Float64s) -> Float64s:
        """The lengths at which points, shape (M, 2), are nearest to one given edge each, (M,)."""
        long = self._edge_lengths(edge)
        along = ((points - self.ring[edge]) * self.edges[edge]).sum(axis=1) / long
        return np.asarray(self.starts[edge] + np.clip(along, 0.0, long))

    def feet(self, points: Float64s) -> Float64s:
        """The length at which the ring is nearest to each point, shape (M,)."""
        nearest = np.empty(len(points), np.intp)
        long2 = np.maximum((self.edges**2).sum(axis=1), np.finfo(float).tiny)
        for first in range(0, len(points), _AT_ONCE):
            offset = points[first : first + _AT_ONCE, None] - self.ring
            share = np.clip((offset * self.edges).sum(axis=2) / long2, 0.0, 1.0)
            apart = ((offset - share[:, :, None] * self.edges) ** 2).sum(axis=2)
            nearest[first : first + _AT_ONCE] = apart.argmin(axis=1)
        return self.along_edge(nearest, points)

    def _edge_lengths(self, edge: Indices) -> Float64s:
        return np.asarray(np.maximum(np.hypot(*self.edges[edge].T), np.finfo(float).tiny))
