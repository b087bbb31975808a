"""Cells that are filled or pressed together."""

from __future__ import annotations

import math

import numpy as np

from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour
from contour.synthetic.cells import CellGeometry, Lattice, lattice_centres
from contour.synthetic.outlines import signed_distance
from contour.synthetic.scene import Scene
from contour.synthetic.things import Crush, Filling, Slip


def fillings(scene: Scene) -> tuple[Filling, ...]:
    """What fills cells of the block, in order: a cell keeps the last."""
    return tuple(thing for thing in scene.things if isinstance(thing, Filling))


def filled_cells(scene: Scene, cells: CellGeometry, lattice: Lattice) -> Bytes | None:
    """For each cell of the lattice 0, or n where the n-th filling fills it; None where nothing is filled."""
    found = fillings(scene)
    if not found:
        return None
    centres = lattice_centres(cells, lattice)
    numbers = np.zeros(len(centres), dtype=np.uint8)
    for number, filling in enumerate(found, 1):
        low, high = filling.area.exterior.min(axis=0), filling.area.exterior.max(axis=0)
        near = np.flatnonzero(((centres >= low) & (centres <= high)).all(axis=1))
        within = near[signed_distance(filling.area, centres[near]) > 0.0]
        taken = np.random.default_rng([scene.seed, 63, number]).random(len(within)) < filling.share
        numbers[within[taken]] = number
    return numbers


def pressed(scene: Scene, outline: Contour, places: Float64s) -> Float64s:
    """Where the cells seen at these places were before they slipped or were crushed, work millimetres, shape (N, 2)."""
    result = places
    for number, thing in enumerate(scene.things):
        if isinstance(thing, Crush):
            result = _pressed(thing, outline, result, np.random.default_rng([scene.seed, 64, number]))
        elif isinstance(thing, Slip):
            x, y = thing.along
            left = (places - np.array(thing.at)) @ np.array([-y, x]) > 0.0
            result = result - left[:, None] * thing.shift_mm * np.array([x, y])
    return result


def _pressed(crush: Crush, outline: Contour, places: Float64s, rng: np.random.Generator) -> Float64s:
    off = places - np.array(crush.at)
    inward = np.array(crush.inward)
    tangent = np.array([-inward[1], inward[0]])
    reach = 0.5 * crush.length_mm + crush.depth_mm
    near = np.flatnonzero((off**2).sum(axis=1) < reach**2)
    if len(near) == 0:
        return places
    # Beside another edge, around a corner, cells are as deep as they lie behind this one.
    depth = np.maximum(signed_distance(outline, places[near]), off[near] @ inward)
    depth = np.clip(depth, 0.0, crush.depth_mm) / crush.depth_mm
    along = off[near] @ tangent
    window = np.clip(1.0 - np.abs(along) / (0.5 * crush.length_mm), 0.0, 1.0)
    fade = (1.0 - depth) ** 2 * np.minimum(1.0, 3.0 * window)
    wave = np.sin(along * (2.0 * math.pi / (0.6 * crush.depth_mm)) + rng.uniform(0.0, 6.0))
    result = places.copy()
    result[near] -= (crush.press_mm * fade * (1.0 + 0.25 * wave))[:, None] * inward
    result[near] += (crush.bend_mm * fade * wave)[:, None] * tangent
    return result
