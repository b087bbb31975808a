"""What the engine is to reach, beside what this run measured, over all scenes but the `tuned-…` ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.speed import SpeedRow
from tests.support.scenes.bench_scenes import BenchScene
from tests.support.scenes.photographs import PhotographTrial
from tests.support.scenes.trials import Trial

_RANDOM_SCENES = 300
RECTANGLES = ("rectangle-easy", "rectangle-shop", "wide-angle-rectangle", "tilted")


@dataclass(frozen=True)
class Goal:
    """One number: what must be, what is aimed at, what was measured, and whether that is what must be."""

    what: str
    must: str
    aim: str
    measured: str
    met: bool


def goals(
    method: str,
    scenes: Sequence[BenchScene],
    trials: Sequence[Trial],
    speed: Sequence[SpeedRow],
    photo_trials: Sequence[PhotographTrial],
    random_trials: Sequence[Trial],
) -> list[Goal]:
    """All goals for one method, in the order of the accuracy page."""
    labels = {scene.name: scene for scene in scenes if not scene.tuned}
    ours = [trial for trial in trials if trial.method == method and trial.scene in labels]
    rows = _accuracy(ours, labels) if any(trial.agreement for trial in ours) else []
    rows += _failures(ours, labels, random_trials)
    rows += _vertices(ours)
    rows += [
        Goal(
            "all stages but reading, 12 MP, over cv2.medianBlur(frame, 5)",
            "≤ 8 ×",
            "5 ×",
            f"{row.ratio:.1f} ×",
            row.ratio <= 8,
        )
        for row in speed
        if row.what.startswith(f"{method},")
    ]
    return rows + _photographs(method, photo_trials)


def _accuracy(ours: Sequence[Trial], labels: dict[str, BenchScene]) -> list[Goal]:
    found = [(trial, trial.agreement) for trial in ours if trial.agreement is not None]
    mean = float(np.median([a.mean_px for _, a in found]))
    p95 = float(np.median([a.p95_px for _, a in found]))
    bias = float(np.median([a.bias_px for _, a in found]))
    lit = [(t, a.mean_px / max(0.8, 0.03 * t.pitch_px), a.mean_px) for t, a in found if not labels[t.scene].dim]
    dim = [(t, a.mean_px / 1.6, a.mean_px) for t, a in found if labels[t.scene].dim]
    reach, far = max(((a.hausdorff_px / t.pitch_px, t.scene) for t, a in found), default=(0.0, ""))
    rows = [Goal("mean error, median scene", "≤ 0.3 px", "0.15 px", f"{mean:.2f} px", mean <= 0.3)]
    for group, must, aim in ((lit, "≤ max(0.8 px, 0.03 pitch)", "0.5 px"), (dim, "≤ 1.6 px", "–")):
        if group:
            trial, share, value = max(group, key=lambda item: item[1])
            kind = "worst scene" if group is lit else "worst dim scene"
            rows.append(Goal(f"mean error, {kind}", must, aim, f"{value:.2f} px ({trial.scene})", share <= 1.0))
    return [
        *rows,
        Goal("95th percentile, median scene", "≤ 0.7 px", "0.4 px", f"{p95:.2f} px", p95 <= 0.7),
        Goal("Hausdorff, worst scene", "≤ 0.5 pitch", "0.25 pitch", f"{reach:.2f} pitch ({far})", reach <= 0.5),
        Goal("signed bias, median", "within ± 0.1 px", "± 0.03 px", f"{bias:+.2f} px", abs(bias) <= 0.1),
    ]


def _failures(ours: Sequence[Trial], labels: dict[str, BenchScene], random_trials: Sequence[Trial]) -> list[Goal]:
    rows = []
    if ours:
        lost = [trial.scene for trial in ours if trial.agreement is None and labels[trial.scene].traceable]
        told = f"{len(lost)} of {len(ours)}" + (f" ({', '.join(lost)})" if lost else "")
        rows.append(Goal("scenes labelled traceable, refused or failed", "0", "0", told, not lost))
    if random_trials:
        far = [t for t in random_trials if t.agreement is None or t.agreement.hausdorff_px > t.pitch_px]
        what = "random scenes, Hausdorff above one pitch, or failed"
        enough = len(random_trials) >= _RANDOM_SCENES
        rows.append(
            Goal(what, f"0 of {_RANDOM_SCENES}", "0", f"{len(far)} of {len(random_trials)}", enough and not far)
        )
    return rows


def _vertices(ours: Sequence[Trial]) -> list[Goal]:
    sent = {trial.scene: trial.sent for trial in ours if trial.scene in RECTANGLES and trial.agreement}
    if not sent:
        return []
    most = max(sent, key=lambda name: sent[name])
    what = "vertices of a rectangular block at 0.1 mm through a lens, worst"
    return [Goal(what, "≤ 6", "4", f"{sent[most]} ({most})", sent[most] <= 6)]


def _photographs(method: str, photo_trials: Sequence[PhotographTrial]) -> list[Goal]:
    rows = []
    for trial in photo_trials:
        photograph = trial.photograph
        if trial.method != method or not photograph.sure:
            continue
        must, aim = (0.94, "0.96") if photograph.name.startswith("lattice") else (0.96, "0.98")
        iou = trial.agreement.iou if trial.agreement else None
        what = f"IoU, photograph {photograph.name}, --edge {photograph.edge}"
        told = "no contour" if iou is None else f"{iou:.3f}"
        rows.append(Goal(what, f"≥ {must}", aim, told, iou is not None and iou >= must))
    return rows
