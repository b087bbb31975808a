"""docs/reports/calibration-accuracy.md from one run's numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.calibration.bumps import TOLERANCE_PX, Bumps
from benchmarks.calibration.trials import HEIGHTS_MM, VIEWS, ChainTrial, Trial

HEAD = """\
# Accuracy of calibrations

This page is written by `{command}`; do not edit it by hand.

Boards (11x8 squares of 30 mm) are rendered by exact area coverage through cameras that are known exactly: {views} views
of 1600 × 1200 px over a table 600 mm wide, the camera 1.0 to 1.4 m up, tilted by up to 3°, k1 −0.15 to −0.09, k2, p1
and p2 at random, blur 0.7 px and sensor noise. Pixels inside the area that corners cover become millimetres, and are
compared with where they truly look. What rendering does not have: a board that is bent or wrongly scaled by its
printer, a camera that warms up, a lens beyond these models. Those errors come on top and are not in any figure here or
in the file: the ruler on the sheet, the tape (`--camera-height-mm`) and the master part (`combtrace verify`) are for
them.

## Stated against true

*Figure*: the one 95 % bound of a calibration for a height (in the file: `figure_mm`); *map*: its bound for each place.
Both hold for so many of all places of all cameras. All in mm.

"""


def page(campaigns: dict[str, list[Trial]], chain: Sequence[ChainTrial], bumps: Bumps, command: str) -> str:
    """The page's text."""
    text = HEAD.format(command=command, views=VIEWS)
    text += _stated(campaigns)
    text += "\n## Goals\n\n" + _goals(campaigns, chain, bumps)
    text += "\n## Each camera, boards tilted to 8°, on the table\n\n" + _each(next(iter(campaigns.values())))
    text += (
        "\n## The whole chain\n\nCalibrated from views tilted to 20°, then a rendered honeycomb block traced by "
        "wall-tips and turned into millimetres; distances to its true outline, both ways, mm. 0.375 mm a pixel on the "
        "table.\n\n"
    )
    text += _chain(chain)
    return text + "\n## Fixed marks\n\n" + _bumps(bumps)


def _stated(campaigns: dict[str, list[Trial]]) -> str:
    lines = [
        "| views | height | cameras | mean error | true 95 % | worst | figure, median | figure / true 95 % "
        "| figure holds | map holds |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for name, trials in campaigns.items():
        for index, height in enumerate(HEIGHTS_MM):
            errors, bounds, figures = _pooled(trials, index)
            true = float(np.percentile(errors, 95))
            lines.append(
                f"| {name} | {height:g} | {len(trials)} | {errors.mean():.4f} | {true:.4f} | {errors.max():.4f} | "
                f"{np.median(figures):.4f} | {np.median(figures) / true:.1f} | "
                f"{100 * (errors <= figures).mean():.1f} % | {100 * (errors <= bounds).mean():.1f} % |"
            )
    return "\n".join(lines) + "\n"


def _pooled(trials: Sequence[Trial], index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    errors = np.concatenate([one.errors_mm[index] for one in trials])
    bounds = np.concatenate([one.bounds_mm[index] for one in trials])
    figures = np.concatenate([np.full(len(one.errors_mm[index]), one.figures_mm[index]) for one in trials])
    return errors, bounds, figures


def _goals(campaigns: dict[str, list[Trial]], chain: Sequence[ChainTrial], bumps: Bumps) -> str:
    tilted = next(iter(campaigns.values()))
    errors, _, _ = _pooled(tilted, 0)
    holds, ratios = [], []
    for trials in campaigns.values():
        for index in range(len(HEIGHTS_MM)):
            seen, _, figures = _pooled(trials, index)
            holds.append(float((seen <= figures).mean()))
            ratios.append(float(np.median(figures) / np.percentile(seen, 95)))
    worst_chain = max(one.mean_mm for one in chain)
    rows = [
        ("mean error on the table, boards tilted to 8°", "≤ 0.02 mm", f"{errors.mean():.4f} mm", errors.mean() <= 0.02),
        ("worst error there", "≤ 0.06 mm", f"{errors.max():.4f} mm", errors.max() <= 0.06),
        ("stated 95 % figure holds, all rows above", "≥ 95 %", f"{100 * min(holds):.1f} % or more", min(holds) >= 0.95),
        ("stated figure over the true 95 %", "≤ 3", f"{max(ratios):.1f} or less", max(ratios) <= 3),
        ("whole chain, mean, worst of all", "≤ 0.15 mm", f"{worst_chain:.3f} mm", worst_chain <= 0.15),
        (
            f"bumps of 0.3° and of 2 px caught, {2 * bumps.tried} tried",
            "all",
            f"{bumps.turns_caught + bumps.shifts_caught}",
            bumps.turns_caught + bumps.shifts_caught == 2 * bumps.tried,
        ),
        (f"alarms in {bumps.repeats} noisy repeats", "0", f"{bumps.alarms}", bumps.alarms == 0),
    ]
    lines = ["| | must | measured | met |", "|---|--:|--:|--:|"]
    lines += [f"| {name} | {goal} | {seen} | {'yes' if met else '**no**'} |" for name, goal, seen, met in rows]
    return "\n".join(lines) + "\n"


def _each(trials: Sequence[Trial]) -> str:
    lines = [
        "| camera | lens model taken | views | true mean | true 95 % | worst | stated | halves over noise | verdict |",
        "|--:|---|--:|--:|--:|--:|--:|--:|---|",
    ]
    for one in trials:
        errors = one.errors_mm[0]
        lines.append(
            f"| {one.seed} | {one.model} | {one.views} | {errors.mean():.4f} | {np.percentile(errors, 95):.4f} | "
            f"{errors.max():.4f} | {one.figures_mm[0]:.4f} | {one.inflation:.2f} | {one.judgement.lower()} |"
        )
    return "\n".join(lines) + "\n"


def _chain(chain: Sequence[ChainTrial]) -> str:
    lines = ["| camera | block | thickness | mean | 95 % | worst |", "|--:|---|--:|--:|--:|--:|"]
    lines += [
        f"| {one.seed} | {one.shape} | {one.thickness_mm:g} | {one.mean_mm:.3f} | {one.p95_mm:.3f} | "
        f"{one.worst_mm:.3f} |"
        for one in chain
    ]
    return "\n".join(lines) + "\n"


def _bumps(bumps: Bumps) -> str:
    return (
        f"Four ArUco marks of 24 mm at the table's corners, tolerance {TOLERANCE_PX:g} px.\n\n"
        f"- turned by 0.3° about any axis: {bumps.turns_caught} of {bumps.tried} caught, the least seen as "
        f"{bumps.least_turn_px:.1f} px\n"
        f"- shifted by 2 px in any direction: {bumps.shifts_caught} of {bumps.tried} caught, the least seen as "
        f"{bumps.least_shift_px:.2f} px\n"
        f"- noisy repeats: {bumps.alarms} of {bumps.repeats} raised an alarm, the largest offset "
        f"{bumps.largest_still_px:.3f} px\n"
        f"- a look at 4000 × 3000 px takes {bumps.look_ms:.1f} ms of one core (median)\n"
    )
