"""What else of core lies against a block, with cells of its own: another block, or an offcut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring, densified
from contour.geometry.signed_distance import depth_inside
from contour.synthetic import CellGeometry, Scene, Strip, l_shape, moved, polygon
from tests.support.scenes.shop_floor.blocks import placed
from tests.support.scenes.shop_floor.places import a_place, extent, with_things

FORMS = ("edge", "edge", "short", "notch", "curve", "wedge")
MOST_GAP = 0.6
"""Of a pitch: farther apart two blocks are told as two by their walls, which hang together nowhere."""


def pushed_together(rng: np.random.Generator, scene: Scene) -> Scene:
    """Two blocks edge to edge, a short one against a long one's edge, in an L's notch, along a curve, or askew."""
    pitch, form = scene.cells.pitch_mm, str(rng.choice(FORMS))
    size = max(extent(scene), 20.0 * pitch)
    first, second, apart = _pair(rng, form, size, pitch)
    turn = float(rng.uniform(0.0, 360.0))
    both = moved(Contour(np.concatenate([first, second])), (0.0, 0.0), turn)
    ring = placed(rng, replace(scene, outline=both)).outline.exterior
    step = float(rng.uniform(0.0, MOST_GAP)) * pitch * moved(Contour(apart[None]), (0.0, 0.0), turn).exterior[0]
    one, other = ring[: len(first)] - 0.5 * step, ring[len(first) :] + 0.5 * step
    return with_things(replace(scene, outline=Contour(one)), Strip(Contour(other), _own_cells(rng, scene.cells)))


def offcut(rng: np.random.Generator, scene: Scene) -> Scene:
    """A piece of the same core, 20 to 100 cells large, that lies against the edge along a side or with a corner."""
    pitch, own = scene.cells.pitch_mm, densified(scene.outline.exterior, 0.5 * scene.cells.pitch_mm)
    while True:
        place, (wide, deep) = a_place(rng, scene), rng.uniform(4.0, 11.0, 2) * pitch
        ring = _box(-0.5 * wide, 0.0, 0.5 * wide, deep)
        if rng.random() < 0.4:
            ring = _ring(np.array([ring[0], ring[1], [float(rng.uniform(-0.5, 0.5)) * wide, 1.4 * deep]]))
        askew = float(rng.normal(0.0, 2.0)) if rng.random() < 0.6 else float(rng.uniform(0.0, 360.0))
        piece = moved(Contour(ring), (0.0, 0.0), askew + place.out_deg - 90.0).exterior
        out = place.at + (float(rng.uniform(0.0, MOST_GAP)) * pitch - float((piece @ place.out).min())) * place.out
        piece = piece + out
        over = max(
            float(depth_inside(scene.outline.exterior, densified(piece, 0.5 * pitch)).max()),
            float(depth_inside(piece, own).max()),
        )
        if over < 0.1 * pitch:
            return with_things(scene, Strip(Contour(piece), _own_cells(rng, scene.cells)))


def _own_cells(rng: np.random.Generator, cells: CellGeometry) -> CellGeometry:
    """Cells of the same core in a place and mostly a direction of its own, three in ten of another size."""
    ribbon = float(rng.uniform(0.0, 180.0)) if rng.random() < 0.6 else cells.ribbon_deg + float(rng.normal(0.0, 3.0))
    larger = float(rng.uniform(0.7, 1.4)) if rng.random() < 0.3 else 1.0
    x, y = rng.uniform(0.0, cells.pitch_mm, 2).tolist()
    return replace(
        cells,
        offset_mm=(x, y),
        ribbon_deg=ribbon,
        pitch_mm=larger * cells.pitch_mm,
        wall_mm=max(larger, 1.0) * cells.wall_mm,
    )


def _pair(rng: np.random.Generator, form: str, size: float, pitch: float) -> tuple[Ring, Ring, Float64s]:
    """Two rings that touch, about the origin, so large together, and the unit vector from the first to the second."""
    long, high, other = (share * size for share in rng.uniform((0.5, 0.3, 0.3), (0.75, 0.45, 0.45)))
    aside = float(rng.choice([0.0, rng.normal(0.0, 0.3) * pitch, rng.uniform(-0.2, 0.2) * long]))
    up = np.array([0.0, 1.0])
    if form == "notch":
        whole, arm = l_shape((0.0, 0.0), long, 2.0 * high, 0.5 * min(long, 2.0 * high)), 0.5 * min(long, 2.0 * high)
        inner = np.array([arm - 0.5 * long, arm - high])
        wide, tall = (float(rng.uniform(0.6, 1.05)) * reach for reach in (long - arm, 2.0 * high - arm))
        return whole.exterior, _box(*inner, inner[0] + wide, inner[1] + tall), np.array([1.0, 1.0])
    if form == "short":
        wide, deep = (max(float(rng.uniform(0.2, 0.5)) * long, 7.0 * pitch) for _ in range(2))
        first = float(rng.uniform(-0.5 * long, 0.5 * long - wide))
        return _box(-0.5 * long, -high, 0.5 * long, 0.0), _box(first, 0.0, first + wide, deep), up
    below = _box(-0.5 * long, -high, 0.5 * long, 0.0)
    above = _box(aside - 0.5 * long, 0.0, aside + float(rng.uniform(0.4, 0.6)) * long, other)
    if form == "curve":
        x = np.linspace(-0.5, 0.5, 60) * long
        y = float(rng.uniform(-0.15, 0.15)) * long * np.cos(x / long * float(rng.uniform(2.0, 6.0)) + aside)
        seam = np.column_stack([x, y])
        return (
            _ring(np.concatenate([seam[::-1], below[:2] + np.array([0.0, y.min()])])),
            _ring(np.concatenate([seam, [[0.5 * long, other + y.max()], [-0.5 * long, other + y.max()]]])),
            up,
        )
    if form == "wedge":  # not quite parallel edges, which touch at one end
        end = above[:, 0].min()
        above = moved(Contour(above - [end, 0.0]), (end, 0.0), float(rng.uniform(0.0, 1.0))).exterior
    return below, above, up


def _box(left: float, low: float, right: float, high: float) -> Ring:
    return _ring(np.array([[left, low], [right, low], [right, high], [left, high]]))


def _ring(points: Ring) -> Ring:
    return polygon([(float(x), float(y)) for x, y in points]).exterior
