"""What is narrow about an outline."""

from __future__ import annotations

from dataclasses import dataclass, replace

# Narrower than this at its foot, farther out than that, cell pitches.
WIDTH, DEPTH = 5.0, 0.75
# A dent as wide and as deep as this may have been cut.
NOTCH = 2.5


@dataclass(frozen=True)
class NarrowFeature:
    """A bump (or dent) of the outline: how far it stands out of the line of its foot and how wide it is there, pitches;
    its middle, pixels (x, y).
    """

    depth_pitches: float
    width_pitches: float
    place_px: tuple[float, float]
    outwards: bool

    def moved(self, x: float, y: float) -> NarrowFeature:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return replace(self, place_px=(self.place_px[0] + x, self.place_px[1] + y))
