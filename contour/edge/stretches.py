"""What the parts of an outline rest on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from contour.geometry.arrays import Bools, Float64s

State = Literal["seen", "bridged", "covered"]
Hider = Literal["object", "compound", "ink", "glare"]


@dataclass(frozen=True)
class Stretch:
    """A part of a contour's ring and what it rests on; lengths from the ring's first vertex on, in its order, pixels.

    `seen`: wall ends or cut material against the table. `bridged`: hidden, but both sides lie on one line or arc and
    agree. `covered`: hidden, and not to be bridged. `by` is what hides it, as far as known.
    """

    ring: int
    """0 the exterior; holes follow."""
    from_px: float
    to_px: float
    state: State
    by: Hider | None
    bound_px: float
    """95 % bound on the position of this stretch, pixels."""
    straight: bool = True
    """Bridged along a line; False: along an arc or a curve."""

    @property
    def hidden_or_filled(self) -> bool:
        """Whether it is known what lies there, or that something does."""
        return self.state != "seen" or self.by is not None

    def reduced(self, times: int) -> Stretch:
        """The same of a picture that this one's shows so many times as large."""
        lengths = self.from_px / times, self.to_px / times
        return replace(self, from_px=lengths[0], to_px=lengths[1], bound_px=self.bound_px / times)

    @property
    def length_px(self) -> float:
        """How long it is, pixels."""
        return self.to_px - self.from_px


def bound_with_bridges(bound_px: float | None, stretches: Iterable[Stretch]) -> float | None:
    """A whole outline's 95 % bound, pixels, no less than that of any bridged stretch; None where nobody knows it."""
    if bound_px is None:
        return None
    return max(bound_px, *(stretch.bound_px for stretch in stretches if stretch.state == "bridged"), 0.0)


def hidden_or_filled(evidence: Sequence[Stretch], ring: int, at: Float64s, beside_px: float) -> Bools:
    """Which lengths along a ring, (N,), lie where its edge is hidden or filled, or so near to that, shape (N,)."""
    told = [one for one in evidence if one.ring == ring and one.hidden_or_filled]
    within = [(at > one.from_px - beside_px) & (at < one.to_px + beside_px) for one in told]
    return np.asarray(np.any(within, axis=0) if within else np.zeros(at.shape, np.bool_))
