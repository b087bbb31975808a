"""Tables of trials as Markdown, for the terminal and for docs/reports/accuracy.md."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.accuracy.goals import Goal
from benchmarks.accuracy.speed import SpeedRow
from benchmarks.page_section import table
from tests.support.scenes.bench_scenes import BenchScene
from tests.support.scenes.metrics import Agreement
from tests.support.scenes.photographs import PhotographTrial
from tests.support.scenes.trials import Trial, stages


def goal_table(goals: Sequence[Goal]) -> str:
    """Goals beside what was measured."""
    rows = [[goal.what, goal.must, goal.aim, goal.measured, "yes" if goal.met else "**no**"] for goal in goals]
    return table(["", "must", "aim", "measured", "met"], rows)


def summary(trials: Sequence[Trial], scenes: Sequence[BenchScene]) -> str:
    """One line a method: medians and worst cases over the scenes given."""
    names = {scene.name for scene in scenes}
    dim = {scene.name for scene in scenes if scene.dim}
    chosen = [trial for trial in trials if trial.scene in names]
    rows = []
    for method in dict.fromkeys(trial.method for trial in chosen):
        ours = [trial for trial in chosen if trial.method == method]
        good = [trial for trial in ours if trial.agreement is not None]
        lit = [trial for trial in good if trial.scene not in dim]
        if not good:
            rows.append([method, *["–"] * 9, str(len(ours))])
            continue
        rows.append(
            [
                method,
                _f(np.median([_of(t).mean_px for t in good])),
                _f(max((_of(t).mean_px for t in lit), default=np.nan)),
                _f(max((_of(t).mean_px for t in good if t.scene in dim), default=np.nan)),
                _f(np.median([_of(t).p95_px for t in good])),
                _f(np.median([_of(t).hausdorff_px / t.pitch_px for t in good])),
                _f(max(_of(t).hausdorff_px / t.pitch_px for t in good)),
                _f(np.median([_of(t).bias_px for t in good]), "+.2f"),
                _f(np.median([_of(t).iou for t in good]), ".4f"),
                _f(np.median([t.total_ms for t in good]), ".0f"),
                str(len(ours) - len(good)),
            ]
        )
    head = [
        "method",
        "mean error, median scene (px)",
        "worst scene",
        "worst dim scene",
        "95th percentile, median",
        "Hausdorff, median (pitch)",
        "Hausdorff, worst",
        "bias, median (px)",
        "IoU, median",
        "ms, median",
        "no contour",
    ]
    return table(head, rows)


def details(trials: Sequence[Trial], method: str) -> str:
    """One line a scene for one method."""
    rows = []
    for trial in trials:
        if trial.method != method:
            continue
        found = trial.agreement
        if found is None:
            rows.append([trial.scene, f"{trial.pitch_px:.0f}", *["–"] * 8, "–", trial.failure.split(".")[0]])
            continue
        rows.append(
            [
                trial.scene,
                f"{trial.pitch_px:.0f}",
                _f(found.mean_px),
                _f(found.p95_px),
                _f(found.hausdorff_px),
                _f(found.hausdorff_px / trial.pitch_px),
                _f(found.bias_px, "+.2f"),
                _f(found.iou, ".4f"),
                str(found.vertices),
                str(trial.sent),
                "–" if trial.uncertainty_px is None else _f(trial.uncertainty_px),
                stages(trial),
            ]
        )
    head = [
        "scene",
        "pitch (px)",
        "mean (px)",
        "95th (px)",
        "Hausdorff (px)",
        "in pitches",
        "bias (px)",
        "IoU",
        "vertices",
        "sent at 0.1 mm",
        "own bound (px)",
        "ms by stage",
    ]
    return table(head, rows)


def speed(rows: Sequence[SpeedRow]) -> str:
    """Ours beside the yardstick."""
    lines = []
    for row in rows:
        parts = " + ".join(f"{name} {value:.0f}" for name, value in (row.stages_ms or {}).items())
        lines.append(
            [row.what, _f(row.ours_ms, ".1f"), _f(row.yardstick_ms, ".1f"), _f(row.ratio, ".1f"), parts or "–"]
        )
    return table(["what : yardstick", "ms", "yardstick, ms", "times", "by stage, ms"], lines)


def photos(trials: Sequence[PhotographTrial]) -> str:
    """One line a photograph and method."""
    lines = []
    for trial in trials:
        found, head = trial.agreement, [trial.photograph.name, trial.photograph.edge, trial.method]
        if found is None:
            lines.append([*head, *["–"] * 4, trial.failure.split(".")[0]])
            continue
        numbers = [_f(found.iou, ".4f"), _f(found.mean_px), _f(found.hausdorff_px, ".1f"), _f(found.bias_px, "+.2f")]
        lines.append([*head, *numbers, _f(trial.total_ms, ".0f")])
    return table(["photograph", "--edge", "method", "IoU", "mean (px)", "Hausdorff (px)", "bias (px)", "ms"], lines)


def random_summary(trials: Sequence[Trial], dim: set[str]) -> str:
    """What became of the random scenes, and the worst ten by name."""
    good = [trial for trial in trials if trial.agreement is not None]
    failed = [trial for trial in trials if trial.agreement is None]
    far = [trial for trial in good if _of(trial).hausdorff_px > trial.pitch_px]
    lines = [
        f"{len(trials)} scenes: {len(failed)} without a contour, {len(far)} with a Hausdorff distance above one pitch.",
    ]
    if good:
        means = np.array([_of(trial).mean_px for trial in good])
        reach = np.array([_of(trial).hausdorff_px / trial.pitch_px for trial in good])
        bias = float(np.median([_of(trial).bias_px for trial in good]))
        lines.append(
            f"Mean error: median {np.median(means):.2f}, 95th percentile {np.percentile(means, 95):.2f}, worst "
            f"{means.max():.2f} px. Hausdorff: median {np.median(reach):.2f}, 95th percentile "
            f"{np.percentile(reach, 95):.2f}, worst {reach.max():.2f} pitches. Bias: median {bias:+.2f} px."
        )
    worst = sorted(good, key=lambda trial: -_of(trial).hausdorff_px / trial.pitch_px)[:10]
    rows = [
        [
            trial.scene + (" (dim)" if trial.scene in dim else ""),
            f"{trial.pitch_px:.0f}",
            _f(_of(trial).mean_px),
            _f(_of(trial).hausdorff_px / trial.pitch_px),
        ]
        for trial in worst
    ]
    rows += [
        [t.scene + (" (dim)" if t.scene in dim else ""), f"{t.pitch_px:.0f}", "–", t.failure.split(".")[0]]
        for t in failed
    ]
    lines += ["", table(["worst scenes", "pitch (px)", "mean (px)", "Hausdorff (pitch)"], rows)]
    return "\n".join(lines)


def _of(trial: Trial) -> Agreement:
    if trial.agreement is None:
        raise ValueError(f"{trial.scene}, {trial.method}: no contour to tell of; expected one that was found")
    return trial.agreement


def _f(value: float | np.floating, form: str = ".2f") -> str:
    return "–" if np.isnan(value) else format(float(value), form)
