from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from contour.calibration.calibration import Alignment, CameraCalibration, SimpleCalibration, scales
from contour.errors import CalibrationError
from contour.geometry.rings import signed_area
from tests.support.pictures.cameras import LOOKING_DOWN, camera

SIMPLE = SimpleCalibration(1600, 1200, mm_per_pixel=0.375, origin_px=(100.0, 1100.0))

angles = st.floats(-180, 180)
metres = st.floats(-1000, 1000)
alignments = st.one_of(st.none(), st.builds(Alignment, angles, st.tuples(metres, metres)))


cameras = st.builds(
    camera,
    tilt=st.tuples(st.floats(-25, 25), st.floats(-25, 25)),
    roll=angles,
    distortion=st.tuples(
        st.floats(-0.2, 0.1), st.floats(0, 0.05), st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3), st.just(0.0)
    ),
    alignment=alignments,
)
simples = st.builds(
    SimpleCalibration,
    image_width=st.just(1600),
    image_height=st.just(1200),
    mm_per_pixel=st.floats(0.01, 2.0),
    origin_px=st.tuples(metres, metres),
    plane_height_mm=st.just(0.0),
    rotation_deg=angles,
    alignment=alignments,
)
pixels = st.lists(st.tuples(st.floats(-0.5, 1599.5), st.floats(-0.5, 1199.5)), min_size=1, max_size=30).map(np.array)
heights = st.floats(-50, 300)


@given(st.one_of(cameras, simples), pixels, heights)
def test_pixels_come_back_from_the_machine_frame(
    calibration: CameraCalibration | SimpleCalibration, points: np.ndarray, height: float
) -> None:
    machine = calibration.to_machine(calibration.to_work(points, height))
    np.testing.assert_allclose(calibration.to_pixels(machine, height), points, atol=0.02)


@given(cameras, st.lists(st.tuples(st.floats(150, 450), st.floats(100, 300)), min_size=1, max_size=20), heights)
def test_work_points_are_where_opencv_projects_them(
    calibration: CameraCalibration, places: list[tuple[float, float]], height: float
) -> None:
    points = np.column_stack([np.array(places), np.full(len(places), height)])
    seen, _ = cv2.projectPoints(
        points,
        calibration.rotation_vector,
        calibration.translation_mm,
        calibration.camera_matrix,
        calibration.distortion_coefficients,
    )
    seen = seen.reshape(-1, 2)
    assume(((seen > -200) & (seen < [1800, 1400])).all())
    np.testing.assert_allclose(calibration.to_work(seen, height), points[:, :2], atol=0.01)
    np.testing.assert_allclose(calibration.to_pixels(calibration.to_machine(points[:, :2]), height), seen, atol=1e-6)


def test_the_simple_form_by_hand() -> None:
    points = np.array([[100.0, 1100.0], [200.0, 1100.0], [100.0, 1000.0]])
    np.testing.assert_allclose(SIMPLE.to_work(points, 0), [[0, 0], [37.5, 0], [0, 37.5]], atol=1e-12)


