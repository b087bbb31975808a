"""Where the core's ribbon runs, read from pictures: `python -m benchmarks.placement.ribbon` (`--help` for options).

Blocks of every kind that the renderer draws, and flat lattices with closed, cut and mixed borders, are traced; what is
told of the ribbon is compared with how it was drawn. Wrong is what is off by more than 2 degrees, or told where there
is no ribbon. `--write` puts the table into docs/reports/accuracy.md.
"""

from __future__ import annotations

import argparse
import math
import statistics
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.page_section import put_section, table
from contour.calibration.calibration import SimpleCalibration
from contour.errors import ContourError
from contour.synthetic import Scene, render
from contour.synthetic.cells import lattice_coordinates
from contour.synthetic.outlines import signed_distance
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.measuring.part_trial import PartTrial
from service.parts.core_ribbon import CoreRibbon, core_ribbon
from tests.support.scenes.lattices import BORDERS, CELLS, HEIGHT, WIDTH, lattice
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.shop_floor_scenes import KINDS, shop_floor_scene
from tests.support.scenes.trials import calibration_for

SECTION = "ribbon"
RIGHT_DEG = 2.0
FLAT = SimpleCalibration(WIDTH, HEIGHT, 0.3, (0.0, HEIGHT - 1.0))
_NODES = 60
_STEP_MM = 1e-3
Job = tuple[str, int, str]
"""Random, shop floor or the cells of a lattice; its seed; kind of the shop floor, or the lattice's border."""


@dataclass(frozen=True)
class Read:
    """What was told of one block, accepted. true_deg: how its ribbon was drawn; None where it has none."""

    group: str
    seed: int
    seen: CoreRibbon
    true_deg: float | None
    cpu_seconds: float

    @property
    def told(self) -> bool:
        """Whether anything was told."""
        return self.seen.told.angle_deg is not None

    @property
    def off_deg(self) -> float:
        """How far what was told is off; 90 where there is no ribbon."""
        told = self.seen.told.angle_deg
        if self.true_deg is None or told is None:
            return 90.0
        return abs((told - self.true_deg + 90.0) % 180.0 - 90.0)


def drawn_ribbon(scene: Scene) -> float | None:
    """Mean direction of the ribbons as drawn over the block, degrees in [0, 180); None where it has none."""
    cells = scene.cells
    if cells.kind != "honeycomb":
        return None
    low, high = scene.outline.exterior.min(axis=0), scene.outline.exterior.max(axis=0)
    grid = np.stack(np.meshgrid(*(np.linspace(a, b, _NODES) for a, b in zip(low, high, strict=True))), axis=2)
    points = grid.reshape(-1, 2)[signed_distance(scene.outline, grid.reshape(-1, 2)) > 0]
    at, right, up = (
        lattice_coordinates(cells, points[:, 0] + x, points[:, 1] + y, scene.seed)[0]
        for x, y in ((0.0, 0.0), (_STEP_MM, 0.0), (0.0, _STEP_MM))
    )
    # Along a ribbon the lattice's first coordinate stays.
    angle = np.arctan2(right - at, at - up)
    return math.degrees(float(np.angle(np.exp(2j * angle).mean())) / 2.0) % 180.0


def read(job: Job) -> Read | None:
    """What is told of a block; None where it was refused."""
    group, seed, kind = job
    if group in CELLS:
        return _of_lattice(group, seed, kind)
    scene = random_scene(seed).scene if group == "random" else shop_floor_scene(kind, seed).scene
    rendered = render(scene)
    calibration, height_mm = calibration_for(rendered.camera), rendered.thickness_mm
    measured = Measurer(calibration).measure(rendered.picture, PlainRecipe(thickness_mm=height_mm), height_mm)
    started = time.process_time()
    seen = PartTrial.with_ribbon(measured, rendered.picture, calibration).ribbon
    spent = time.process_time() - started
    if seen is None:
        return None
    if scene.cells.kind != "honeycomb":
        group = "irregular cells and foam"
    return Read(group, seed, seen, drawn_ribbon(scene), spent)


