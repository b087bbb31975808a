"""Marks are found where they were, to hundredths of a pixel; a bump is seen each time, noise never taken for one."""

import numpy as np
import pytest

from contour.calibration.fixed_marks import Mark, Sentinels, check_sentinels, see_sentinels
from contour.errors import CalibrationError
from tests.support.pictures.fixed_mark_scenes import CAMERA, bumped, marked

SEEN = see_sentinels(marked(CAMERA), "DICT_4X4_50")
assert SEEN is not None
TOLERANCE_PX = 1.0


def largest_px(picture: np.ndarray) -> float:
    found = check_sentinels(picture, SEEN).largest_px
    assert found is not None
    return found


def test_noisy_pictures_of_a_camera_at_rest_raise_no_alarm() -> None:
    """A fifth of the tolerance; `python -m benchmarks.calibration` does it 50 times."""
    still = marked(CAMERA, seed=9).astype(np.float64)
    rng = np.random.default_rng(1)
    for _ in range(12):
        noisy = np.clip(still + rng.normal(0.0, 3.0, still.shape), 0, 255).astype(np.uint8)
        check = check_sentinels(noisy, SEEN)
        assert check.missing == ()
        assert check.largest_px is not None
        assert check.largest_px < TOLERANCE_PX / 4


@pytest.mark.parametrize(
    "bump",
    [
        {"roll_deg": 0.3},
        {"pitch_deg": -0.3},
        {"yaw_deg": 0.3},
        {"shift_px": (2.0, 0.0)},
        {"shift_px": (-1.4, 1.43)},
        {"pitch_deg": 4.0},
    ],
    ids=str,
)
def test_a_bump_is_seen(bump: dict) -> None:
    """0.3 degrees in any direction or 2 px; also one so far that no mark is near its place."""
    assert largest_px(marked(bumped(CAMERA, **bump))) > TOLERANCE_PX


def test_a_mark_that_was_moved_alone_is_named() -> None:
    check = check_sentinels(marked(CAMERA, places={3: (40.0, 200.0), 4: (512.0, 300.0)}), SEEN)
    offsets = {one.id: one.distance_px for one in check.offsets}
    assert offsets[3] < 0.2
    assert offsets[4] == pytest.approx(2.0 / 0.45, rel=0.1)
    assert str(check).startswith("mark 3 by 0.0")


def test_a_covered_mark_is_missing_and_the_other_serves() -> None:
    check = check_sentinels(marked(CAMERA, places={4: (510.0, 300.0)}), SEEN)
    assert check.missing == (3,)
    assert check.largest_px is not None
    assert check.largest_px < 0.2


def test_without_any_mark_there_is_no_offset() -> None:
    check = check_sentinels(np.full((960, 1280), 90, np.uint8), SEEN)
    assert check.largest_px is None
    assert check.missing == (3, 4)
    assert see_sentinels(np.full((960, 1280), 90, np.uint8), "DICT_4X4_50") is None


def test_a_boards_own_markers_are_no_sentinels() -> None:
    left = see_sentinels(marked(CAMERA), "DICT_4X4_50", without=range(4))
    assert left is not None
    assert [mark.id for mark in left.marks] == [4]


def test_what_is_no_mark_is_refused() -> None:
    square = np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]])
    with pytest.raises(CalibrationError, match="expected one of DICT_4X4_100"):
        Sentinels("DICT_1X1", (Mark(1, square),))
    with pytest.raises(CalibrationError, match=r"expected \(4, 2\)"):
        Mark(1, square[:3])
