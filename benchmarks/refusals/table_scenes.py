"""Blocks on coloured, dark, bright and structured tables: all traceable, as `bench_scenes` means it.

Walls differ from the table by a quarter of full scale or more, in lightness or in a colour channel, and a structure of
the table is no comb: its holes lie two diameters apart or more. `tuned-…` were looked at while thresholds were chosen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from contour.synthetic import Light, Material, Scene, Table
from tests.support.scenes.bench_scenes import SHAPES, BenchScene, seed_of, shop

_SHAPES = ("rectangle", "convex", "l", "u", "blob", "holes", "crescent")
_TINTS = {
    "green-mat": (0.75, 1.3, 0.7),
    "blue-cloth": (1.6, 0.9, 0.45),
    "red-oxide": (0.45, 0.7, 1.7),
    "wood": (0.5, 0.95, 1.4),
}

Changes = dict[str, Any]

# A number that was looked at and led to a change is not fresh any more: begin after it then.
FIRST = 17


def table_scenes(measured_of_each: int = 3, first: int = FIRST) -> tuple[BenchScene, ...]:
    """One tuned scene of every kind of table, and as many for measuring as asked for, numbered from `first`."""
    return tuple(
        BenchScene(_scene(f"{prefix}table-{name}-{number}", kind), tuned=number == 0)
        for name, kind in _KINDS.items()
        for number in (0, *range(first, first + measured_of_each))
        for prefix in (["tuned-"] if number == 0 else [""])
    )


def _scene(name: str, kind: Callable[[np.random.Generator], Changes]) -> Scene:
    rng = np.random.default_rng([seed_of(name), 3])
    outline = SHAPES[str(rng.choice(_SHAPES))](int(rng.integers(0, 500)))
    pitch = float(rng.uniform(6.0, 13.0))
    cells = {"pitch_mm": pitch, "wall_mm": pitch * float(rng.uniform(0.075, 0.1)), "broken": 0.015}
    scene = shop(name, outline, cells=cells, **kind(rng))
    return replace(scene, light=replace(scene.light, glare=0.05))


def _tinted(tint: tuple[float, float, float]) -> Callable[[np.random.Generator], Changes]:
    def changes(rng: np.random.Generator) -> Changes:
        table = Table(level=float(rng.uniform(0.15, 0.3)), texture=0.015, scratches=20, colour=tint)
        return {"table": table, "sensor": {"colour": True}, "material": Material(top=float(rng.uniform(0.65, 0.85)))}

    return changes


def _coloured_block(rng: np.random.Generator) -> Changes:
    """Brown paper honeycomb on a blue table."""
    return {
        "table": Table(level=0.35, texture=0.012, colour=(1.5, 0.95, 0.55)),
        "material": Material(top=0.5, side=0.3, colour=(0.45, 0.95, 1.6), glints=0.02, sparks=0.05),
        "sensor": {"colour": True},
        "thickness_mm": float(rng.uniform(5.0, 12.0)),
    }


def _black(rng: np.random.Generator) -> Changes:
    return {"table": Table(level=float(rng.uniform(0.01, 0.04)), texture=0.004, scratches=5)}


def _bright(rng: np.random.Generator) -> Changes:
    """A light grey table under bright foil."""
    material = Material(top=float(rng.uniform(0.78, 0.9)), side=0.3)
    return {"table": Table(level=float(rng.uniform(0.3, 0.4)), texture=0.012), "material": material}


def _dark_block_on_colour(rng: np.random.Generator) -> Changes:
    """Black carbon honeycomb on a yellow table."""
    return {
        "table": Table(level=float(rng.uniform(0.55, 0.7)), texture=0.012, scratches=6, colour=(0.45, 1.15, 1.3)),
        "material": Material(top=0.11, side=0.08, glints=0.01, sparks=0.05, spread=0.1),
        "light": Light(gradient=0.2, vignetting=0.2, shadow=0.1),
        "sensor": {"colour": True},
        "thickness_mm": float(rng.uniform(4.0, 9.0)),
    }


def _perforated(rng: np.random.Generator) -> Changes:
    diameter = float(rng.uniform(3.0, 6.0))
    table = Table(
        level=float(rng.uniform(0.12, 0.28)),
        texture=0.015,
        perforation_pitch_mm=diameter * float(rng.uniform(3.0, 6.0)),
        perforation_mm=diameter,
        scratches=10,
    )
    return {"table": table}


def _grooved(rng: np.random.Generator) -> Changes:
    table = Table(
        level=float(rng.uniform(0.12, 0.28)),
        texture=0.015,
        groove_pitch_mm=float(rng.uniform(25.0, 80.0)),
        scratches=10,
    )
    return {"table": table}


def _vacuum_in_colour(rng: np.random.Generator) -> Changes:
    table = Table(
        level=float(rng.uniform(0.15, 0.25)),
        texture=0.02,
        perforation_pitch_mm=float(rng.uniform(14.0, 28.0)),
        groove_pitch_mm=70.0,
        scratches=25,
        colour=(0.7, 1.0, 1.3),
    )
    return {"table": table, "sensor": {"colour": True}}


def _scratched(rng: np.random.Generator) -> Changes:
    return {"table": Table(level=float(rng.uniform(0.1, 0.2)), texture=0.02, scratches=int(rng.integers(120, 300)))}


_KINDS: dict[str, Callable[[np.random.Generator], Changes]] = {
    **{name: _tinted(tint) for name, tint in _TINTS.items()},
    "coloured-block": _coloured_block,
    "black": _black,
    "bright": _bright,
    "dark-block": _dark_block_on_colour,
    "perforated": _perforated,
    "grooved": _grooved,
    "vacuum-colour": _vacuum_in_colour,
    "scratched": _scratched,
}
