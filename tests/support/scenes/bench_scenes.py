"""The bench's named scenes. Those named `tuned-…` are for building methods, the others for measuring.

Every block is large enough for its cells (9 pitches at least across its arms), in focus within a pixel or two, and
brighter or darker or otherwise coloured than the table: such a scene is labelled traceable here, before any method is
run. Where the darkest walls along the outline stand out of the cells by less than 10 times the noise of a pixel
(`contrast_to_noise`), a scene is labelled dim as well.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contour.geometry.rings import Contour
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Material,
    Scene,
    Sensor,
    Table,
    blob,
    broken_off,
    camera_above,
    closed_border,
    convex,
    crescent,
    disc_ring,
    l_shape,
    rectangle,
    truth_px,
    u_shape,
    with_holes,
)
from contour.synthetic.sensor import illumination
from contour.synthetic.table import cell_floor

LENS = (-0.09, 0.02, 4e-4, -3e-4, 0.0)
CAMERA = camera_above(1280, 960, 0.375, target_mm=(240.0, 180.0), tilt_deg=(1.2, -0.8), roll_deg=0.5, distortion=LENS)
MIDDLE = (240.0, 180.0)
DIM_BELOW = 10.0


@dataclass(frozen=True)
class BenchScene:
    """A scene with what was promised of it beforehand."""

    scene: Scene
    tuned: bool = False
    dim: bool = False
    traceable: bool = True

    @property
    def name(self) -> str:
        """The scene's name; tuned ones begin with `tuned-`."""
        return self.scene.name


SHAPES: dict[str, Callable[[int], Contour]] = {
    "rectangle": lambda seed: rectangle(MIDDLE, 300.0, 210.0, 6.0 * (seed % 9) - 26.0),
    "convex": lambda seed: convex(MIDDLE, 150.0, seed),
    "l": lambda seed: l_shape(MIDDLE, 310.0, 230.0, 110.0, 5.0 * (seed % 9) - 19.0),
    "u": lambda seed: u_shape(MIDDLE, 310.0, 225.0, 100.0, 90.0, 6.0 * (seed % 7) - 17.0),
    "crescent": lambda seed: crescent((225.0, 180.0), 150.0, 115.0, 95.0, 25.0 * (seed % 7)),
    "blob": lambda seed: blob(MIDDLE, 115.0, seed),
    "holes": lambda seed: with_holes(
        rectangle(MIDDLE, 320.0, 230.0, 3.0 * (seed % 9) - 11.0),
        disc_ring((185.0, 195.0), 32.0),
        rectangle((300.0, 165.0), 60.0, 75.0, 12.0).exterior,
    ),
}


def contrast_to_noise(scene: Scene) -> float:
    """How far a wall's centre line stands out of the cell beside it, in sigmas of one pixel's noise.

    Taken where the outline is lit least; blur lowers a narrow wall's peak by erf(width / (2 √2 sigma)).
    """
    ring = np.rint(truth_px(scene).exterior).astype(int)
    lit = illumination(scene)
    light = float(lit[ring[:, 1].clip(0, lit.shape[0] - 1), ring[:, 0].clip(0, lit.shape[1] - 1)].min())
    scale = scene.camera.mm_per_px(MIDDLE, scene.thickness_mm)
    spread = math.hypot(scene.sensor.blur_px, 0.3)  # the pixel's own width is about 0.3 px of sigma
    peak = math.erf(scene.cells.wall_mm / scale / (2.0 * math.sqrt(2.0) * spread))
    floor = scene.table.level * (1.0 - scene.light.shadow) * cell_floor(scene)
    contrast = abs(scene.material.top - floor) * light * peak
    bright = max(scene.material.top * peak, floor) * light
    noise = math.sqrt(scene.sensor.shot_noise**2 * bright + scene.sensor.read_noise**2 + (0.29 / 255.0) ** 2)
    return contrast / noise


def seed_of(name: str) -> int:
    """A scene's seed: from its name, so that adding a scene changes no other."""
    return zlib.crc32(name.encode()) % 100_000


