"""Whether `edge: auto` tells closed borders from cut ones on flat lattices and plates, and how near outlines come.

`python -m benchmarks.accuracy.edge_kinds --seeds 9 --first SEED --write` writes its section of the accuracy page.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.page_section import options_of_seeds, put_section, table
from contour.geometry.agreement import agreement
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from tests.support.scenes.lattices import BORDERS, CELLS, Border, Cells, lattice

FIRST = 978000
WRONG_CELLS = 0.5
_SAID = """\
## Closed borders, cut ones, and both

Flat lattices and plates (`tests/support/scenes/lattices.py`), cells of {cells} kinds, bright and dark tables, seeds
{first} to {last}, with nothing promised (`edge: auto`). Told: the border was told as what it is, also where the
outline was refused; a border whose one cut opened no cell is closed. Right: accepted, nowhere off by more than half a
cell."""


@dataclass(frozen=True)
class Verdict:
    """What became of one picture; distances in pixels, None where there is no outline."""

    cells: Cells
    border: Border
    told: bool
    codes: tuple[int, ...]
    mean_px: float | None
    wrong: bool
    broken: bool


def judged(cells: Cells, border: Border, seed: int) -> Verdict:
    """The verdict on one drawn lattice."""
    one = lattice(seed, cells, border)
    seen = Measurer(None).measure(one.picture, PlainRecipe(), 0.0)
    codes = tuple(int(reason) for reason in seen.reasons)
    told = seen.edge == one.edge
    if codes or seen.pixels is None or seen.uncertainty_px is None:
        return Verdict(cells, border, told, codes, None, wrong=False, broken=False)
    near = agreement(seen.pixels, one.outline)
    wrong = near.hausdorff_px > WRONG_CELLS * one.pitch_px
    broken = not near.holds(seen.uncertainty_px)
    return Verdict(cells, border, told, codes, near.mean_px, wrong=wrong, broken=broken)


def report(verdicts: Sequence[Verdict], seeds: Sequence[int]) -> str:
    """The section of the accuracy page."""
    head = ["", "pictures", "told", "right", "mean of them, px", "wrong, accepted", "refused", "bound broken"]
    rows = [
        _row(f"{border}, {cells}", [v for v in verdicts if (v.border, v.cells) == (border, cells)])
        for border in BORDERS
        for cells in CELLS
    ]
    said = _SAID.format(cells=len(CELLS), first=seeds[0], last=seeds[-1])
    return f"{said}\n\n{table(head, [*rows, _row('all', verdicts)])}"


def _row(name: str, some: Sequence[Verdict]) -> list[str]:
    taken = [v for v in some if not v.codes]
    right = [v.mean_px for v in taken if v.mean_px is not None and not v.wrong]
    codes = Counter(v.codes[0] for v in some if v.codes)
    return [
        name,
        str(len(some)),
        str(sum(v.told for v in some)),
        str(len(right)),
        f"{np.median(right):.2f}" if right else "–",
        str(sum(v.wrong for v in taken)),
        ", ".join(f"{count} by {code}" for code, count in sorted(codes.items())) or "0",
        str(sum(v.broken for v in taken)),
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when no wrong outline was accepted, else 1."""
    parser = options_of_seeds("benchmarks.accuracy.edge_kinds", __doc__, seeds=9, first=FIRST)
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.seeds)
    jobs = [(cells, border, seed) for border in BORDERS for cells in CELLS for seed in seeds]
    with ProcessPoolExecutor(options.workers, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        verdicts = list(pool.map(judged, *zip(*jobs, strict=True)))
    text = report(verdicts, seeds)
    print(text)
    if options.write:
        put_section("edge-kinds", text)
    return int(any(verdict.wrong for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
