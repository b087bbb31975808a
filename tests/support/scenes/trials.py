"""One method on one picture: how far it lies from the truth, and how long each stage took."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from contour.acceptance.trace_check import check_trace
from contour.calibration.calibration import CameraCalibration
from contour.errors import ContourError, ParameterError
from contour.geometry.rings import Contour
from contour.polygon.polygon import cutting_polygon
from contour.synthetic import CameraModel, Rendered
from contour.tracing.trace import Method, Trace, TraceSettings
from contour.tracing.tracing import trace
from service.config.plain_recipe import PlainRecipe
from service.config.recipes import AnyRecipe
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from tests.support.scenes.bench_scenes import BenchScene
from tests.support.scenes.metrics import Agreement, agreement
from tests.support.scenes.rivals import RIVALS, Hints, RivalFailed

TOLERANCE_MM = 0.1
OWN_METHODS: tuple[Method, ...] = get_args(Method)
_RECTIFIED = "wall-tips"
_STAGES = ("mask", "trace", "convert", "simplify")


@dataclass(frozen=True)
class Trial:
    """What a method made of a picture. `failure` is empty where there is a contour.

    `sent` counts the vertices of the cutting polygon at 0.1 mm (its own vertices for ready-made ways).
    """

    scene: str
    method: str
    pitch_px: float
    agreement: Agreement | None = None
    sent: int = 0
    milliseconds: dict[str, float] = field(default_factory=dict)
    failure: str = ""
    contour: Contour | None = None
    uncertainty_px: float | None = None

    @property
    def total_ms(self) -> float:
        """All stages together."""
        return sum(self.milliseconds.values())


def traced_with_lens(rendered: Rendered) -> Trace:
    """What wall-tips traces in a picture, with the lens of its camera."""
    rectifier = calibration_for(rendered.camera).rectifier(rendered.thickness_mm)
    return trace(rendered.picture, TraceSettings(), rectifier=rectifier)


def measured(rendered: Rendered, recipe: AnyRecipe | None = None) -> Measurement:
    """What the service makes of a picture, with the calibration of its camera."""
    measurer = Measurer(calibration_for(rendered.camera))
    return measurer.measure(rendered.picture, recipe or PlainRecipe(), rendered.thickness_mm)


def calibration_for(camera: CameraModel) -> CameraCalibration:
    """The calibration a user would have of this camera, free of error."""
    return CameraCalibration(
        camera.width,
        camera.height,
        camera.matrix,
        np.array(camera.distortion),
        np.array(camera.rotation_vector),
        np.array(camera.translation_mm),
    )


def available_methods(wanted: tuple[str, ...] = ()) -> tuple[list[str], list[str]]:
    """Names that can be run, own ones first, and own ones that this version does not have."""
    there: list[str] = []
    missing: list[str] = []
    for name in OWN_METHODS:
        try:
            trace(np.zeros((8, 8), dtype=np.uint8), TraceSettings(method=name))
        except ParameterError as error:
            (missing if "method is" in str(error) else there).append(name)
            continue
        except ContourError:
            pass
        there.append(name)
    names = [*there, *RIVALS]
    return [name for name in names if not wanted or name in wanted], missing


def run_trial(scene: BenchScene, rendered: Rendered, method: str) -> Trial:
    """Run one method on a rendered scene; a refusal becomes the trial's failure."""
    if method in RIVALS:
        return _rival_trial(scene, rendered, method)
    calibration = calibration_for(rendered.camera)
    watch = Stopwatch()
    own = next(name for name in OWN_METHODS if name == method)
    settings = TraceSettings(method=own, edge=scene.scene.edge)
    rectifier = calibration.rectifier(rendered.thickness_mm)
    watch.restart()
    try:
        found = trace(rendered.picture, settings, rectifier=rectifier, on_stage=watch.lap)
        check_trace(rendered.picture, found, rectifier)
        watch.lap("quality")
        polygon = cutting_polygon(
            found.contour,
            calibration,
            height_mm=rendered.thickness_mm,
            tolerance_mm=TOLERANCE_MM,
            on_stage=watch.lap,
        )
    except ContourError as error:
        return Trial(scene.name, method, rendered.pitch_px, milliseconds=watch.milliseconds, failure=str(error))
    measured = agreement(
        found.contour,
        rendered.truth_px,
        rectifier=rectifier if method == _RECTIFIED and settings.edge == "cut" else None,
    )
    return Trial(
        scene.name,
        method,
        rendered.pitch_px,
        measured,
        polygon.pixels.point_count,
        watch.milliseconds,
        contour=found.contour,
        uncertainty_px=found.uncertainty_px,
    )


def _rival_trial(scene: BenchScene, rendered: Rendered, method: str) -> Trial:
    dark = scene.scene.material.top < scene.scene.table.level
    watch = Stopwatch()
    watch.restart()
    try:
        contour = RIVALS[method](rendered.picture, Hints(rendered.pitch_px, dark))
    except RivalFailed as error:
        return Trial(scene.name, method, rendered.pitch_px, failure=str(error))
    watch.lap("trace")
    measured = agreement(contour, rendered.truth_px)
    return Trial(
        scene.name, method, rendered.pitch_px, measured, contour.point_count, watch.milliseconds, contour=contour
    )


class Stopwatch:
    """Times of stages as they end one after another, milliseconds."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self._last = clock()
        self.milliseconds: dict[str, float] = {}

    def restart(self) -> None:
        """Forget what ran until now."""
        self._last = self._clock()
        self.milliseconds = {}

    def lap(self, stage: str) -> None:
        """The stage that ran since the last lap has ended."""
        now = self._clock()
        self.milliseconds[stage] = self.milliseconds.get(stage, 0.0) + (now - self._last) * 1e3
        self._last = now


def stages(trial: Trial) -> str:
    """Milliseconds by stage as `mask 12 + trace 30 + …`."""
    named = [f"{name} {trial.milliseconds[name]:.1f}" for name in _STAGES if name in trial.milliseconds]
    return " + ".join(named) or "–"
