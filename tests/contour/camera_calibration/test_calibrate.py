"""From corners of known cameras: right to hundredths of a millimetre, as sure as it says, and no bad view unnamed."""

from dataclasses import replace

import numpy as np
import pytest

from contour.camera_calibration.board import Board
from contour.camera_calibration.board_detection import BoardView
from contour.camera_calibration.calibrate import CameraResult, Setup, calibrate_camera
from contour.camera_calibration.calibration_verdict import Judgement
from contour.camera_calibration.length_check import KnownLength
from contour.errors import CalibrationFailed
from contour.synthetic import camera_above
from contour.synthetic.board_poses import BoardPose
from tests.support.pictures.board_scenes import CAMERA, CHARUCO, LENS, moved, noisy_view, noisy_views

SIZE = (1600, 1200)
PLANE = Setup(plane="00")
GRID = np.stack(np.meshgrid(np.linspace(0, 1599, 21), np.linspace(0, 1199, 16)), axis=-1).reshape(-1, 2)


def errors_mm(result: CameraResult, poses: list[BoardPose], height_mm: float) -> np.ndarray:
    """True errors inside the covered area; the true work frame is the flat board's."""
    inside = GRID[result.verdict.zones.inside(GRID)]
    true = CAMERA.back_project(inside, height_mm) - poses[0].translation_mm[:2]
    return np.asarray(np.linalg.norm(result.calibration.to_work(inside, height_mm) - true, axis=1))


def failure(views: list[BoardView], board: Board = CHARUCO, setup: Setup = PLANE) -> str:
    with pytest.raises(CalibrationFailed) as error:
        calibrate_camera(views, board, SIZE, setup)
    return str(error.value)


@pytest.fixture(scope="module")
def good() -> tuple[CameraResult, list[BoardPose]]:
    views, poses = noisy_views()
    return calibrate_camera(views, CHARUCO, SIZE, PLANE), poses


def test_positions_are_right_on_the_table_and_above_it(good: tuple[CameraResult, list[BoardPose]]) -> None:
    """The frame too: origin at the lower-left square's outer corner, x along its lower edge, y up, z to the camera."""
    result, poses = good
    table, block = errors_mm(result, poses, 0.0), errors_mm(result, poses, 60.0)
    assert table.mean() < 0.02
    assert table.max() < 0.06
    assert block.mean() < 0.04
    true = CAMERA.position_mm - poses[0].translation_mm
    np.testing.assert_allclose(result.calibration.camera_position, true, atol=2.0)


def test_it_is_as_sure_as_it_says(good: tuple[CameraResult, list[BoardPose]]) -> None:
    result, poses = good
    sure = result.verdict.uncertainty
    for height in (0.0, 60.0):
        errors = errors_mm(result, poses, height)
        assert (errors <= sure.figure_mm(height)).mean() >= 0.95
        assert sure.figure_mm(height) < 0.06
    assert result.verdict.judgement is Judgement.GOOD
    assert result.verdict.sentence.startswith("good: 95 % of positions are within 0.0")
    assert not result.dropped


def test_the_simplest_lens_that_serves_is_taken_not_the_one_of_least_residual(
    good: tuple[CameraResult, list[BoardPose]],
) -> None:
    result, _ = good
    by_name = {trial.model.name: trial for trial in result.trials}
    assert result.model.name == "k1"
    assert by_name["rational"].fitted_px < by_name["k1"].fitted_px


def test_a_lens_that_needs_more_numbers_gets_them() -> None:
    camera = replace(CAMERA, distortion=(-0.3, 0.35, 0.002, -0.001, 0.0))
    views, _ = noisy_views(camera=camera)
    assert calibrate_camera(views, CHARUCO, SIZE, PLANE).model.name == "k1 k2 p1 p2"


def test_pixels_that_are_not_square_are_seen() -> None:
    camera = replace(CAMERA, focal_px=(3200.0, 3240.0))
    views, _ = noisy_views(camera=camera)
    result = calibrate_camera(views, CHARUCO, SIZE, PLANE)
    assert result.model.name.endswith("pixels not square")
    assert result.calibration.camera_matrix[1, 1] / result.calibration.camera_matrix[0, 0] == pytest.approx(
        1.0125, abs=2e-4
    )


