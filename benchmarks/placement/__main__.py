"""Parts laid into traced blocks: `python -m benchmarks.placement` (`--help` for options).

Blocks are rendered at random and traced; into each accepted one a part drawn at random is laid. The margin is compared
with the best of a million poses, and the placed part, by shapely, with the rendered outline. `--write` puts the table
into docs/reports/accuracy.md.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import cv2

from benchmarks.page_section import put_section, table
from benchmarks.placement.parts import random_part
from benchmarks.placement.pose_search import Found, margin, search, shape_of, signed_margin
from contour.placement.place import best_placement
from contour.placement.pose import Turns
from contour.synthetic import render
from service.config.plain_recipe import PlainRecipe
from service.parts.sure_block import EVERYWHERE, SureBlock
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.trials import measured

SECTION = "placement"
CLOSE_MM = 0.1
_TIMES = 3
"""How often each is laid: other work on the machine only adds to what it takes."""


@dataclass(frozen=True)
class Laid:
    """A part laid into one traced block: what was reached, and by whom. true_mm: its distance from the rendered edge,
    negative where it leaves the rendered block. own_mm: the contour's bound; bound_mm: that for the part.
    """

    seed: int
    margin_mm: float
    by_shapely_mm: float
    found: Found
    bound_mm: float
    own_mm: float
    true_mm: float
    seconds: float
    cpu_seconds: float

    @property
    def fits(self) -> bool:
        """True where it lies inside at all, by anybody's word."""
        return max(self.margin_mm, self.found.polished_mm) > 0


def laid(seed: int) -> Laid | None:
    """The part of a seed in the block of that seed; None where the block was refused."""
    scene = random_scene(seed).scene
    rendered = render(scene)
    recipe = PlainRecipe(thickness_mm=rendered.thickness_mm)
    seen = measured(rendered, recipe)
    if seen.findings or seen.millimetres is None or seen.uncertainty_mm is None:
        return None
    block = SureBlock.of(seen.millimetres, seen.uncertainty_mm, seen.evidence or ())
    if block is None:
        return None
    part = random_part(rendered.truth_mm, seed)
    spent = []
    for _ in range(_TIMES):
        started, cpu = time.perf_counter(), time.process_time()
        placement = best_placement(part, block.measured, Turns.free())
        bound_mm = block.bound_at(part, placement)
        spent.append((time.perf_counter() - started, time.process_time() - cpu))
    seconds, cpu_seconds = (min(one) for one in zip(*spent, strict=True))
    placed = shape_of(placement.pose.placed(part))
    return Laid(
        seed,
        placement.margin,
        margin(placed, shape_of(seen.millimetres)),
        search(part, seen.millimetres, seed),
        bound_mm,
        seen.uncertainty_mm,
        signed_margin(placed, shape_of(rendered.truth_mm)),
        seconds,
        cpu_seconds,
    )


def report(done: Sequence[Laid], refused: int) -> str:
    """The table, and what it was made of."""
    inside = [one for one in done if one.fits]
    behind = [one.found.polished_mm - one.margin_mm for one in inside]
    searched = [one.found.searched_mm - one.margin_mm for one in inside]
    nearer = [one for one in inside if one.true_mm < one.margin_mm - one.bound_mm]
    differ = [abs(one.by_shapely_mm - one.margin_mm) for one in inside]
    ratios = [one.bound_mm / one.own_mm for one in inside]
    seconds, cpu = [one.seconds for one in done], [one.cpu_seconds for one in done]
    rows = [
        ("parts that fit with some margin", f"{len(inside)} of {len(done)}"),
        ("margin lost to the best of a million poses, worst", f"{max(0.0, *searched):.3f} mm"),
        ("the same, the best dozen of them moved until nothing helped, worst", f"{max(0.0, *behind):.3f} mm"),
        (f"behind these by more than {CLOSE_MM:g} mm", str(sum(one > CLOSE_MM for one in behind))),
        ("our margin and shapely's of the same pose differ, worst", f"{max(differ):.1g} mm"),
        ("nearer to the rendered edge than margin less the bound for parts", f"{len(nearer)} of {len(inside)}"),
        ("that bound over the contour's own, median / worst", f"{statistics.median(ratios):.1f} / {max(ratios):.1f}"),
        (
            "nearer than margin less the contour's own bound",
            f"{sum(one.true_mm < one.margin_mm - one.own_mm for one in inside)} of {len(inside)}",
        ),
        (
            "the worst of them, by",
            f"{max((one.margin_mm - one.bound_mm - one.true_mm for one in nearer), default=0.0):.2f} mm",
        ),
        ("time by the clock, median / worst", f"{statistics.median(seconds):.2f} / {max(seconds):.2f} s"),
        ("processor time, median / worst", f"{statistics.median(cpu):.2f} / {max(cpu):.2f} s"),
    ]
    first, last = done[0].seed, done[-1].seed
    return (
        f"## Parts laid into traced blocks\n\nRandom blocks {first} to {last}, {refused} of them refused, each with a "
        "part drawn at random of 8 to 50 % of its area, turned freely (`python -m benchmarks.placement`). Margins are "
        "to the traced outline; the rendered edge is the true one. The bound for parts is "
        f"{EVERYWHERE:g} times the contour's own, more where the edge near the part is less sure. Times are the "
        f"best of {_TIMES} runs each, in two threads, on a machine of two cores that has other work.\n\n"
        + table(("", "measured"), rows)
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the bench; 0 where every goal is reached, else 1."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.placement", description=__doc__)
    parser.add_argument("--first", type=int, default=996_000, metavar="SEED", help="seed of the first block")
    parser.add_argument("--count", type=int, default=180, metavar="N", help="blocks")
    parser.add_argument("--write", action="store_true", help="write the table into docs/reports/accuracy.md")
    options = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    done: list[Laid] = []
    with ProcessPoolExecutor(max_workers=1) as pool:
        for one in pool.map(laid, range(options.first, options.first + options.count)):
            if one is None:
                continue
            done.append(one)
            print(one, file=sys.stderr, flush=True)
    text = report(done, options.count - len(done))
    print(text)
    if options.write:
        put_section(SECTION, text)
    inside = [one for one in done if one.fits]
    good = all(
        one.found.polished_mm - one.margin_mm <= CLOSE_MM and one.true_mm >= one.margin_mm - one.bound_mm
        for one in inside
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
