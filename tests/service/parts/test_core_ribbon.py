"""The ribbon of one block: read, told, kept, and drawn along itself."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from contour.calibration.calibration import Alignment, SimpleCalibration
from contour.ribbon.ribbon import Ribbon
from contour.synthetic import CellGeometry, Material, Scene, camera_above, rectangle, render
from service.parts.core_ribbon import CoreRibbon, core_ribbon
from tests.support.scenes.trials import calibration_for

CAMERA = camera_above(640, 480, 0.25)
CELLS = CellGeometry(pitch_mm=5.0, wall_mm=0.45, doubled=2.0, ribbon_deg=17.0)
RENDERED = render(
    Scene(rectangle((80.0, 60.0), 110.0, 85.0, 12.0), CAMERA, CELLS, material=Material(sheen=0.0), seed=5)
)
CALIBRATION = replace(calibration_for(CAMERA), alignment=Alignment(30.0, (500.0, 0.0)))


def test_the_direction_is_the_machine_frames_and_the_line_lies_along_it_in_the_block() -> None:
    height_mm = RENDERED.thickness_mm
    seen = core_ribbon(
        RENDERED.picture,
        RENDERED.truth_px,
        RENDERED.pitch_px,
        bright=True,
        calibration=CALIBRATION,
        height_mm=height_mm,
    )
    assert seen.told.angle_deg == pytest.approx(47.0, abs=0.5)
    assert seen.line_px is not None
    ends = CALIBRATION.to_machine(CALIBRATION.to_work(np.array(seen.line_px), height_mm))
    along = math.degrees(math.atan2(*(ends[1] - ends[0])[::-1].tolist()))
    assert along == pytest.approx(seen.told.angle_deg, abs=0.1)
    middle = RENDERED.truth_px.exterior.mean(axis=0)
    assert np.abs(np.array(seen.line_px).mean(axis=0) - middle).max() < 10


def test_a_scale_alone_is_enough_for_a_camera_that_looks_down() -> None:
    flat = SimpleCalibration(640, 480, 0.25, (0.0, 479.0))
    seen = core_ribbon(
        RENDERED.picture, RENDERED.truth_px, RENDERED.pitch_px, bright=True, calibration=flat, height_mm=20.0
    )
    assert seen.told.angle_deg == pytest.approx(17.0, abs=0.5)
    assert seen.words.startswith("ribbon at 17.")


@pytest.mark.parametrize(
    "ribbon",
    [
        CoreRibbon(Ribbon(47.25, 0.5, "walls and cells"), ((1.5, 2.0), (30.0, 4.25))),
        CoreRibbon(Ribbon(why="too few walls are seen between the cells")),
    ],
)
def test_what_is_kept_is_the_ribbon_again(ribbon: CoreRibbon) -> None:
    assert CoreRibbon.of_kept(json.loads(json.dumps(ribbon.kept()))) == ribbon


def test_what_is_not_told_is_null_with_the_reason() -> None:
    fields = CoreRibbon(Ribbon(why="no cells")).fields()
    assert fields == {"angle_deg": None, "bound_deg": None, "told_by": None, "why": "no cells"}