def test_a_turned_work_frame_by_hand() -> None:
    # The work x axis 30 degrees counter-clockwise as seen: from the origin it rises to the right of the picture.
    turned = SimpleCalibration(1600, 1200, 0.5, (0.0, 0.0), rotation_deg=30.0)
    np.testing.assert_allclose(turned.to_work(np.array([[np.sqrt(3), -1.0]]), 0), [[1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(turned.to_work(np.array([[-1.0, -np.sqrt(3)]]), 0), [[0.0, 1.0]], atol=1e-12)


def test_the_camera_form_by_hand() -> None:
    # f = 1800 px at 1000 mm: 180 px right of the middle are 100 mm, at 200 mm of height 80 mm.
    calibration = camera()
    points = np.array([[799.5, 599.5], [979.5, 599.5], [799.5, 599.5 - 181.0]])
    np.testing.assert_allclose(calibration.to_work(points, 0), [[300, 200], [400, 200], [300, 300]], atol=1e-9)
    np.testing.assert_allclose(calibration.to_work(points, 200), [[300, 200], [380, 200], [300, 280]], atol=1e-9)
    np.testing.assert_allclose(calibration.camera_position, [300, 200, 1000], atol=1e-9)


@given(st.one_of(cameras, simples))
def test_the_work_frame_is_right_handed_seen_from_the_camera(
    calibration: CameraCalibration | SimpleCalibration,
) -> None:
    seen_counter_clockwise = np.array([[700.0, 700.0], [900.0, 700.0], [900.0, 500.0], [700.0, 500.0]])
    assert signed_area(seen_counter_clockwise) < 0
    work = calibration.to_work(seen_counter_clockwise, 20)
    assert signed_area(work) > 0
    assert signed_area(calibration.to_machine(work)) == pytest.approx(signed_area(work))


def test_the_alignment_turns_then_moves() -> None:
    alignment = Alignment(90.0, (1000.0, 2000.0))
    np.testing.assert_allclose(alignment.apply(np.array([[10.0, 0.0], [0.0, 5.0]])), [[1000, 2010], [995, 2000]])
    np.testing.assert_allclose(alignment.undo(np.array([[1000.0, 2010.0]])), [[10, 0]], atol=1e-9)


def test_without_an_alignment_the_machine_frame_is_the_work_frame() -> None:
    points = np.array([[1.0, 2.0]])
    np.testing.assert_array_equal(SIMPLE.to_machine(points), points)
    assert not SIMPLE.aligned
    assert SimpleCalibration(10, 10, 1.0, (0.0, 0.0), alignment=Alignment()).aligned


def test_a_picture_of_another_size_is_refused_with_both_sizes() -> None:
    for calibration in (SIMPLE, camera()):
        calibration.check_fits(1600, 1200)
        for size in ((1200, 1600), (800, 600)):
            with pytest.raises(CalibrationError, match=rf"{size[0]} x {size[1]} px.*1600 x 1200"):
                calibration.check_fits(*size)


def test_only_the_camera_form_knows_other_heights() -> None:
    assert SIMPLE.height_known(0.0)
    assert not SIMPLE.height_known(20.0)
    assert camera().height_known(20.0)
    points = np.array([[500.0, 500.0]])
    np.testing.assert_array_equal(SIMPLE.to_work(points, 0), SIMPLE.to_work(points, 20))


def test_a_plane_above_the_camera_is_refused() -> None:
    with pytest.raises(CalibrationError, match="not below the camera, which stands at 1000 mm"):
        camera().to_work(np.array([[800.0, 600.0]]), 1000.0)


def test_a_pixel_beyond_the_horizon_is_refused_by_its_place() -> None:
    low = camera(tilt=(75.0, 0.0))
    rows = np.array([[800.0, 20.0], [800.0, 1180.0]])
    with pytest.raises(CalibrationError, match=r"Pixel \(800\.0, 1180\.0\)|Pixel \(800\.0, 20\.0\)"):
        low.to_work(rows, 0.0)


def test_a_point_behind_the_camera_is_refused() -> None:
    low = camera(tilt=(60.0, 0.0))
    far = np.array([[300.0, -5000.0], [300.0, 5000.0]])
    with pytest.raises(CalibrationError, match="behind the camera"):
        low.to_pixels(far, 0.0)


def test_a_pixel_where_the_lens_model_folds_over_is_refused() -> None:
    folding = camera(distortion=(-0.9, 0.0, 0.0, 0.0, 0.0))
    folding.to_work(np.array([[800.0, 600.0]]), 0.0)
    with pytest.raises(CalibrationError, match="lens model does not hold at pixel"):
        folding.to_work(np.array([[800.0, 600.0], [0.0, 0.0]]), 0.0)


def test_the_corners_of_a_wide_lens_are_exact() -> None:
    # Five steps of the lens's inverse, OpenCV's default, miss these corners by 0.3 px.
    wide = replace(
        camera(distortion=(-0.35, 0.15, 0.001, 0.001, -0.02)),
        camera_matrix=np.array([[1300.0, 0, 799.5], [0, 1300.0, 599.5], [0, 0, 1]]),
    )
    corners = np.array([[0.0, 0.0], [1599.0, 0.0], [1599.0, 1199.0], [0.0, 1199.0]])
    np.testing.assert_allclose(wide.to_pixels(wide.to_work(corners, 0.0), 0.0), corners, atol=1e-6)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("mm_per_pixel", 0.0, "mm_per_pixel is 0"),
        ("mm_per_pixel", float("nan"), "mm_per_pixel is nan"),
        ("origin_px", (float("inf"), 0.0), "origin_px"),
        ("rotation_deg", float("nan"), "rotation_deg"),
        ("image_width", 0, "0 x 1200 px"),
    ],
)
def test_a_simple_calibration_that_contradicts_itself_is_refused(field: str, value: object, words: str) -> None:
    values = {"image_width": 1600, "image_height": 1200, "mm_per_pixel": 0.5, "origin_px": (0.0, 0.0), field: value}
    with pytest.raises(CalibrationError, match=words):
        SimpleCalibration(**values)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("camera_matrix", np.eye(2), "camera_matrix holds 4 numbers: expected 9"),
        ("camera_matrix", np.diag([-1800.0, 1800, 1]), "camera_matrix is"),
        ("camera_matrix", np.array([[1800.0, 0, 0], [0, 1800, 0], [0, 0, 2]]), "camera_matrix is"),
        ("distortion_coefficients", np.zeros(6), "distortion_coefficients holds 6 numbers"),
        ("distortion_coefficients", np.full(5, np.nan), "not all finite"),
        ("rotation_vector", np.zeros(4), "rotation_vector holds 4"),
        ("rotation_vector", np.zeros(3), "under the table"),
        ("translation_mm", np.zeros(2), "translation_mm holds 2"),
        ("image_height", -1, "1600 x -1 px"),
    ],
)
def test_a_camera_calibration_that_contradicts_itself_is_refused(field: str, value: object, words: str) -> None:
    good = camera()
    names = ("image_width", "image_height", "camera_matrix", "distortion_coefficients", "rotation_vector")
    values = {name: getattr(good, name) for name in (*names, "translation_mm")}
    with pytest.raises(CalibrationError, match=words):
        CameraCalibration(**{**values, field: value})