def test_the_table_lies_under_a_thick_board(good: tuple[CameraResult, list[BoardPose]]) -> None:
    views, _ = noisy_views()
    thick = calibrate_camera(views, CHARUCO, SIZE, replace(PLANE, board_thickness_mm=5.0)).calibration
    thin = good[0].calibration
    np.testing.assert_allclose(thick.to_work(GRID, 5.0), thin.to_work(GRID, 0.0), atol=1e-6)
    assert thick.camera_position[2] == pytest.approx(thin.camera_position[2] + 5.0)


# --- views that do not serve ------------------------------------------------------------------------------------------


def dropped(views: list[BoardView]) -> dict[str, str]:
    return {one.name: one.reason for one in calibrate_camera(views, CHARUCO, SIZE, PLANE).dropped}


def test_a_view_that_contradicts_the_others_is_named_and_dropped() -> None:
    views, _ = noisy_views()
    bent = 0.8 * np.sin(views[5].pixels[:, :1] / 60.0) * np.array([[0.0, 1.0]])
    views[5] = moved(views[5], bent)
    reasons = dropped(views)
    assert list(reasons) == ["05"]
    assert "outlier: its corners miss the camera model by 0." in reasons["05"]


def test_a_blurred_view_and_a_duplicate_are_named_and_dropped() -> None:
    views, _ = noisy_views()
    views[3] = replace(views[3], edge_sigma_px=3.4)
    views.append(moved(views[7], np.array([0.1, -0.2]), "twin"))
    reasons = dropped(views)
    assert set(reasons) == {"03", "twin"}
    assert "blurred: its edges spread over 3.4 px, those of the other views 0.8 px" in reasons["03"]
    assert "a duplicate: it shows the board where 07 shows it" in reasons["twin"]


def test_of_two_views_alike_the_plane_view_stays() -> None:
    views, _ = noisy_views()
    assert "it shows the board where 00 shows it" in dropped([moved(views[0], np.zeros(2), "before"), *views])["before"]


def test_a_plane_view_that_does_not_serve_is_an_error() -> None:
    views, _ = noisy_views()
    assert "00, the --plane view, cannot be used: blurred" in failure(
        [replace(views[0], edge_sigma_px=9.0), *views[1:]]
    )
    assert "gone, the --plane view, is not among" in failure(views, setup=Setup(plane="gone"))
    bent = moved(views[0], 3.0 * np.sin(views[0].pixels[:, ::-1] / 40.0))
    assert "00, the --plane view, cannot be used: an outlier" in failure([bent, *views[1:]])


def test_too_few_views_say_how_many_and_why() -> None:
    views, _ = noisy_views()
    text = failure([*views[:7], moved(views[2], np.zeros(2), "again")])
    assert "too few views: 7 can be used, 8 or more are needed" in text
    assert "again: a duplicate" in text


def test_parallel_views_are_refused() -> None:
    rng = np.random.default_rng(5)
    level = camera_above(1600, 1200, 0.375, plane_mm=0.0, distortion=LENS)
    shifts = rng.uniform([20, 20, 0], [250, 190, 80], (12, 3))
    views = [noisy_view(f"{n:02d}", CHARUCO, level, BoardPose(np.eye(3), shift), rng) for n, shift in enumerate(shifts)]
    text = failure(views)
    assert "parallel" in text or "focal length is implausible" in text


@pytest.mark.parametrize("factor", [10.0, 0.1])
def test_a_square_size_off_by_ten_is_said_to_make_focal_length_and_distance_implausible(factor: float) -> None:
    views, _ = noisy_views()
    wrong = Board("charuco", 11, 8, 30.0 * factor, 21.0 * factor, "DICT_5X5_250")
    text = failure(views, wrong)
    assert "focal length and square size are implausible together" in text
    assert f"--square-mm {30 * factor:g}" in text


def test_a_block_as_high_as_the_camera_is_refused() -> None:
    views, _ = noisy_views()
    assert "--block-mm 700 reaches up to the camera" in failure(views, setup=replace(PLANE, block_mm=700.0))


# --- what was measured by hand ----------------------------------------------------------------------------------------


