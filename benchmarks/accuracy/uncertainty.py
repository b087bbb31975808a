"""Stated against true error: `python -m benchmarks.accuracy.uncertainty` (`--help` for options).

Measures on fresh random scenes and on the scenes for measuring; with `--write` plot and numbers go to
docs/reports/accuracy.md.
`--calibrate` fits the coefficients of `contour/outline/uncertainty.py` on other seeds, and on blocks with things on
them, and prints them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.shop_floor import WRONG_PITCHES, true_places
from benchmarks.accuracy.uncertainty_plot import PLOT, write_plot
from benchmarks.page_section import put_section, table
from contour.edge.visible_edge import VisibleRing, visible_rings
from contour.errors import ContourError
from contour.geometry.agreement import distances_to, rectified_edges
from contour.outline.uncertainty import LEAST_PX, Coefficients, Stretches, ring_stretches
from contour.synthetic import Rendered, render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.tracing.wall_tips import looked_at
from contour.walls.lightness import wall_light
from contour.walls.see_block import see_walls
from contour.walls.wall_evidence import BlockEvidence
from tests.support.scenes.bench_scenes import BenchScene, measured_scenes
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.shop_floor_scenes import KINDS, ShopFloorScene, shop_floor_scene
from tests.support.scenes.trials import calibration_for

CALIBRATED_ON = (985000, 110)
SHOP_FLOOR_ON = (970000, 12)
MEASURED_ON = (992000, 150)
BY_PITCH = (0, 12, 18, 30, 200)
COVERED = (0.93, 0.95)
"""Share of the scenes for calibrating whose bound must hold, of random ones and of those with things on the block."""

_TRIES = 350
_STEP = (0.06, 1.2)


Which = int | str | tuple[str, int]


@dataclass(frozen=True)
class Case:
    """One scene: the bound stated, the true outline's distances from the traced one (px), and the causes of error."""

    name: str
    pitch_px: float
    stated_px: float
    off_px: NDArray[np.float32]
    stretches: Stretches

    @property
    def true_px(self) -> float:
        """95 % of the outline lie within this of the contour."""
        return float(np.percentile(self.off_px, 95))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when every number is reached or coefficients were printed, else 1."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy.uncertainty", description=__doc__)
    parser.add_argument("--calibrate", action="store_true", help="fit the coefficients and print them")
    parser.add_argument("--first", type=int, metavar="SEED", help="seed of the first random scene")
    parser.add_argument("--count", type=int, metavar="N", help="number of random scenes")
    parser.add_argument("--write", action="store_true", help="write plot and numbers to docs/reports/accuracy.md")
    options = parser.parse_args(arguments)
    first, count = CALIBRATED_ON if options.calibrate else MEASURED_ON
    first = first if options.first is None else options.first
    count = count if options.count is None else options.count
    seeds = list(range(first, first + count))
    if options.calibrate:
        begin, number = SHOP_FLOOR_ON
        shop_floor = [(kind, seed) for kind in KINDS for seed in range(begin, begin + number)]
        print(calibrated([_right(run(scenes)[0]) for scenes in (seeds, shop_floor)]))
        return 0
    cases, lost = run([*seeds, *(scene.name for scene in measured_scenes() if scene.scene.edge == "cut")])
    text = told(cases, lost, seeds)
    print(text)
    if options.write:
        write_plot([case.true_px for case in cases], [case.stated_px for case in cases])
        put_section("uncertainty", text)
    return 0 if all(met for *_, met in numbers(cases)) else 1


def _right(cases: Sequence[Case]) -> list[Case]:
    """Those that are nowhere wrong: no bound is meant for the others."""
    return [case for case in cases if case.off_px.max() <= WRONG_PITCHES * case.pitch_px]


