"""What hangs on a block between two corners that turn in: there another piece of core may begin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import rolled
from contour.geometry.rings import Ring, signed_area
from contour.image.opencv import fewer_vertices

# Of outlines without what is smaller than this, pitches, corners turn in by so much.
_EVEN, _TURN = 0.3, np.radians(25.0)


@dataclass(frozen=True, eq=False)
class Hanging:
    """The ring from one inner corner to the next, (N, 2), pixels; all corners between them turn out, or hardly in."""

    part: Ring

    @property
    def width_px(self) -> float:
        """How far both are apart."""
        return float(np.hypot(*(self.part[-1] - self.part[0])))

    @property
    def depth_px(self) -> float:
        """How far the part reaches from the line between both."""
        across, off = self.part[-1] - self.part[0], self.part - self.part[0]
        return float(np.abs(off[:, 0] * across[1] - off[:, 1] * across[0]).max()) / max(self.width_px, 1e-9)


def hanging(exterior: Ring, pitch_px: float) -> Iterator[Hanging]:
    """All such parts of a block, smaller than the rest of it, by its exterior in pixels."""
    corners = fewer_vertices(exterior, _EVEN * pitch_px)
    edges = rolled(corners, -1) - corners
    heading = edges[:, 0] + 1j * edges[:, 1]
    whole = signed_area(corners)
    inner = np.flatnonzero(np.sign(whole) * np.angle(heading / rolled(heading, 1)) < -_TURN)
    for one, following in zip(inner.tolist(), rolled(inner, -1).tolist(), strict=True):
        if one != following:
            part = rolled(corners, -one)[: (following - one) % len(corners) + 1]
            # Where the line between both leads over the table it is a bay.
            if 0.0 < signed_area(part) / whole < 0.5:
                yield Hanging(part)