def easy(name: str, outline: Contour, **changes: Any) -> Scene:
    """A clean picture: even light, plain table, intact cells of 9 mm (24 px)."""
    rng = np.random.default_rng(seed_of(name))
    cells = CellGeometry(
        pitch_mm=9.0,
        wall_mm=0.7,
        ribbon_deg=float(rng.uniform(0.0, 180.0)),
        offset_mm=(float(rng.uniform(0.0, 9.0)), float(rng.uniform(0.0, 9.0))),
        warp=0.05,
    )
    scene = Scene(outline, CAMERA, cells, name=name, seed=seed_of(name), light=Light(gradient=0.1, vignetting=0.1))
    return _changed(scene, changes)


def shop(name: str, outline: Contour, **changes: Any) -> Scene:
    """A shop floor: broken walls, uneven light, dust, chips, a worn table, more blur and noise, JPEG."""
    rng = np.random.default_rng([seed_of(name), 1])
    base = easy(name, outline)
    scene = replace(
        base,
        cells=replace(base.cells, broken=0.025, warp=0.15, wobble=0.03, pitch_mm=10.0, wall_mm=0.75),
        light=Light(
            level=0.9,
            gradient=0.45,
            gradient_deg=float(rng.uniform(0.0, 360.0)),
            vignetting=0.3,
            patches=0.35,
            glare=0.12,
            glare_at=(float(rng.uniform(0.1, 0.9)), float(rng.uniform(0.1, 0.9))),
            shadow=0.25,
        ),
        clutter=Clutter(specks=90, debris=35),
        table=Table(level=0.15, texture=0.02, scratches=18),
        sensor=Sensor(blur_px=0.9, shot_noise=0.012, read_noise=0.008, jpeg_quality=88),
    )
    return _changed(scene, changes)


def _changed(scene: Scene, changes: dict[str, Any]) -> Scene:
    """The scene with whole parts replaced, or (given as dict) single fields of a part."""
    parts = {
        key: replace(getattr(scene, key), **value) if isinstance(value, dict) else value
        for key, value in changes.items()
    }
    return replace(scene, **parts)


def measured_scenes() -> tuple[BenchScene, ...]:
    """Scenes for measuring, all traceable; docs/reports/accuracy.md says which were changed or known before."""
    plain = [BenchScene(easy(f"{shape}-easy", make(seed_of(shape)))) for shape, make in SHAPES.items()]
    worn = [BenchScene(shop(f"{shape}-shop", make(seed_of(shape) + 1))) for shape, make in SHAPES.items()]
    return (*plain, *worn, *_sizes(), *_views(), *_surfaces(), *_cells(), *_damage())


def tuned_scenes() -> tuple[BenchScene, ...]:
    """Scenes that may be looked at while building a method."""
    plain = [easy(f"tuned-{shape}-easy", make(seed_of(shape) + 4)) for shape, make in SHAPES.items()]
    worn = [shop(f"tuned-{shape}-shop", make(seed_of(shape) + 5)) for shape, make in SHAPES.items()]
    more = [
        easy("tuned-fine", SHAPES["l"](3), cells={"pitch_mm": 4.0, "wall_mm": 0.45}),
        easy("tuned-fine-9px", SHAPES["u"](2), cells={"pitch_mm": 3.4, "wall_mm": 0.4}),
        _near("tuned-coarse", 0.09, pitch_mm=9.0, wall_mm=0.4),
        shop("tuned-over-expanded", SHAPES["u"](4), cells={"expansion_deg": 78.0}),
        shop("tuned-dark", SHAPES["l"](5), **_DARK),
        easy("tuned-irregular", SHAPES["convex"](6), cells={"kind": "irregular", "jitter": 0.3}),
        shop("tuned-foam", SHAPES["rectangle"](8), cells=_FOAM),
        easy(
            "tuned-plate", SHAPES["holes"](5), cells=replace(_PLATE, square_grid=True), thickness_mm=3.0, edge="cells"
        ),
        _closed("tuned-lattice", SHAPES["l"](2)),
        _closed("tuned-lattice-dark", SHAPES["convex"](8), **_DARK),
        shop("tuned-colour", SHAPES["rectangle"](3), **_COLOUR),
        shop("tuned-broken-off", broken_off(SHAPES["l"](1), 0.32, 0.44, 20.0, 8, pieces=3)),
        shop("tuned-vacuum-table", SHAPES["blob"](12), table=_VACUUM),
    ]
    dim = shop("tuned-dim", SHAPES["convex"](7), **_DIM)
    return (*(BenchScene(scene, tuned=True) for scene in (*plain, *worn, *more)), BenchScene(dim, tuned=True, dim=True))