def _of_lattice(cells: str, seed: int, border: str) -> Read | None:
    drawn = lattice(seed, next(one for one in CELLS if one == cells), next(one for one in BORDERS if one == border))
    try:
        traced = trace(drawn.picture, TraceSettings())
    except ContourError:
        return None
    started, bright = time.process_time(), traced.polarity == "bright"
    seen = core_ribbon(
        drawn.picture, traced.contour, traced.pitch_px or 0.0, bright=bright, calibration=FLAT, height_mm=0.0
    )
    return Read(f"lattices, {cells}", seed, seen, drawn.ribbon_deg, time.process_time() - started)


def jobs(first: int, count: int) -> Iterator[Job]:
    """Random blocks, a third as many of the shop floor, and of each kind of lattice a sixtieth."""
    yield from (("random", seed, "") for seed in range(first, first + count))
    kinds = list(KINDS)
    yield from (("shop floor", first + number, kinds[number % len(kinds)]) for number in range(count // 3))
    each = max(count // 60, 1)
    yield from ((cells, first + number, border) for cells in CELLS for border in BORDERS for number in range(each))


def report(done: Sequence[Read], first: int, last: int) -> str:
    """The table, and what it was made of."""
    rows = []
    for group in [*dict.fromkeys(one.group for one in done), "all"]:
        own = [one for one in done if group in (one.group, "all")]
        told = [one for one in own if one.told]
        right = [one for one in told if one.off_deg <= RIGHT_DEG]
        by = [sum(one.seen.told.told_by == name for one in told) for name in ("walls", "cells", "walls and cells")]
        within = sum(one.off_deg <= (one.seen.told.bound_deg or 0.0) for one in told)
        worst = f"{max(one.off_deg for one in right):.2f}" if right else ""
        numbers = (len(own), len(told), *by, len(right), len(told) - len(right))
        rows.append((group, *map(str, numbers), worst, f"{within} of {len(told)}" if told else ""))
    head = ("", "accepted", "told", "by walls", "by cells", "by both", "right", "wrong", "worst of them, °", "in bound")
    spent = [one.cpu_seconds for one in done]
    return (
        f"## The core's ribbon, read from the picture\n\nBlocks from seed {first} to {last}, traced and accepted "
        "(`python -m benchmarks.placement.ribbon`). Right: within 2 degrees of the mean direction of the ribbons as "
        "drawn. Wrong: off by more, or told where there is no ribbon, as in irregular cells, foam, plates and lattices "
        "of regular hexagons, squares and triangles. Half of the blocks with regular cells have ribbons no more than "
        "1.5 times as wide as single foils, and of a pixel or two: of these little is told. Processor time "
        f"{statistics.median(spent):.2f} s, at most {max(spent):.2f} s.\n\n" + table(head, rows)
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the bench; 0 where nothing told is wrong, else 1."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.placement.ribbon", description=__doc__)
    parser.add_argument("--first", type=int, default=1_012_000, metavar="SEED", help="seed of the first block")
    parser.add_argument("--count", type=int, default=180, metavar="N", help="random blocks")
    parser.add_argument("--write", action="store_true", help="write the table into docs/reports/accuracy.md")
    options = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    done: list[Read] = []
    with ProcessPoolExecutor(max_workers=1) as pool:
        for one in pool.map(read, jobs(options.first, options.count)):
            if one is not None:
                done.append(one)
                print(one, file=sys.stderr, flush=True)
    text = report(done, options.first, options.first + options.count - 1)
    print(text)
    if options.write:
        put_section(SECTION, text)
    return 0 if all(one.off_deg <= RIGHT_DEG for one in done if one.told) else 1


if __name__ == "__main__":
    sys.exit(main())