def squares_told_as(square_mm: float) -> Board:
    """The board of squares of 30 mm, with another size said of them."""
    return Board("charuco", 11, 8, square_mm, 0.7 * square_mm, "DICT_5X5_250")


@pytest.mark.parametrize(("square_mm", "board_mm"), [(25.0, 0.0), (60.0, 0.0), (25.0, 50.0), (3.0, 0.0)])
def test_a_height_by_tape_refuses_a_wrong_square_size_and_names_the_right_one(
    square_mm: float, board_mm: float
) -> None:
    views, _ = noisy_views()
    true_mm = float(CAMERA.position_mm[2]) + board_mm
    setup = replace(PLANE, camera_height_mm=round(true_mm), board_thickness_mm=board_mm, block_mm=20.0)
    verdict = calibrate_camera(views, squares_told_as(square_mm), SIZE, setup).verdict
    assert verdict.judgement is Judgement.CONTRADICTED
    assert f"mm by the calibration, {true_mm:.0f} mm measured" in verdict.sentence
    assert f"squares of 30.0 mm would give {true_mm:.0f} mm, --square-mm says {square_mm:g}" in verdict.sentence


def test_a_known_length_in_the_picture_refuses_it_too() -> None:
    views, _ = noisy_views()
    ends = np.array([[400.0, 300.0], [1200.0, 900.0]])
    length_mm = float(np.linalg.norm(np.diff(CAMERA.back_project(ends, 0.0), axis=0)))
    setup = replace(PLANE, known_length=KnownLength(round(length_mm, 1), ends))
    good = calibrate_camera(views, CHARUCO, SIZE, setup)
    assert good.verdict.good
    assert good.lengths[0].apart < 0.001
    wrong = calibrate_camera(views, squares_told_as(25.0), SIZE, setup).verdict
    assert wrong.judgement is Judgement.CONTRADICTED
    assert "squares of 30.0 mm would give 37" in wrong.sentence


@pytest.mark.parametrize(("factor", "warns", "good"), [(1.029, False, True), (1.031, True, True), (1.09, False, False)])
def test_a_tape_is_warned_of_from_3_percent_and_refused_from_8(factor: float, warns: bool, good: bool) -> None:
    views, _ = noisy_views()
    tape_mm = float(CAMERA.position_mm[2]) / factor
    result = calibrate_camera(views, CHARUCO, SIZE, replace(PLANE, camera_height_mm=tape_mm))
    (check,) = result.lengths
    assert (check.warning(0.08) is not None) is warns
    assert result.verdict.good is good


def test_a_known_length_that_cannot_tell_is_refused_before_the_work() -> None:
    views, _ = noisy_views()
    for ends, words in (
        ([[10, 10], [50, 10]], "the ends lie 40 px apart, 50 or more"),
        ([[10, 10], [1600, 10]], "pixel (1600, 10) lies outside"),
    ):
        known = KnownLength(100.0, np.array(ends, dtype=np.float64))
        assert words in failure(views, setup=replace(PLANE, known_length=known))


def test_views_of_which_a_third_is_wrong_are_refused_as_a_whole() -> None:
    views, _ = noisy_views()
    for index in range(1, 8):
        views[index] = moved(views[index], np.sin((3 + index) * views[index].pixels[:, ::-1] / 90.0))
    assert "more than a third of the views contradict the others" in failure(views)


# --- verdicts ---------------------------------------------------------------------------------------------------------


def test_little_tilt_is_told_to_need_more() -> None:
    views, _ = noisy_views(tilt_deg=4.0, count=9)
    result = calibrate_camera(views, CHARUCO, SIZE, replace(PLANE, block_mm=200.0, accept_mm=0.1))
    assert result.verdict.judgement is Judgement.MORE_TILT
    assert "repeat with more tilt" in result.verdict.sentence


def views_in_one_corner() -> tuple[list[BoardView], Board, np.ndarray]:
    """Views of a small board in the lower left of the picture, the board, and where the flat one's origin lies."""
    rng = np.random.default_rng(6)
    _, poses = noisy_views()
    near = [
        BoardPose(pose.rotation, pose.rotation @ np.array([-75.0, -60.0, 0.0]) + [140.0, 110.0, 20.0]) for pose in poses
    ]
    small = Board("charuco", 11, 8, 14.0, 10.0, "DICT_5X5_250")
    return [noisy_view(f"{n:02d}", small, CAMERA, pose, rng) for n, pose in enumerate(near)], small, near[0][1]


