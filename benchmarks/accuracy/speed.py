"""Speed against plain OpenCV and numpy calls on the same picture in the same process."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.synthetic import Rendered
from contour.tracing.binarize import binarize
from contour.tracing.direct_scan import scan_rows
from contour.tracing.find_contours import largest_contour
from contour.tracing.sliding_matrix import fill_windows
from tests.support.scenes.bench_scenes import BenchScene
from tests.support.scenes.trials import run_trial

ROUNDS = 7


@dataclass(frozen=True)
class SpeedRow:
    """Milliseconds of ours and of the yardstick: the least of several rounds each, taken in turn."""

    what: str
    ours_ms: float
    yardstick_ms: float
    stages_ms: dict[str, float] | None = None

    @property
    def ratio(self) -> float:
        """Ours over the yardstick."""
        return self.ours_ms / self.yardstick_ms


def speed_rows(scene: BenchScene, rendered: Rendered, methods: list[str]) -> list[SpeedRow]:
    """Every own method over a median filter, and the paper's methods over the calls they are made of."""
    picture = rendered.picture
    rows = []
    for method in methods:
        yardstick, best = [], None
        for _ in range(ROUNDS):
            yardstick.append(timed(lambda: cv2.medianBlur(picture, 5)))
            trial = run_trial(scene, rendered, method)
            if trial.failure:
                break
            if best is None or trial.total_ms < best.total_ms:
                best = trial
        if best is not None:
            what = f"{method}, all stages but reading : cv2.medianBlur(frame, 5)"
            rows.append(SpeedRow(what, best.total_ms, min(yardstick), best.milliseconds))
    return [*rows, *_paper_rows(picture)]


def _paper_rows(picture: NDArray[np.uint8]) -> list[SpeedRow]:
    mask = binarize(picture, "otsu", "bright").mask

    def plain() -> None:
        cv2.integral(mask)
        cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)

    return [
        _paired(
            "sliding-matrix (core 16, step 8) on the mask : cv2.integral + cv2.findContours",
            lambda: largest_contour(fill_windows(mask, 16, 8, 64.0)),
            plain,
        ),
        _paired(
            "direct-scan on the mask : np.flatnonzero",
            lambda: scan_rows(mask, 60, 60),
            lambda: np.flatnonzero(mask),
        ),
    ]


def _paired(what: str, ours: Callable[[], object], plain: Callable[[], object]) -> SpeedRow:
    """Both calls in turn, so that a busy machine slows both."""
    pairs = [(timed(ours), timed(plain)) for _ in range(ROUNDS)]
    return SpeedRow(what, min(a for a, _ in pairs), min(b for _, b in pairs))


def timed(call: Callable[[], object]) -> float:
    """Milliseconds of one call."""
    start = time.perf_counter()
    call()
    return (time.perf_counter() - start) * 1e3