def run(scenes: Sequence[Which]) -> tuple[list[Case], list[str]]:
    """Cases of random scenes (seeds), of scenes for measuring (names), and of blocks with things on them (kind and
    seed); and the names of those not traced.
    """
    with ProcessPoolExecutor(max_workers=2) as pool:
        found = list(pool.map(one_case, scenes))
    return [case for case in found if isinstance(case, Case)], [name for name in found if isinstance(name, str)]


def one_case(which: Which) -> Case | str:
    """The case of one scene; its name where it is not traced."""
    if isinstance(which, tuple):
        scene: BenchScene | ShopFloorScene = shop_floor_scene(*which, alone=False)
    else:
        scene = random_scene(which) if isinstance(which, int) else _named(which)
    return case_of(scene, render(scene.scene))


def case_of(scene: BenchScene | ShopFloorScene, rendered: Rendered) -> Case | str:
    """The case of a rendered scene; its name where it is not traced."""
    rectifier = calibration_for(rendered.camera).rectifier(rendered.thickness_mm)
    try:
        traced = trace(rendered.picture, TraceSettings(), rectifier=rectifier)
    except ContourError:
        return scene.name
    if traced.uncertainty_px is None:
        return scene.name
    seen, look = looked_at(
        rendered.picture, see_walls(rendered.picture, wall_light(rendered.picture), "auto"), lambda _name: None
    )
    rings = visible_rings(rendered.picture, seen, look, rectifier)
    places, clear = true_places(rendered)
    off = distances_to(places[clear], rectified_edges(traced.contour, rectifier))
    return Case(
        scene.name,
        rendered.pitch_px,
        traced.uncertainty_px,
        off.astype(np.float32),
        _joined(seen, rings),
    )


def _named(name: str) -> BenchScene:
    return next(scene for scene in measured_scenes() if scene.name == name)


def _joined(seen: BlockEvidence, rings: Sequence[VisibleRing]) -> Stretches:
    """The stretches of all rings."""
    return Stretches.joined(
        [
            ring_stretches(one.evidence, one.fitted, pitch_px=seen.pitch_px, blur_px=seen.blur_px, clipped=seen.clipped)
            for one in rings
        ]
    )


def numbers(cases: Sequence[Case]) -> list[tuple[str, str, str, bool]]:
    """What is asked for, the measure, what was measured, met."""
    held = np.mean([_holds(case) for case in cases])
    ratio = float(np.median([case.stated_px / case.true_px for case in cases]))
    rank = rank_correlation([case.stated_px for case in cases], [case.true_px for case in cases])
    return [
        ("scenes with at least 95 % of the outline within the bound", "≥ 95 %", f"{100 * held:.1f} %", held >= 0.95),
        ("bound over true 95th percentile, median", "1 to 2.5", f"{ratio:.2f}", 1.0 <= ratio <= 2.5),
        ("rank correlation of bound and true 95th percentile", "≥ 0.5", f"{rank:.2f}", rank >= 0.5),
    ]


def told(cases: Sequence[Case], lost: Sequence[str], seeds: Sequence[int]) -> str:
    """The section for docs/reports/accuracy.md."""
    rows = [[what, asked, measured, "yes" if met else "**no**"] for what, asked, measured, met in numbers(cases)]
    worst = sorted(cases, key=lambda case: case.stated_px / case.true_px)[:8]
    over = [
        [case.name, f"{case.pitch_px:.0f}", f"{case.true_px:.2f}", f"{case.stated_px:.2f}", _share(case)]
        for case in worst
    ]
    first, last = CALIBRATED_ON[0], sum(CALIBRATED_ON) - 1
    return "\n".join(
        [
            "## How sure: stated against true error",
            "",
            "By `python -m benchmarks.accuracy.uncertainty --write`: wall-tips on random scenes of seeds "
            f"{seeds[0]} to {seeds[-1]}"
            + f" and on the scenes for measuring with cut edges, {len(cases)} in all"
            + (f"; not traced: {', '.join(lost)}" if lost else "")
            + f". The coefficients were fitted on seeds {first} to {last} and on blocks with things on them; the "
            "others were looked at once, after that.",
            "",
            table(["", "must", "measured", "met"], rows),
            "",
            f"![stated against true error](../pictures/{PLOT.name})",
            "",
            "A point is a scene: across, within how much of the contour 95 % of the true outline lie; upwards, the "
            "bound that was stated with the contour, knowing the picture only. Red: the bound was too small.",
            "",
            "By the cell pitch:",
            "",
            table(["pitch (px)", "scenes", "bound holds", "bound over true 95th, median"], _by_pitch(cases)),
            "",
            "The bounds that were nearest to be exceeded, or were:",
            "",
            table(["scene", "pitch (px)", "true 95th (px)", "bound (px)", "outline within"], over),
        ]
    )


