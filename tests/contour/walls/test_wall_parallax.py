"""The parallax of walls: read from their widths, and not from ribbons that are thicker than other walls."""

from __future__ import annotations

import numpy as np

from contour.geometry.agreement import distances_to
from contour.geometry.rings import Contour
from contour.synthetic import (
    CameraModel,
    CellGeometry,
    Light,
    Material,
    Scene,
    Sensor,
    Table,
    crescent,
    render,
)
from contour.walls.lightness import wall_light
from contour.walls.see_block import see_block, see_walls
from contour.walls.wall_evidence import WitnessKind


def test_ribbons_thicker_than_other_walls_are_no_parallax_that_moves_wall_ends_inwards() -> None:
    """Ribbons end at the right and the left of this crescent, single walls above and below."""
    camera = CameraModel(
        1241,
        1241,
        (10121.06, 10121.06),
        (620.0, 620.0),
        (0.03706, 0.01026, 2.13e-4, -2.97e-4, 0.0),
        ((0.999513, 0.013134, 0.028297), (0.012971, -0.999898, 0.005931), (0.028372, -0.005561, -0.999582)),
        (-67.17, 64.794, 1091.3125),
    )
    cells = CellGeometry(
        pitch_mm=5.0572,
        wall_mm=0.40225,
        doubled=1.981,
        ribbon_deg=178.93,
        offset_mm=(1.501, 3.9938),
        warp=0.0081,
        wobble=0.0368,
    )
    outline = crescent((0.0, 0.0), 55.13, 41.347, 40.4, 199.02)
    middle = 0.5 * (outline.exterior.min(axis=0) + outline.exterior.max(axis=0))
    scene = Scene(
        Contour(outline.exterior - middle + np.array([65.71, 65.784])),
        camera,
        cells,
        thickness_mm=22.182,
        material=Material(top=0.72, side=0.3826, texture=0.1095, glints=0.0322, sheen=0.1716, sparks=0.223),
        table=Table(level=0.0806, texture=0.0053, scratches=7),
        light=Light(
            0.989, gradient=0.2, gradient_deg=14.4, vignetting=0.112, shadow=0.069, direction_deg=317, patches=0.3725
        ),
        sensor=Sensor(blur_px=1.155, shot_noise=0.00875, read_noise=0.0073, jpeg_quality=85),
        seed=1039,
    )
    seen = render(scene)
    ring = see_block(see_walls(seen.picture, wall_light(seen.picture), "auto")).rings[0]
    off = distances_to(ring.points[ring.kind == WitnessKind.CLEAN], seen.truth_px)
    assert sorted(off)[int(0.8 * len(off))] < 0.8
