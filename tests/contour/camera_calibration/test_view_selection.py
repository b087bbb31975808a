"""What views that are not all there yet are good for, and what they lack."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from contour.camera_calibration.view_selection import SIDES, Side, judge_so_far
from contour.synthetic.board_poses import BoardPose
from tests.support.pictures.board_scenes import CAMERA, CHARUCO, FLAT, noisy_view, noisy_views

SIZE = (CAMERA.width, CAMERA.height)
MIDDLE = np.array([300.0, 225.0, 60.0])
# Turns about the table's axes, x right and y up: what stands higher then, as the camera sees it.
RAISED = {"left": (0.0, 15.0), "right": (0.0, -15.0), "top": (15.0, 0.0), "bottom": (-15.0, 0.0)}


def tilted(x_deg: float, y_deg: float) -> BoardPose:
    """The board over the table's middle, turned about x and y."""
    rotation = cv2.Rodrigues(np.radians([x_deg, y_deg, 0.0]))[0]
    return BoardPose(rotation, MIDDLE - rotation @ np.array([*CHARUCO.size_mm, 0.0]) / 2)


@pytest.mark.parametrize("side", SIDES)
def test_a_board_raised_at_one_side_is_told_by_that_side_of_the_picture(side: Side) -> None:
    rng = np.random.default_rng(7)
    x, y = RAISED[side]
    poses = [FLAT, tilted(x, y), tilted(1.6 * x, 1.6 * y), tilted(1.3 * x, 1.3 * y)]
    views = [noisy_view(str(n), CHARUCO, CAMERA, pose, rng) for n, pose in enumerate(poses)]
    found = judge_so_far(views, CHARUCO, SIZE, "0")
    assert found.raised == {side}
    assert found.fault is not None
    assert "4 can be used, 8 or more are needed" in found.fault


def test_views_to_all_sides_that_are_enough_have_no_fault() -> None:
    views, _ = noisy_views(count=14)
    found = judge_so_far(views, CHARUCO, SIZE, "00")
    assert found.fault is None
    assert found.raised == set(SIDES)
    assert len(found.kept) == 14


def test_a_blurred_view_and_a_twin_are_dropped_by_name() -> None:
    views, _ = noisy_views(count=9)
    views[3] = replace(views[3], edge_sigma_px=5.0)
    found = judge_so_far([*views, replace(views[5], name="again")], CHARUCO, SIZE, "00")
    assert {one.name: one.reason.partition(":")[0] for one in found.dropped} == {
        "03": "blurred",
        "again": "a duplicate",
    }
    assert found.fault is None


def test_without_the_flat_view_no_side_is_told_and_nothing_at_all_is_no_error() -> None:
    views, _ = noisy_views(count=6)
    assert judge_so_far(views[1:], CHARUCO, SIZE, "00").raised == set()
    nothing = judge_so_far([], CHARUCO, SIZE, "")
    assert nothing.kept == ()
    assert nothing.fault is not None
