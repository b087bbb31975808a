"""Several parts on traced blocks with holes, beside u-nesting alone: `python -m benchmarks.placement.nesting`.

Blocks with holes are rendered at random and traced; of three parts drawn at random as many as fit are laid. u-nesting
(0.28, MIT) gets the same parts, block, distances and time, once by each of two of its strategies, of which the better
counts. It knows no holes in a block, so that each is joined to the edge by a slit. Shapely judges both, and ours
against the rendered edge, too. `--write` puts the table into docs/reports/accuracy.md.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import shapely
import shapely.ops

from benchmarks.page_section import put_section, table
from benchmarks.placement.parts import random_part
from benchmarks.placement.pose_search import shape_of
from contour.geometry.rings import Contour, area, simplify_indices
from contour.placement.pose import Pose, Turns
from contour.placement.several import Wanted, lay_several
from contour.synthetic import render
from service.config.plain_recipe import PlainRecipe
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.trials import measured

SECTION = "nesting"
KINDS, QUANTITY, MARGIN_MM, APART_MM, TRIES = 3, 12, 3.0, 4.0, 2
STRATEGIES = {"nfp": 4, "brkga": 4}
"""Of u-nesting, and how many turns each is allowed: with more, in the same time, it lays less."""

_SLITS_MM = (0.01, 0.1, 0.5)
_CLOSE = 1e-6


@dataclass(frozen=True)
class Judged:
    """A layout by shapely. share: of the block's area. near_edge, near_another: parts that keep too little."""

    share: float
    count: int
    near_edge: int
    near_another: int


@dataclass(frozen=True)
class Case:
    """One block. near_true_edge: parts of ours nearer to the rendered edge than the margin asked for."""

    seed: int
    ours: Judged
    theirs: Judged
    near_true_edge: int
    seconds: float
    cpu_seconds: float


def judged(parts: Sequence[Contour], block: Contour, needed: float) -> Judged:
    """What shapely says of parts in a block."""
    room, shapes = shape_of(block), [shape_of(part) for part in parts]
    near = [not room.contains(one) or one.distance(room.boundary) < needed - _CLOSE for one in shapes]
    pairs = [one.distance(other) < APART_MM - _CLOSE for k, one in enumerate(shapes) for other in shapes[:k]]
    return Judged(sum(one.area for one in shapes) / room.area, len(shapes), sum(near), sum(pairs))


def drawn_parts(block: Contour, seed: int) -> list[Contour]:
    """Three parts of 1.5 to 8 % of the block's area each."""
    rng, found = np.random.default_rng([seed, 5]), []
    for kind in range(KINDS):
        part = random_part(block, KINDS * seed + kind)
        factor = float(np.sqrt(rng.uniform(0.015, 0.08) * area(block) / area(part)))
        rings = [ring[simplify_indices(ring * factor, 0.05)] * factor for ring in part.rings]
        found.append(Contour(rings[0], tuple(rings[1:])))
    return found


def slit_open(block: Contour, width: float) -> list[list[float]]:
    """The block as one ring: each hole joined to the exterior by a slit that goes 1 mm into both."""
    shape = shape_of(block)
    for hole in block.holes:
        near, far = (
            np.array(end.coords[0]) for end in shapely.ops.nearest_points(shape.exterior, shapely.Polygon(hole))
        )
        way = (far - near) / np.hypot(*(far - near))
        shape = shape.difference(shapely.LineString([near - way, far + way]).buffer(width / 2, cap_style="flat"))
    ring: list[list[float]] = shapely.get_coordinates(shape.exterior)[:-1].tolist()
    return ring


def by_u_nesting(
    parts: Sequence[Contour], block: Contour, needed: float, seconds: float, strategy: str
) -> list[Contour]:
    """What u-nesting lays in so much time."""
    import u_nesting  # type: ignore[import-not-found, import-untyped, unused-ignore]

    turns = STRATEGIES[strategy]
    asked = [
        {
            "id": str(number),
            "polygon": part.exterior.tolist(),
            "holes": [hole.tolist() for hole in part.holes],
            "quantity": QUANTITY,
            "rotations": [360.0 / turns * k for k in range(turns)],
        }
        for number, part in enumerate(parts)
    ]
    settings = {"strategy": strategy, "spacing": APART_MM, "margin": needed, "time_limit_ms": round(seconds * 1000)}
    result: dict[str, Any] = {}
    for width in _SLITS_MM:  # it refuses some outlines as crossing themselves that shapely takes
        result = u_nesting.solve_2d(asked, {"polygon": slit_open(block, width)}, settings)
        if result["success"]:
            break
    return [
        Pose(*one["position"], one["rotation"][0]).placed(parts[int(one["geometry_id"])])
        for one in result["placements"]
    ]