def test_an_alignment_that_is_not_a_number_is_refused() -> None:
    with pytest.raises(CalibrationError, match="finite"):
        Alignment(float("nan"))


def test_a_calibration_cannot_be_changed_through_its_arrays() -> None:
    matrix = np.array([[1800.0, 0, 799.5], [0, 1800.0, 599.5], [0, 0, 1]])
    calibration = CameraCalibration(1600, 1200, matrix, np.zeros(5), LOOKING_DOWN, np.array([0.0, 0.0, 1000.0]))
    matrix[0, 0] = 1.0
    assert calibration.camera_matrix[0, 0] == 1800.0
    with pytest.raises(ValueError, match="read-only"):
        calibration.camera_matrix[0, 0] = 1.0


def test_the_scale_is_the_larger_of_a_tilted_view() -> None:
    middle = np.array([[799.5, 599.5]])
    assert scales(camera(), middle, 0.0)[0] == pytest.approx(1000 / 1800, rel=1e-6)
    assert scales(camera(), middle, 100.0)[0] == pytest.approx(900 / 1800, rel=1e-6)
    # Tilted by 30 degrees the plane is foreshortened by cos 30 along one axis.
    assert scales(camera(tilt=(30.0, 0.0)), middle, 0.0)[0] == pytest.approx(1000 / 1810 / np.cos(np.pi / 6), rel=1e-3)
    assert scales(SIMPLE, middle, 0.0)[0] == pytest.approx(0.375)


@given(st.one_of(cameras, simples), pixels, st.floats(0, 100))
def test_the_rectifier_comes_back_and_keeps_the_pictures_sense_and_scale(
    calibration: CameraCalibration | SimpleCalibration, points: np.ndarray, height: float
) -> None:
    rectifier = calibration.rectifier(height)
    np.testing.assert_allclose(rectifier.unrectify(rectifier.rectify(points)), points, atol=0.02)
    square = np.array([[780.0, 580.0], [820.0, 580.0], [820.0, 620.0], [780.0, 620.0]])
    flat = rectifier.rectify(square)
    assert 0.4 * 1600 < signed_area(flat) <= 1.05 * 1600


def test_lines_on_the_plane_are_straight_after_rectifying() -> None:
    calibration = camera(tilt=(10.0, 5.0), distortion=(-0.15, 0.02, 0.0, 0.0, 0.0))
    along = np.linspace(0, 1, 50)[:, None]
    line = calibration.to_pixels(np.array([[80.0, 60.0]]) * (1 - along) + np.array([[520.0, 300.0]]) * along, 20.0)
    flat = calibration.rectifier(20.0).rectify(line)
    for points, straight in ((line, False), (flat, True)):
        normal = np.array([-1.0, 1.0]) * (points[-1] - points[0])[::-1]
        bend = np.abs((points - points[0]) @ normal).max() / np.linalg.norm(normal)
        assert (bend < 0.02) == straight


def test_no_points_are_no_special_case() -> None:
    none = np.zeros((0, 2))
    for calibration in (SIMPLE, camera()):
        assert calibration.to_work(none, 0.0).shape == (0, 2)
        assert calibration.to_pixels(none, 0.0).shape == (0, 2)
