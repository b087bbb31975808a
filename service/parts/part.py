"""A part that is to be cut from a block, and the terms by which its file is read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour

CHORD_MM = 0.005
"""How far a chord may lie from its curve. The part keeps that much more from the block's edge."""

JOIN_MM = 0.01
"""Ends of lines and arcs that are no farther apart are one point; drawing programs round them."""

LARGEST_FILE = 8_000_000
MOST_ENTITIES = 20_000
MOST_VERTICES = 20_000
"""Outlines of parts have a few hundred; a file of these sizes takes some seconds and 200 MB."""

UNITS_MM = {"um": 0.001, "mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
"""Units that a part may be drawn in, mm each."""


class PartFileError(Exception):
    """A part's file cannot be used: the file, what was seen and where, expected, next step."""


@dataclass(frozen=True)
class Part:
    """A part as drawn: its outline in millimetres of the drawing's own axes (x right, y up)."""

    path: Path
    contour: Contour
    unit: str


@dataclass(frozen=True)
class Stroke:
    """A line or curve of a drawing as points (N, 2), in its unit; closed: the last is joined to the first.

    name: what it is and where in the file it stands, for messages.
    """

    points: Float64s
    closed: bool
    name: str


@dataclass(frozen=True)
class Drawing:
    """The strokes of a file, and the unit that they are drawn in."""

    strokes: tuple[Stroke, ...]
    unit: str


@dataclass(frozen=True)
class Asked:
    """How a file is to be read: the unit where it says none, and the layer that the part is on; "" = not told."""

    unit: str = ""
    layer: str = ""

    def settled(self, stated: str) -> str:
        """The unit of a file that states one, or none (""); raise PartFileError where both or neither say it."""
        if stated and self.unit and stated != self.unit:
            raise PartFileError(f"says that it is drawn in {stated}, part.units says {self.unit}. Correct one of them")
        if not (stated or self.unit):
            raise PartFileError(
                "does not say its unit, and none is guessed. Set part.units (--part-units): mm, cm, m, um or in"
            )
        return stated or self.unit


def chord_in(unit: str) -> float:
    """`CHORD_MM` in a unit."""
    return CHORD_MM / UNITS_MM[unit]
