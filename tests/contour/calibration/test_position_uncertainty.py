"""Between the map's places and heights the bound is linear; what is no map is refused."""

import numpy as np
import pytest

from contour.calibration.position_uncertainty import PositionUncertainty
from contour.errors import CalibrationError

MAP = np.array([[[1.0, 2.0], [3.0, 4.0]], [[2.0, 4.0], [6.0, 8.0]]])
SURE = PositionUncertainty(101, 51, [0.0, 50.0], [1.5, 3.0], MAP)


def test_the_bound_is_linear_between_places_and_heights() -> None:
    corners = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 50.0], [100.0, 50.0], [50.0, 25.0]])
    np.testing.assert_allclose(SURE.at(corners, 0.0), [1, 2, 3, 4, 2.5])
    np.testing.assert_allclose(SURE.at(corners, 25.0), 1.5 * np.array([1, 2, 3, 4, 2.5]))


def test_beyond_the_heights_the_line_goes_on_and_never_under_zero() -> None:
    assert SURE.figure_mm(100.0) == pytest.approx(4.5)
    assert SURE.figure_mm(-1000.0) == 0.0
    np.testing.assert_allclose(SURE.at(np.array([[0.0, 0.0]]), 100.0), [3.0])


def test_beside_the_picture_its_border_counts() -> None:
    np.testing.assert_allclose(SURE.at(np.array([[-40.0, -9.0], [500.0, 99.0]]), 0.0), [1.0, 4.0])


def test_one_height_serves_for_all() -> None:
    sure = PositionUncertainty(101, 51, [0.0], [1.5], MAP[:1])
    assert sure.figure_mm(60.0) == 1.5
    np.testing.assert_allclose(sure.at(np.array([[100.0, 50.0]]), 60.0), [4.0])


@pytest.mark.parametrize(
    ("heights", "figures", "places", "expected"),
    [
        ([0.0, 0.0], [1.0, 1.0], MAP, "rising"),
        ([0.0], [1.0, 1.0], MAP[:1], "one figure a height"),
        ([0.0], [1.0], MAP, "one figure a height"),
        ([0.0], [1.0], MAP[:1, :1], "at least 2 x 2"),
        ([0.0], [-1.0], MAP[:1], "negative"),
        ([0.0], [np.nan], MAP[:1], "finite"),
    ],
)
def test_what_is_no_map_is_refused(heights: list[float], figures: list[float], places: object, expected: str) -> None:
    with pytest.raises(CalibrationError, match=expected):
        PositionUncertainty(101, 51, heights, figures, places)
