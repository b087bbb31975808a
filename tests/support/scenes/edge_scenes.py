"""A small block with one thing at its upper edge, in it or beside it, by name: drawn and traced once a session."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from contour.acceptance.trace_check import CheckedTrace, check_trace
from contour.edge.stretches import Stretch
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour
from contour.synthetic import (
    CellGeometry,
    Cover,
    Filling,
    Mirror,
    Rendered,
    Scene,
    Sensor,
    Shade,
    Strip,
    Structure,
    Table,
    Thing,
    camera_above,
    disc_ring,
    rectangle,
    render,
    signed_distance,
    thick_line,
    with_holes,
)
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.tracing import trace
from tests.support.scenes.trials import calibration_for

MIDDLE, TURN_DEG, LONG, WIDE = (160.0, 120.0), 12.0, 190.0, 130.0
PITCH = 20.0
"""Pixels; ten millimetres."""
THICKNESS_MM = 15.0


def at(along: float, out: float) -> tuple[float, float]:
    """The place so far along the upper edge from its middle, and out of the block, millimetres."""
    turn = math.radians(TURN_DEG)
    a, n = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    x, y = (np.array(MIDDLE) + along * a + (0.5 * WIDE + out) * n).tolist()
    return (x, y)


def patch(along: float, out: float, long: float, wide: float, turn_deg: float = 0.0) -> Contour:
    """A rectangle about such a place, along the edge."""
    return rectangle(at(along, out), long, wide, TURN_DEG + turn_deg)


def _tape(along: float, level: float, colour: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Cover:
    return Cover(patch(along, 0.0, 30.0, 50.0), level, colour)


BLOCK = rectangle(MIDDLE, LONG, WIDE, TURN_DEG)
HOLE = disc_ring(MIDDLE, 25.0)
CELLS = CellGeometry(pitch_mm=10.0, wall_mm=1.0, ribbon_deg=17.0)
PLAIN = Scene(
    BLOCK,
    camera_above(640, 480, 0.5),
    CELLS,
    thickness_mm=THICKNESS_MM,
    sensor=Sensor(colour=True),
    seed=11,
)
HOLED = replace(PLAIN, outline=with_holes(BLOCK, HOLE))

COVERED: dict[str, tuple[float, Thing]] = {
    "bright tape": (20.0, _tape(20.0, 0.9)),
    "dark tape": (20.0, _tape(20.0, 0.02)),
    "blue tape": (-30.0, _tape(-30.0, 0.12, (2.0, 1.0, 0.4))),
    "label": (20.0, _tape(20.0, 0.3)),
    "clamp": (10.0, Cover(patch(10.0, 100.0, 35.0, 250.0), 0.5, rounding_mm=5.0, shadow=0.4, shadow_mm=(4.0, 3.0))),
    "cable": (
        -5.0,
        Cover(
            thick_line([at(-20.0, -45.0), at(-10.0, -5.0), at(10.0, 25.0), at(80.0, 75.0)], 14.0),
            0.6,
            (0.5, 0.6, 1.8),
            rounding_mm=7.0,
        ),
    ),
}
"""What lies across the upper edge, and where along it, millimetres from its middle."""

THINGS: dict[str, tuple[Thing, ...]] = {
    **{name: (thing,) for name, (_, thing) in COVERED.items()},
    "tape on a corner": (Cover(patch(0.5 * LONG, 0.0, 30.0, 30.0), 0.9),),
    "tape along an edge": (Cover(patch(0.0, 3.0, 1.2 * LONG, 30.0), 0.9),),
    "cable across a corner": (
        Cover(thick_line([at(0.5 * LONG - 95.0, 40.0), at(0.5 * LONG + 45.0, -100.0)], 20.0), 0.1, rounding_mm=10.0),
    ),
    "compound": (Filling(patch(10.0, -5.0, 70.0, 40.0), 0.4, walls=0.0),),
    "compound at a corner": (Filling(patch(0.5 * LONG, 0.0, 60.0, 60.0), 0.6, walls=0.0),),
    "soft shadow": (Shade(patch(20.0, 10.0, 60.0, 30.0), 0.5, 6.0),),
    "hard shadow": (Shade(patch(20.0, 10.0, 100.0, 30.0), 0.5, 0.6),),
    "mirror": (Mirror(0.2, 15.0),),
    "tape far away": (Cover(rectangle((40.0, 30.0), 30.0, 20.0, 30.0), 0.9),),
    "tape in the middle": (Cover(rectangle(MIDDLE, 30.0, 30.0), 0.9),),
    "strip beside": (Strip(patch(10.0, 18.0, 60.0, 30.0), replace(CELLS, offset_mm=(3.0, 4.0))),),
    "clinging chip": (Strip(patch(10.0, 10.0, 24.0, 30.0), replace(CELLS, offset_mm=(3.0, 4.0))),),
}


@dataclass(frozen=True)
class EdgeScene:
    """A drawn scene, and what was traced in it."""

    rendered: Rendered
    rectifier: Rectifier | None
    trace: Trace

    @property
    def hidden(self) -> list[Stretch]:
        """The stretches that are not seen."""
        assert self.trace.evidence is not None
        return [stretch for stretch in self.trace.evidence if stretch.state != "seen"]

    @property
    def off(self) -> NDArray[np.float64]:
        """Distance of each vertex of the true exterior from the traced contour, pixels."""
        return np.abs(signed_distance(self.trace.contour, self.rendered.truth_px.exterior))

    def middle(self, stretch: Stretch) -> NDArray[np.float64]:
        """The middle of a stretch, pixels."""
        lengths = RingLengths.of(self.trace.contour.rings[stretch.ring])
        return lengths.at(np.array([0.5 * (stretch.from_px + stretch.to_px)]))[0]

    def pixel(self, place: tuple[float, float]) -> NDArray[np.float64]:
        """Where a place on the block's top is seen."""
        return self.rendered.camera.project(np.array([place]), THICKNESS_MM)[0]

    def checked(self) -> CheckedTrace:
        """With what the picture says of it."""
        return check_trace(self.rendered.picture, self.trace, self.rectifier)


@cache
def edge_scene(name: str = "", *, lens: bool = False) -> EdgeScene:
    """The thing of this name at the block, through a lens that is known where asked; "hole", "filled hole" and
    "wood" for a block or a table of their own.
    """
    scene = HOLED if "hole" in name else PLAIN
    things = THINGS.get(name, ())
    if name == "filled hole":
        things = (Cover(Contour(HOLE), 0.6),)
    if name == "wood":
        scene, things = replace(scene, table=Table(level=0.4)), (Structure("wood", 80.0, 0.2, 30.0),)
    if lens:
        scene = replace(scene, camera=replace(scene.camera, distortion=(-0.12, 0.02, 0.0, 0.0, 0.0)))
    rendered = render(replace(scene, things=things))
    rectifier = calibration_for(rendered.camera).rectifier(THICKNESS_MM) if lens else None
    return EdgeScene(rendered, rectifier, trace(rendered.picture, TraceSettings(), rectifier=rectifier))