_DARK: dict[str, Any] = {
    "material": Material(top=0.12, side=0.09, glints=0.02, sparks=0.05),
    "table": Table(level=0.72, texture=0.012, scratches=6),
    "light": Light(gradient=0.2, vignetting=0.2, shadow=0.1),
}
_DIM: dict[str, Any] = {
    "light": Light(level=0.22, gradient=0.4, vignetting=0.3),
    "sensor": Sensor(blur_px=0.8, shot_noise=0.03, read_noise=0.008),
}


_COLOUR: dict[str, Any] = {
    "material": Material(top=0.46, side=0.38, colour=(0.5, 1.02, 1.42), glints=0.01, sparks=0.05),
    "table": Table(level=0.42, texture=0.015, colour=(1.5, 1.0, 0.55)),
    "sensor": {"colour": True},
    "cells": {"wall_mm": 1.1},
    "thickness_mm": 8.0,
}
_VACUUM = Table(level=0.2, perforation_pitch_mm=20.0, groove_pitch_mm=80.0, scratches=15, texture=0.02)
_FOAM = CellGeometry(kind="foam", pitch_mm=11.0, wall_mm=2.4, jitter=0.4, skin=0.9)
_PLATE = CellGeometry(kind="perforated", pitch_mm=9.0, wall_mm=3.6, rim_mm=2.5, ribbon_deg=20.0)
_LATTICE = CellGeometry(pitch_mm=14.0, wall_mm=1.2, doubled=1.0, ribbon_deg=4.0, warp=0.04)


def _closed(name: str, outline: Contour, **changes: Any) -> Scene:
    """A printed lattice: whole cells, its outline serrated."""
    border = closed_border(_LATTICE, outline, seed_of(name))
    return easy(name, border, cells=_LATTICE, edge="cells", **changes)


def _near(name: str, mm_per_px: float, **cells: Any) -> Scene:
    """An easy scene seen from near: the same cells, many pixels each."""
    camera = camera_above(1600, 1200, mm_per_px, target_mm=MIDDLE, distance_mm=900.0, distortion=LENS)
    width, height = 1600 * mm_per_px, 1200 * mm_per_px
    outline = rectangle(MIDDLE, 0.72 * width, 0.7 * height, 7.0)
    return easy(name, outline, camera=camera, cells=cells)


def _sizes() -> list[BenchScene]:
    """Pitches from 6 to 150 px, and the 12 MP frame."""
    twelve = camera_above(
        4000, 3000, 0.15, target_mm=(300.0, 225.0), tilt_deg=(1.0, -0.6), distortion=LENS, distance_mm=1300.0
    )
    return [
        BenchScene(easy("fine-6px", SHAPES["rectangle"](2), cells={"pitch_mm": 2.25, "wall_mm": 0.36})),
        BenchScene(easy("fine-8px", SHAPES["l"](6), cells={"pitch_mm": 3.0, "wall_mm": 0.4})),
        BenchScene(shop("fine-12px", SHAPES["blob"](31), cells={"pitch_mm": 4.5, "wall_mm": 0.5, "broken": 0.01})),
        BenchScene(_near("coarse-90px", 0.1, pitch_mm=9.0, wall_mm=0.4)),
        BenchScene(_near("coarse-150px", 0.06, pitch_mm=9.0, wall_mm=0.25)),
        BenchScene(
            shop(
                "12mp",
                with_holes(rectangle((300.0, 225.0), 420.0, 300.0, 6.0), disc_ring((250.0, 240.0), 45.0)),
                camera=twelve,
                cells={"pitch_mm": 8.0, "wall_mm": 0.5},
                clutter=Clutter(specks=250, debris=60),
            )
        ),
    ]