def test_an_area_that_views_in_one_corner_do_not_reach_needs_more_of_them() -> None:
    views, small, _ = views_in_one_corner()
    verdict = calibrate_camera(views, small, SIZE, replace(PLANE, area_px=(300.0, 800.0, 900.0, 950.0))).verdict
    assert verdict.judgement is Judgement.MORE_COVERAGE
    assert "of --area-px (900, 800), (900, 950) px lie outside" in verdict.sentence
    assert verdict.overrides == ("--accept-uncovered",)


def test_views_in_one_corner_serve_for_blocks_in_that_corner_and_as_surely_as_they_say() -> None:
    views, small, origin = views_in_one_corner()
    for area_px, words in (((300.0, 800.0, 450.0, 950.0), "good: 95 %"), (None, "good in 7 % of the picture: 95 %")):
        result = calibrate_camera(views, small, SIZE, replace(PLANE, area_px=area_px))
        assert result.verdict.sentence.startswith(words)
    sure = result.verdict.uncertainty
    assert len(sure.uncovered(GRID)) == (~result.verdict.zones.inside(GRID)).sum() > 300
    inside = GRID[result.verdict.zones.inside(GRID)]
    for height_mm in (0.0, 60.0):
        true = CAMERA.back_project(inside, height_mm + origin[2]) - origin[:2]
        errors = np.linalg.norm(result.calibration.to_work(inside, height_mm) - true, axis=1)
        assert (errors <= sure.figure_mm(height_mm)).mean() >= 0.95


def test_the_whole_picture_may_be_used_where_half_of_it_is_covered(good: tuple[CameraResult, list[BoardPose]]) -> None:
    verdict = good[0].verdict
    assert 0.5 < verdict.zones.covered_share < 0.95
    assert verdict.uncertainty.covered_px is None


def test_the_whole_picture_may_be_used_where_a_person_says_so() -> None:
    views, small, _ = views_in_one_corner()
    setup = replace(PLANE, area_px=(0.0, 0.0, 1599.0, 1199.0), accept_uncovered=True)
    verdict = calibrate_camera(views, small, SIZE, setup).verdict
    assert verdict.good
    assert not len(verdict.uncertainty.uncovered(GRID))


def test_what_takes_a_calibration_nevertheless_does_take_it() -> None:
    """All that speaks against it at once: figures too large, the wrong squares, and a part never seen."""
    views, _ = noisy_views()
    setup = replace(PLANE, accept_mm=0.001, camera_height_mm=1200.0, area_px=(0.0, 0.0, 1599.0, 1199.0))
    verdict = calibrate_camera(views, squares_told_as(25.0), SIZE, setup).verdict
    assert verdict.judgement is Judgement.CONTRADICTED
    options = dict(option.split(" ") for option in verdict.overrides if " " in option)
    assert set(verdict.overrides) - {" ".join(pair) for pair in options.items()} == {"--accept-uncovered"}
    taken = replace(
        setup,
        accept_uncovered=True,
        accept_mm=float(options["--accept-mm"]),
        accept_apart=float(options["--accept-apart-percent"]) / 100,
    )
    assert calibrate_camera(views, squares_told_as(25.0), SIZE, taken).verdict.good


def test_a_lens_that_no_model_holds_is_told() -> None:
    views, _ = noisy_views()
    ripple = [0.4 * np.sin(view.pixels / 120.0) for view in views]
    bent = [moved(view, shift) for view, shift in zip(views, ripple, strict=True)]
    result = calibrate_camera(bent, CHARUCO, SIZE, PLANE)
    assert result.verdict.judgement is Judgement.WRONG_MODEL
    assert "this lens is not held by this model" in result.verdict.sentence


def test_progress_is_told_at_each_long_step() -> None:
    told: list[str] = []
    views, _ = noisy_views()
    calibrate_camera(views, CHARUCO, SIZE, PLANE, told.append)
    assert any("rational" in text for text in told)
    assert "solving two independent halves, split 5 of 5" in told
