"""Small rendered blocks for tests: drawn once a session, by name."""

from __future__ import annotations

from functools import cache

from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Material,
    Rendered,
    Scene,
    Sensor,
    Table,
    camera_above,
    crescent,
    disc_ring,
    l_shape,
    rectangle,
    render,
    with_holes,
)

WIDTH, HEIGHT, MM_PER_PX = 640, 480, 0.5
MIDDLE = (160.0, 120.0)

OUTLINES = {
    "rectangle": rectangle(MIDDLE, 190, 130, 12),
    "l": l_shape(MIDDLE, 200, 160, 75, 20),
    "crescent": crescent(MIDDLE, 90, 75, 65, 35),
    "holed": with_holes(rectangle(MIDDLE, 200, 150, -15), disc_ring((150, 122), 30)),
    "small-holed": with_holes(rectangle(MIDDLE, 200, 150, -15), disc_ring((150, 122), 16)),
}


@cache
def block(name: str, kind: str = "easy") -> Rendered:
    """The outline `name` as an easy, a shop-floor, a dim or a dark-walled picture."""
    camera = camera_above(WIDTH, HEIGHT, MM_PER_PX)
    cells = CellGeometry(pitch_mm=10, wall_mm=1.0, ribbon_deg=17)
    easy = Scene(OUTLINES[name], camera, cells, seed=11)
    scenes = {
        "easy": easy,
        "shop": Scene(
            OUTLINES[name],
            camera_above(WIDTH, HEIGHT, MM_PER_PX, tilt_deg=(3, -2), distortion=(-0.1, 0.02, 0, 0, 0)),
            CellGeometry(pitch_mm=11, wall_mm=0.9, ribbon_deg=40, broken=0.03),
            table=Table(level=0.15, texture=0.02),
            light=Light(gradient=0.4, vignetting=0.3),
            clutter=Clutter(specks=30, debris=4),
            sensor=Sensor(shot_noise=0.01, read_noise=0.008, jpeg_quality=90),
            seed=12,
        ),
        "dim": Scene(OUTLINES[name], camera, cells, light=Light(level=0.25, gradient=0.3), seed=13),
        "dark": Scene(
            OUTLINES[name],
            camera,
            CellGeometry(pitch_mm=10, wall_mm=1.4, ribbon_deg=17),
            material=Material(top=0.1, side=0.3),
            table=Table(level=0.75),
            seed=14,
        ),
    }
    return render(scenes[kind])
