"""A wall's end is found where the material stops, whatever the wall's width, the blur and the angle of the cut."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.walls.end_profile import EndModel, centred_axes, fit_ends, true_width

SIZE, SUPER = 64, 8


def cut_wall(
    width: float, angle_deg: float, cut_deg: float, blur: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A wall that comes from one side and is cut by a line through the picture's middle: picture, end, axis, cut's
    normal.
    """
    end = np.array([31.3, 32.6])
    axis = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    turned = np.radians(angle_deg + cut_deg)
    normal = np.array([np.cos(turned), np.sin(turned)])
    place = (np.arange(SIZE * SUPER) + 0.5) / SUPER - 0.5
    x, y = np.meshgrid(place - end[0], place - end[1])
    wall = (np.abs(-axis[1] * x + axis[0] * y) < width / 2) & (normal[0] * x + normal[1] * y < 0)
    cover = wall.reshape(SIZE, SUPER, SIZE, SUPER).mean(axis=(1, 3))
    picture = 40 + 150 * cv2.GaussianBlur(cover, (0, 0), blur)
    return np.rint(picture).astype(np.uint8), end, axis, normal


def model(width: float, blur: float) -> EndModel:
    return EndModel(width=width, blur=blur, height=None, noise=1.0, reach=10.0, out=6.0, sign=1.0)


@settings(max_examples=60, deadline=None)
@given(
    width=st.floats(1.5, 9.0),
    angle=st.floats(0.0, 360.0),
    cut=st.floats(-50.0, 50.0),
    blur=st.floats(0.5, 1.6),
)
def test_the_end_of_a_cut_wall_is_on_the_cut_within_a_tenth_of_a_pixel(
    width: float, angle: float, cut: float, blur: float
) -> None:
    picture, end, axis, normal = cut_wall(width, angle, cut, blur)
    start = (end + 0.7 * axis)[None]
    found = fit_ends(picture, start, axis[None], normal[None], model(width, blur))
    assert abs(float((found.point[0] - end) @ normal)) < 0.1


def test_a_guess_beside_the_wall_is_moved_onto_its_middle() -> None:
    picture, end, axis, _ = cut_wall(5.0, 25.0, 10.0, 0.8)
    across = np.array([-axis[1], axis[0]])
    askew = axis + 0.15 * across
    askew /= np.linalg.norm(askew)
    tip, turned = centred_axes(
        picture, (end + 1.2 * across)[None], askew[None], wall=5.0, straight=np.array([20.0]), sign=1.0
    )
    assert abs(float((tip[0] - end) @ across)) < 0.2
    assert float(turned[0] @ axis) > np.cos(np.radians(2.0))


@pytest.mark.parametrize("blur", [0.6, 1.0, 1.5])
def test_the_blur_is_read_from_the_end_of_a_wall(blur: float) -> None:
    picture, end, axis, normal = cut_wall(7.0, 40.0, 0.0, blur)
    found = fit_ends(picture, end[None], axis[None], normal[None], replace(model(7.0, 0.9), blur_free=True))
    # The pixel's own square and bilinear sampling add to it.
    assert found.blur[0] == pytest.approx(np.hypot(blur, 0.45), abs=0.12)


def test_dark_walls_are_fitted_like_bright_ones() -> None:
    picture, end, axis, normal = cut_wall(4.0, 10.0, 20.0, 0.8)
    dark = EndModel(width=4.0, blur=0.9, height=None, noise=1.0, reach=10.0, out=6.0, sign=-1.0)
    bright = fit_ends(picture, end[None], axis[None], normal[None], model(4.0, 0.9))
    inverted = fit_ends(255 - picture, end[None], axis[None], normal[None], dark)
    assert np.allclose(bright.point, inverted.point, atol=1e-6)


@pytest.mark.parametrize("reach", [0.5, 1.0])
def test_profiles_no_longer_than_a_pixel_behind_the_tip_are_fitted_too(reach: float) -> None:
    """As of walls of one pixel, which ended a job in an error."""
    picture, end, axis, normal = cut_wall(1.2, 25.0, 0.0, 0.6)
    found = fit_ends(picture, end[None], axis[None], normal[None], replace(model(1.0, 0.6), reach=reach))
    assert abs(float((found.point[0] - end) @ normal)) < 1.0


@pytest.mark.parametrize("width", [1.5, 3.0, 6.0])
def test_the_true_width_of_a_blurred_wall_comes_back(width: float) -> None:
    place = np.linspace(-12, 12, 4801)
    profile = cv2.GaussianBlur((np.abs(place) < width / 2).astype(np.float64)[None], (0, 0), 1.0 / 0.005)[0]
    seen = np.ptp(place[profile > 0.5 * profile.max()])
    assert true_width(seen, 1.0) == pytest.approx(width, abs=0.35)
