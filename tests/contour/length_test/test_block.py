"""A traced block: the distances between its sides, and what of its outline counts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.calibration.calibration import SimpleCalibration
from contour.errors import GaugeNotSeen
from contour.geometry.arrays import Float64s
from contour.length_test.block import seen_block

CALIBRATION = SimpleCalibration(1600, 1200, 0.25, (0.0, 1200.0))
NAMES, SIZES = ("long", "short"), (200.0, 120.0)


def ring_px(corners_mm: list[tuple[float, float]], turn_deg: float = 0.0, roll: int = 0) -> Float64s:
    """The corners around (200, 150) mm, turned, in pixels."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turned = np.array(corners_mm) @ np.array([[c, s], [-s, c]]) + [200.0, 150.0]
    return np.roll(CALIBRATION.to_pixels(turned, 0.0), roll, axis=0)


RECTANGLE = [(-100.0, -60.0), (100.0, -60.0), (100.0, 60.0), (-100.0, 60.0)]


@settings(max_examples=40)
@given(turn_deg=st.floats(-180.0, 180.0), roll=st.integers(0, 3))
def test_a_rectangle_has_its_two_sizes_however_it_lies(turn_deg: float, roll: int) -> None:
    seen = seen_block(ring_px(RECTANGLE, turn_deg, roll), NAMES, SIZES, CALIBRATION, 0.0)
    assert [one.measured_mm for one in seen.lengths] == pytest.approx(SIZES, abs=1e-6)
    along = (seen.lengths[0].direction_deg - turn_deg + 90.0) % 180.0 - 90.0
    assert along == pytest.approx(0.0, abs=1e-6)
    assert max(line.form_mm for line in seen.lines) < 1e-6


def test_broken_corners_do_not_count() -> None:
    octagon = [(-95, -60), (95, -60), (100, -55), (100, 55), (95, 60), (-95, 60), (-100, 55), (-100, -55)]
    seen = seen_block(ring_px([(float(x), float(y)) for x, y in octagon]), NAMES, SIZES, CALIBRATION, 0.0)
    assert [one.measured_mm for one in seen.lengths] == pytest.approx(SIZES, abs=1e-6)


def test_a_side_that_runs_askew_is_measured_in_its_middle_and_is_straight() -> None:
    askew = [(-100.0, -60.0), (100.0, -60.0), (101.0, 60.0), (-100.0, 60.0)]
    seen = seen_block(ring_px(askew), NAMES, SIZES, CALIBRATION, 0.0)
    assert seen.lengths[0].measured_mm == pytest.approx(200.5, abs=0.02)
    assert max(line.form_mm for line in seen.lines) < 1e-6


@pytest.mark.parametrize(("wide", "least", "most"), [(30.0, 2.0, 2.3), (3.0, 0.0, 0.1)])
def test_a_step_in_a_side_is_a_form_error_unless_it_is_a_twentieth_of_it(
    wide: float, least: float, most: float
) -> None:
    # A step beside the middle turns the line of least squares a little: more than its own 2 mm are seen.
    stepped = [(-100.0, -60.0), (100.0, -60.0), (100.0, 60.0), (wide, 60.0), (wide, 58.0), (0.0, 58.0), (0.0, 60.0)]
    seen = seen_block(ring_px([*stepped, (-100.0, 60.0)]), NAMES, SIZES, CALIBRATION, 0.0)
    form = {line.name: line.form_mm for line in seen.lines}
    assert least <= form["top"] <= most
    assert form["bottom"] < 1e-6


def test_another_block_and_another_shape_are_refused() -> None:
    with pytest.raises(GaugeNotSeen, match=r"200\.0 mm where length long is 20 mm: another block, or .* another unit"):
        seen_block(ring_px(RECTANGLE), NAMES, (20.0, 12.0), CALIBRATION, 0.0)
    triangle = [(-100.0, -60.0), (100.0, -60.0), (0.0, 60.0)]
    with pytest.raises(GaugeNotSeen, match="no four straight sides"):
        seen_block(ring_px(triangle), NAMES, SIZES, CALIBRATION, 0.0)