def case(seed: int) -> Case | None:
    """The layouts on the block of a seed; None where it was refused, or has no hole."""
    scene = random_scene(seed).scene
    if not scene.outline.holes:
        return None
    rendered = render(scene)
    recipe = PlainRecipe(thickness_mm=rendered.thickness_mm)
    seen = measured(rendered, recipe)
    block = seen.millimetres
    if seen.findings or block is None or seen.uncertainty_mm is None or not block.holes:
        return None
    parts, needed = drawn_parts(block, seed), MARGIN_MM + seen.uncertainty_mm
    started, cpu = time.perf_counter(), time.process_time()
    laid = lay_several([Wanted(part, QUANTITY, needed, 1, Turns.free()) for part in parts], block, APART_MM, TRIES)
    seconds, cpu_seconds = time.perf_counter() - started, time.process_time() - cpu
    placed = [one.placement.pose.placed(parts[one.index]) for one in laid]
    theirs = [judged(by_u_nesting(parts, block, needed, seconds, name), block, needed) for name in STRATEGIES]
    near_true = judged(placed, rendered.truth_mm, MARGIN_MM).near_edge
    best = max(theirs, key=lambda one: one.share)
    return Case(seed, judged(placed, block, needed), best, near_true, seconds, cpu_seconds)


def report(done: Sequence[Case]) -> str:
    """The table, and what it was made of."""
    ours, theirs = [one.ours for one in done], [one.theirs for one in done]
    behind = sum(one.ours.share < one.theirs.share for one in done)
    rows = [
        (
            "share of the block that is laid, median",
            *(f"{100 * statistics.median(_shares(k)):.1f} %" for k in (ours, theirs)),
        ),
        ("the same, least", *(f"{100 * min(_shares(k)):.1f} %" for k in (ours, theirs))),
        ("parts laid", *(str(sum(one.count for one in k)) for k in (ours, theirs))),
        (
            "blocks on which it lays less than the other",
            str(behind),
            str(sum(o.share < w.share for o, w in zip(theirs, ours, strict=True))),
        ),
        ("parts nearer to one another than asked", *(str(sum(one.near_another for one in k)) for k in (ours, theirs))),
        (
            "parts nearer to the traced edge than asked, with the bound",
            *(str(sum(one.near_edge for one in k)) for k in (ours, theirs)),
        ),
        ("parts nearer to the rendered edge than the margin", str(sum(one.near_true_edge for one in done)), ""),
    ]
    cpu = [one.cpu_seconds for one in done]
    drawn = f"{KINDS} parts drawn at random of 1.5 to 8 % of its area, up to {QUANTITY} of each"
    kept = f"{MARGIN_MM:g} mm and the bound from the edge, {APART_MM:g} mm apart"
    took = f"`parts_tries: {TRIES}`: {statistics.median(cpu):.1f} s of a processor, {max(cpu):.1f} s at most"
    return (
        "## Several parts on traced blocks with holes\n\n"
        f"{len(done)} random blocks with holes from {done[0].seed} to {done[-1].seed}; on each, {drawn}, turned "
        f"freely, {kept} (`python -m benchmarks.placement.nesting`). Ours with {took}. u-nesting 0.28 gets the same "
        f"time, by the better of its strategies {' and '.join(STRATEGIES)}; it takes no holes in a block, so each is "
        "joined to the edge by a slit.\n\n" + table(("", "ours", "u-nesting alone"), rows)
    )


def _shares(layouts: Sequence[Judged]) -> list[float]:
    return [one.share for one in layouts]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the bench; 0 where every goal is reached, else 1."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.placement.nesting", description=__doc__)
    parser.add_argument("--first", type=int, default=997_600, metavar="SEED", help="seed of the first block")
    parser.add_argument("--count", type=int, default=50, metavar="N", help="blocks with holes that were traced")
    parser.add_argument("--write", action="store_true", help="write the table into docs/reports/accuracy.md")
    options = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    done: list[Case] = []
    seed = options.first
    while len(done) < options.count:
        one = case(seed)
        seed += 1
        if one is not None:
            done.append(one)
            print(one, file=sys.stderr, flush=True)
    text = report(done)
    print(text)
    if options.write:
        put_section(SECTION, text)
    broken = sum(one.ours.near_another + one.ours.near_edge for one in done)
    return 0 if not broken and all(one.ours.share >= one.theirs.share for one in done) else 1


if __name__ == "__main__":
    sys.exit(main())
