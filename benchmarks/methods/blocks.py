"""The blocks of docs/reports/methods.md, and what the methods make of them: rendered and traced once a run."""

from __future__ import annotations

from functools import cache

from contour.geometry.rings import Contour, area
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Rendered,
    Scene,
    Sensor,
    Table,
    camera_above,
    convex,
    crescent,
    disc_ring,
    l_shape,
    render,
    u_shape,
    with_holes,
)
from contour.tracing.binarize import BinarizedPicture, binarize
from contour.tracing.paper_cells import EnclosedCells
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.scenes.metrics import agreement

WIDTH, HEIGHT, MM_PER_PX = 500, 430, 0.6
MIDDLE = (WIDTH * MM_PER_PX / 2, HEIGHT * MM_PER_PX / 2 - 11.0)
"""Beside the picture's: where windows begin then has nothing to do with where the block does."""

CORE_AND_STEP = ((5, 5), (10, 10), (25, 25), (10, 20), (10, 5), (10, 1))
"""The sizes that the figure and the table of the sliding matrix show, px."""

_OUTLINES: dict[str, tuple[Contour, int]] = {
    "convex": (convex(MIDDLE, 100, 4), 5),
    "l": (l_shape(MIDDLE, 205, 155, 68, 20.0), 6),
    "l, turned": (l_shape(MIDDLE, 205, 155, 68, 200.0), 6),
    "u": (u_shape(MIDDLE, 220, 170, 65, 60, 0.0), 7),
    "crescent": (crescent(MIDDLE, 100, 85, 70, 90.0), 8),
    "holed": (
        with_holes(u_shape(MIDDLE, 225, 175, 68, 85, 10.0), disc_ring((MIDDLE[0] + 4.0, MIDDLE[1] - 42.0), 24.0)),
        9,
    ),
}


@cache
def block(name: str, specks: int = 0, chips: int = 0) -> Rendered:
    """An easy picture of a block, 22 px a pitch: little noise, so that the methods fail by their nature alone."""
    outline, seed = _OUTLINES[name]
    return render(
        Scene(
            outline,
            camera_above(WIDTH, HEIGHT, MM_PER_PX),
            CellGeometry(pitch_mm=13.2, wall_mm=1.2, ribbon_deg=20.0),
            table=Table(texture=0.004),
            light=Light(gradient=0.2),
            clutter=Clutter(specks=specks, debris=chips),
            sensor=Sensor(shot_noise=0.003, read_noise=0.002),
            seed=seed,
        )
    )


@cache
def walls(name: str, specks: int = 0, chips: int = 0) -> BinarizedPicture:
    """The block's wall mask."""
    return binarize(block(name, specks, chips).picture)


def cells(name: str, specks: int = 0, chips: int = 0) -> EnclosedCells:
    """The block's cells."""
    found = walls(name, specks, chips).cells
    if found is None:
        raise SystemExit(f"The block {name!r} shows no cells: the renderer or the mask has changed.")
    return found


@cache
def traced(settings: TraceSettings, name: str, specks: int = 0, chips: int = 0) -> tuple[Contour, float, float]:
    """The method's contour, its mean distance from the true outline, px, and its error of area, %."""
    scene = block(name, specks, chips)
    found = trace(scene.picture, settings).contour
    share = 100 * (area(found) / area(scene.truth_px) - 1)
    return found, agreement(found, scene.truth_px).mean_px, share
