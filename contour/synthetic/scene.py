"""Everything a rendered picture depends on, as frozen dataclasses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from contour.errors import ParameterError
from contour.geometry.rings import Contour
from contour.synthetic.camera import CameraModel
from contour.synthetic.cells import CellGeometry
from contour.synthetic.things import GREY, Colour, Thing


@dataclass(frozen=True)
class Material:
    """How much light the block returns, as shares of full scale under light 1."""

    top: float = 0.72
    """Cut faces of the walls."""
    side: float = 0.34
    """Faces of the walls inside the cells, just below the top."""
    spread: float = 0.22
    """Spread of brightness from wall to wall."""
    texture: float = 0.18
    """Spread of brightness along a wall (burrs, foil)."""
    glints: float = 0.05
    """Share of walls that flash."""
    sheen: float = 0.15
    """How much more light walls of one direction return than those across it."""
    sparks: float = 0.3
    """Strength of small bright spots along the walls."""
    skin: float = 0.5
    """Skin of closed cells."""
    colour: Colour = GREY


@dataclass(frozen=True)
class Table:
    """What lies under the block."""

    level: float = 0.12
    texture: float = 0.012
    """Spread of its coarse texture."""
    perforation_pitch_mm: float = 0.0
    """Spacing of a vacuum table's holes; 0 = none."""
    perforation_mm: float = 4.0
    """Diameter of these holes."""
    perforation_level: float = 0.03
    groove_pitch_mm: float = 0.0
    """Spacing of a vacuum table's grooves; 0 = none."""
    scratches: int = 0
    colour: Colour = GREY


@dataclass(frozen=True)
class Light:
    """Where the light comes from and how it falls off."""

    level: float = 1.0
    gradient: float = 0.0
    """Relative difference across the picture's diagonal."""
    gradient_deg: float = 30.0
    vignetting: float = 0.0
    """Share lost in the corners."""
    shadow: float = 0.15
    """Darkening of the table beside the block."""
    direction_deg: float = 120.0
    glare: float = 0.0
    """Light of a lamp mirrored broadly by the table."""
    glare_at: tuple[float, float] = (0.3, 0.2)
    """Place of the glare, shares of the picture's width and height."""
    patches: float = 0.0
    """Strength of broad bright patches (reflections of lamps) on wall tops."""


@dataclass(frozen=True)
class Clutter:
    """What lies about: dust everywhere, foil chips beside the block, other pieces of core."""

    specks: int = 0
    debris: int = 0
    debris_clearance_mm: float = 4.0
    """Chips keep this distance from the block."""
    neighbours: tuple[Contour, ...] = ()
    """Other pieces on the table, work millimetres."""


@dataclass(frozen=True)
class Sensor:
    """What the camera adds."""

    blur_px: float = 0.7
    """Sigma of the optics' blur."""
    bloom: float = 0.04
    """Share of the light above full scale that spreads around it."""
    shot_noise: float = 0.006
    """Sigma at full scale, share of full scale; falls with the root of the signal."""
    read_noise: float = 0.004
    jpeg_quality: int = 0
    """0 = not compressed."""
    colour: bool = False
    """BGR instead of grey."""
    supersample: int = 2
    motion_px: tuple[float, float] = (0.0, 0.0)
    """How far the picture moved while it was exposed, right and down."""
    row_noise: float = 0.0
    """Sigma of what each row reads too much, share of full scale."""
    hot_pixels: float = 0.0
    """Share of pixels that read too much whatever they see."""
    gamma: float = 1.0
    """Exponent between light and grey level."""


@dataclass(frozen=True)
class Scene:
    """A block of known outline (millimetres, work frame, at the block's top plane) and all that makes its picture."""

    outline: Contour
    camera: CameraModel
    cells: CellGeometry = field(default_factory=CellGeometry)
    thickness_mm: float = 20.0
    material: Material = field(default_factory=Material)
    table: Table = field(default_factory=Table)
    light: Light = field(default_factory=Light)
    clutter: Clutter = field(default_factory=Clutter)
    sensor: Sensor = field(default_factory=Sensor)
    seed: int = 1
    name: str = ""
    edge: Literal["cut", "cells"] = "cut"
    """`cells`: the outline follows whole cells; told to methods, not rendered."""
    things: tuple[Thing, ...] = ()
    """What lies on, beside and under the block; the later ones over the earlier ones."""

    def __post_init__(self) -> None:
        if self.thickness_mm < 0.0:
            raise ParameterError(f"thickness_mm {self.thickness_mm}: expected 0 or more")
        if not 1 <= self.sensor.supersample <= 4:
            raise ParameterError(f"supersample {self.sensor.supersample}: expected 1 to 4")
