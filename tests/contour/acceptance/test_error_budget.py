"""Parts of a contour's uncertainty in millimetres: each by a law of its own, together a root of squares."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.acceptance.error_budget import ErrorBudget, error_budget
from contour.calibration.calibration import SimpleCalibration
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.geometry.rings import Contour
from tests.support.pictures.cameras import camera
from tests.support.pictures.rings import SQUARE

SIMPLE = SimpleCalibration(1600, 1200, 0.375, (100.0, 1100.0))
OUTLINE = Contour(SQUARE * [40, 30] + [300, 400])


def budget(calibration, *, thickness_tolerance_mm: float = 0.0, uncertainty_px: float | None = 1.0, height=0.0):
    return error_budget(
        OUTLINE,
        calibration,
        height_mm=height,
        thickness_tolerance_mm=thickness_tolerance_mm,
        uncertainty_px=uncertainty_px,
        mm_per_px=0.375,
    )


def test_the_picture_alone_counts_where_nothing_else_is_stated() -> None:
    assert budget(SIMPLE, uncertainty_px=2.0) == ErrorBudget(0.75, 0.0, None)
    assert budget(SIMPLE, uncertainty_px=2.0).total_mm == 0.75


def test_what_the_calibration_states_of_itself_joins_by_squares() -> None:
    stated = replace(SIMPLE, uncertainty=PositionUncertainty.everywhere(1600, 1200, 0.5))
    assert budget(stated, uncertainty_px=3.2).total_mm == pytest.approx(1.3)


@given(st.floats(0.1, 20.0))
def test_a_wrong_height_shifts_by_its_share_of_the_way_to_the_camera(tolerance: float) -> None:
    """Under a camera 1 m up, a point r away from below it moves by about r · tolerance / (1 m − height)."""
    calibration = camera()
    points = calibration.to_work(OUTLINE.exterior, 20.0)
    reach = np.hypot(*(points - [300.0, 200.0]).T).max()
    found = budget(calibration, height=20.0, thickness_tolerance_mm=tolerance).thickness_mm
    assert found == pytest.approx(reach * tolerance / 980.0, rel=1e-6)


def test_an_unknown_part_makes_the_whole_unknown() -> None:
    """Nobody computed it in pixels; one scale carried over to a height where it was not measured."""
    assert budget(SIMPLE, uncertainty_px=None) is None
    assert budget(SIMPLE, height=20.0) is None
    assert budget(SIMPLE, thickness_tolerance_mm=1.0) is None
