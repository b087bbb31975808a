"""What lies on, beside and under a block on a shop floor: lengths in millimetres, places in the work frame.

Areas are given at the height of the block's top plane. Levels are shares of full scale under light 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from contour.geometry.rings import Contour
from contour.synthetic.cells import CellGeometry

Colour = tuple[float, float, float]
"""Blue, green, red factors; their mean is about 1."""

GREY: Colour = (1.0, 1.0, 1.0)

Point = tuple[float, float]


@dataclass(frozen=True)
class Cover:
    """Something opaque over block and table: tape, a label, a clamp, a cable, a hand."""

    area: Contour
    level: float
    colour: Colour = GREY
    texture: float = 0.02
    """Relative spread of its coarse texture."""
    rounding_mm: float = 0.0
    """Its flanks turn away from the light within this distance from its rim; 0 = flat."""
    streaks: float = 0.0
    """Relative spread of fine lines along `streaks_deg`, as on rolled metal."""
    streaks_deg: float = 0.0
    shadow: float = 0.0
    """Light that its shadow takes away."""
    shadow_mm: Point = (0.0, 0.0)
    """Where its shadow falls, from itself."""


@dataclass(frozen=True)
class Filling:
    """Compound or adhesive that fills cells of the block up to the cut: those whose centres lie in the area."""

    area: Contour
    level: float
    colour: Colour = GREY
    walls: float = 1.0
    """How much of the wall tops still shows through."""
    share: float = 1.0
    """Share of the cells in the area that are filled."""


@dataclass(frozen=True)
class Ink:
    """Felt-pen strokes on wall tops, and on the table where they go on there."""

    strokes: tuple[Contour, ...]
    level: float
    colour: Colour = GREY
    strength: float = 0.85
    on_table: bool = False


@dataclass(frozen=True)
class Mirror:
    """A polished table that shows the block's walls once more, beyond its edge."""

    strength: float = 0.3
    reach_mm: float = 20.0
    """The mirrored walls fade to a third within this distance."""
    blur_px: float = 1.0


@dataclass(frozen=True)
class Strip:
    """A strip of core that was cut off and lies beside the block, as high as it."""

    outline: Contour
    cells: CellGeometry


@dataclass(frozen=True)
class Crush:
    """Cells pressed together at the edge; what is left of them stays inside the outline."""

    at: Point
    """The middle of it, on the outline."""
    inward: Point
    """Unit vector into the block there."""
    length_mm: float
    """Along the edge."""
    depth_mm: float
    press_mm: float
    """How far the cells at the edge were moved inwards."""
    bend_mm: float = 0.0
    """How far they were moved along the edge, to and fro."""


@dataclass(frozen=True)
class Slip:
    """Two pieces of core in one block: the cells left of a line were moved along it, against the others."""

    at: Point
    along: Point
    """Unit vector."""
    shift_mm: float


@dataclass(frozen=True)
class Flare:
    """A bright spot or streak of light that is added to all that is seen there."""

    at: Point
    level: float
    size_mm: Point
    """Sigmas along and across."""
    angle_deg: float = 0.0
    on_block: float = 1.0
    """Share of it that the block returns, too."""


@dataclass(frozen=True)
class Shade:
    """A shadow: light 1 becomes 1 − depth within the area."""

    area: Contour
    depth: float
    soft_mm: float
    on_block: bool = False
    """Whether it falls on the block as well as on the table."""


@dataclass(frozen=True)
class Fade:
    """Walls seen from straight above return less light: 1 − depth in the middle of the place."""

    at: Point
    depth: float
    size_mm: float
    """Sigma."""


@dataclass(frozen=True)
class Structure:
    """A table that is not even: its light is multiplied by a pattern of mean about 1."""

    kind: Literal["wood", "brushed", "slots", "old-cuts", "expanded", "ribbed", "cork"]
    scale_mm: float
    """Width of a plank, of broad bands of a brushed sheet, spacing of slots, old cuts, a mesh, ribs, size of grains."""
    contrast: float = 0.2
    angle_deg: float = 0.0


Thing = Cover | Filling | Ink | Mirror | Strip | Crush | Slip | Flare | Shade | Fade | Structure