def _views() -> list[BenchScene]:
    """Tilt, thickness, strong lens, defocus, compression."""
    tilted = camera_above(1280, 960, 0.375, target_mm=MIDDLE, tilt_deg=(9.0, -7.0), roll_deg=3.0, distortion=LENS)
    wide = camera_above(
        1280, 960, 0.375, target_mm=MIDDLE, distance_mm=600.0, plane_mm=20.0, distortion=(-0.16, 0.03, 0.0, 0.0, 0.0)
    )
    return [
        BenchScene(easy("tilted", SHAPES["rectangle"](4), camera=tilted)),
        BenchScene(shop("tilted-shop", SHAPES["u"](3), camera=tilted)),
        BenchScene(easy("thick", SHAPES["l"](2), thickness_mm=60.0)),
        BenchScene(easy("wide-angle-rectangle", rectangle(MIDDLE, 400.0, 290.0, 3.0), camera=wide)),
        BenchScene(shop("defocused", SHAPES["rectangle"](6), sensor={"blur_px": 1.8})),
        BenchScene(shop("jpeg-60", SHAPES["convex"](61), sensor={"jpeg_quality": 60})),
    ]


def _surfaces() -> list[BenchScene]:
    """Light, colour and tables."""
    beside = Clutter(specks=90, debris=30, neighbours=(rectangle((440.0, 160.0), 90.0, 160.0, -4.0),))
    return [
        BenchScene(shop("dim", SHAPES["rectangle"](7), **_DIM), dim=True),
        BenchScene(shop("dim-blob", SHAPES["blob"](71), **_DIM), dim=True),
        BenchScene(easy("dark-on-bright", SHAPES["u"](5), **_DARK)),
        BenchScene(shop("dark-on-bright-shop", SHAPES["convex"](51), **_DARK)),
        BenchScene(shop("colour-same-lightness", SHAPES["l"](7), **_COLOUR)),
        BenchScene(shop("vacuum-table", SHAPES["u"](6), table=_VACUUM)),
        BenchScene(
            shop(
                "glare-and-neighbour",
                rectangle((215.0, 190.0), 270.0, 210.0, 9.0),
                light={"glare": 0.3, "glare_at": (0.85, 0.3)},
                clutter=beside,
            )
        ),
    ]


def _cells() -> list[BenchScene]:
    """Other cells than regular hexagons."""
    return [
        BenchScene(shop("over-expanded", SHAPES["rectangle"](5), cells={"expansion_deg": 80.0})),
        BenchScene(shop("under-expanded", SHAPES["l"](4), cells={"expansion_deg": 48.0})),
        BenchScene(shop("irregular", SHAPES["blob"](81), cells={"kind": "irregular", "jitter": 0.35, "broken": 0.01})),
        BenchScene(easy("perforated-plate", SHAPES["holes"](3), cells=_PLATE, thickness_mm=4.0, edge="cells")),
        BenchScene(shop("foam", SHAPES["l"](8), cells=_FOAM)),
        BenchScene(_closed("lattice-closed", rectangle(MIDDLE, 270.0, 200.0, 4.0))),
        BenchScene(_closed("lattice-closed-dark", rectangle(MIDDLE, 250.0, 220.0, -9.0), **_DARK)),
    ]


def _damage() -> list[BenchScene]:
    """Broken-off parts, missing corner cells, an edge along a row of cells."""
    along = rectangle(MIDDLE, 280.0, 200.0, 0.0)
    corner = rectangle(MIDDLE, 300.0, 210.0, 8.0)
    inward = np.sign(np.array(MIDDLE) - corner.exterior)
    # the cell at the corner and the one beyond it: what hangs on neither is gone
    lost = tuple((x, y) for depth in (-2.0, 4.0) for x, y in (corner.exterior + depth * inward).tolist())
    return [
        BenchScene(shop("broken-off", broken_off(SHAPES["rectangle"](1), 0.22, 0.36, 22.0, 5, pieces=3))),
        BenchScene(easy("missing-corner-cells", corner, cells={"missing_cells_mm": lost})),
        BenchScene(easy("edges-along-rows", along, cells={"ribbon_deg": 0.0, "warp": 0.0})),
        BenchScene(shop("very-broken", SHAPES["convex"](91), cells={"broken": 0.06})),
    ]