def _by_pitch(cases: Sequence[Case]) -> list[list[str]]:
    rows = []
    for low, high in pairwise(BY_PITCH):
        some = [case for case in cases if low <= case.pitch_px < high]
        if some:
            ratio = np.median([case.stated_px / case.true_px for case in some])
            name = f"{low} to {high}" if high != BY_PITCH[-1] else f"{low} and more"
            rows.append(
                [name, str(len(some)), f"{100 * np.mean([_holds(case) for case in some]):.0f} %", f"{ratio:.2f}"]
            )
    return rows


def _holds(case: Case) -> bool:
    return bool(np.mean(case.off_px <= case.stated_px) >= 0.95)


def _share(case: Case) -> str:
    return f"{100 * np.mean(case.off_px <= case.stated_px):.1f} %"


def rank_correlation(one: Sequence[float], other: Sequence[float]) -> float:
    """Spearman's."""
    ranks = [np.argsort(np.argsort(values)) for values in (one, other)]
    return float(np.corrcoef(*ranks)[0, 1])


def calibrated(groups: Sequence[Sequence[Case]]) -> Coefficients:
    """Coefficients whose bounds hold in `COVERED` of the cases of each group, and are then as near to the true errors
    as they can be.

    Least median ratios less rank correlations, by a random walk downhill from those in use; then all are scaled by one
    factor until the bounds hold.
    """
    rng = np.random.default_rng(1)
    best = Coefficients()
    lowest, _ = _judged(best, groups)
    step = _STEP[1]
    for _ in range(_TRIES):
        tried = _stepped(best, rng, step)
        score, _ = _judged(tried, groups)
        better = score < lowest
        if better:
            best, lowest = tried, score
        step = float(np.clip(step * (1.3 if better else 0.98), *_STEP))
    _, factor = _judged(best, groups)
    return _scaled(best, [factor] * len(fields(best)))


def _stepped(one: Coefficients, rng: np.random.Generator, step: float) -> Coefficients:
    count = len(fields(one))
    return _scaled(one, np.exp(step * rng.normal(size=count) * (rng.random(count) < 0.5)).tolist())


def _scaled(one: Coefficients, factors: Sequence[float]) -> Coefficients:
    names = [part.name for part in fields(one)]
    return replace(one, **{name: getattr(one, name) * factor for name, factor in zip(names, factors, strict=True)})


def _judged(one: Coefficients, groups: Sequence[Sequence[Case]]) -> tuple[float, float]:
    """How bad (less is better), and the factor that makes the bounds hold in `COVERED` of each group's cases."""
    true = [np.array([case.true_px for case in cases]) for cases in groups]
    stated = [np.array([case.stretches.bound(one) for case in cases]) for cases in groups]
    factor = max(
        1.0 / float(np.quantile(bounds / errors, 1.0 - covered))
        for bounds, errors, covered in zip(stated, true, COVERED, strict=True)
    )
    stated = [np.maximum(factor * bounds, LEAST_PX) for bounds in stated]
    scores = [
        float(np.median(bounds / errors)) - rank_correlation(bounds.tolist(), errors.tolist())
        for bounds, errors in zip(stated, true, strict=True)
    ]
    return sum(scores), factor


if __name__ == "__main__":
    sys.exit(main())
