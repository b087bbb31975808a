import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.calibration.calibration import Alignment, SimpleCalibration
from contour.errors import CalibrationError, ParameterError
from contour.geometry.rings import Contour, contour_defect, densified, signed_area
from contour.polygon.polygon import PIXEL_TOLERANCE, Finish, Polygon, cutting_polygon
from tests.support.pictures.cameras import camera
from tests.support.pictures.rings import SQUARE, alike, blobs, simple_rings

SIMPLE = SimpleCalibration(1600, 1200, 0.375, (100.0, 1100.0), alignment=Alignment(25.0, (500.0, -300.0)))
OUTLINE = densified(SQUARE * [40, 30] + [300, 400], 1.0)
OPENING = densified(SQUARE[::-1] * 8 + [400, 500], 1.0)


def converted(contour_px: Contour, **options: float) -> Polygon:
    return cutting_polygon(contour_px, SIMPLE, **{"height_mm": 0.0, "tolerance_mm": 0.1, **options})


def test_pixels_and_millimetres_are_the_same_vertices_in_the_same_order() -> None:
    for calibration in (SIMPLE, camera(tilt=(8.0, 3.0), distortion=(-0.1, 0.0, 0.0, 0.0, 0.0))):
        polygon = cutting_polygon(Contour(OUTLINE, (OPENING,)), calibration, height_mm=20.0, tolerance_mm=0.2)
        assert polygon.millimetres is not None
        for pixels, millimetres in zip(polygon.pixels.rings, polygon.millimetres.rings, strict=True):
            again = calibration.to_machine(calibration.to_work(pixels, 20.0))
            np.testing.assert_allclose(again, millimetres, atol=1e-9)


def test_a_dense_rectangle_with_an_opening_becomes_eight_vertices() -> None:
    polygon = converted(Contour(OUTLINE, (OPENING,)))
    assert [len(ring) for ring in polygon.pixels.rings] == [4, 4]
    assert polygon.area_px2 == 400 * 300 - 80 * 80
    assert polygon.area_mm2 == pytest.approx((400 * 300 - 80 * 80) * 0.375**2)
    assert polygon.mm_per_px == pytest.approx(0.375)


@pytest.mark.parametrize("calibration", [SIMPLE, None])
def test_the_shift_is_that_of_the_farthest_vertex_left_out(calibration: SimpleCalibration | None) -> None:
    ring = np.array([[300, 400], [500, 400.2], [700, 400], [700, 700], [300, 700.0]])
    polygon = cutting_polygon(Contour(ring), calibration, height_mm=0.0, tolerance_mm=0.1)
    assert len(polygon.pixels.exterior) == 4
    assert polygon.shift_px == pytest.approx(0.2)
    assert converted(Contour(ring), tolerance_mm=0.0).shift_px == 0.0


def test_a_straight_edge_behind_a_lens_becomes_one_edge_in_millimetres() -> None:
    calibration = camera(tilt=(5.0, 0.0), distortion=(-0.15, 0.0, 0.0, 0.0, 0.0))
    block_mm = densified(np.array([[100.0, 80.0], [500.0, 80.0], [500.0, 320.0], [100.0, 320.0]]), 1.0)
    seen = Contour(calibration.to_pixels(block_mm, 30.0))
    assert len(cutting_polygon(seen, calibration, height_mm=30.0, tolerance_mm=0.05).pixels.exterior) == 4
    # In raw pixels the same edges are bent: without the calibration they need more vertices.
    assert len(cutting_polygon(seen, None, height_mm=30.0, tolerance_mm=0.05).pixels.exterior) > 4


@given(simple_rings, st.booleans(), st.booleans())
def test_exteriors_run_counter_clockwise_in_the_work_frame_and_negative_in_pixels(
    ring: np.ndarray, turned: bool, calibrated: bool
) -> None:
    contour = Contour(ring[::-1] if turned else ring)
    polygon = cutting_polygon(contour, SIMPLE if calibrated else None, height_mm=0.0, tolerance_mm=0.5)
    assert signed_area(polygon.pixels.exterior) < 0
    if calibrated:
        assert polygon.millimetres is not None
        assert signed_area(polygon.millimetres.exterior) > 0


def test_holes_run_the_other_way_round() -> None:
    for hole in (OPENING, OPENING[::-1]):
        polygon = converted(Contour(OUTLINE, (hole,)))
        assert polygon.millimetres is not None
        assert signed_area(polygon.pixels.holes[0]) > 0
        assert signed_area(polygon.millimetres.holes[0]) < 0


@given(blobs, st.floats(0.01, 3.0))
def test_the_tolerance_is_kept_in_millimetres(ring: np.ndarray, tolerance: float) -> None:
    polygon = converted(Contour(ring), tolerance_mm=tolerance)
    assert polygon.millimetres is not None
    full = SIMPLE.to_machine(SIMPLE.to_work(ring, 0.0))
    assert alike(full, polygon.millimetres.exterior, tolerance)


@given(blobs)
def test_without_a_calibration_a_quarter_pixel_is_kept_and_no_millimetres_are_given(ring: np.ndarray) -> None:
    polygon = cutting_polygon(Contour(ring), None, height_mm=20.0, tolerance_mm=50.0)
    assert (polygon.millimetres, polygon.area_mm2, polygon.mm_per_px) == (None, None, None)
    assert alike(ring, polygon.pixels.exterior, PIXEL_TOLERANCE)


def test_a_hole_close_to_the_edge_stays_apart_from_it() -> None:
    # A wavy exterior and a hole 0.6 mm behind it; straightened by 1 mm each they would cross.
    x = np.arange(0.0, 200.0, 2.0)
    wave = np.column_stack([x, 3.0 * np.sin(x / 4)])
    exterior = np.vstack([wave, [[200, 100], [0, 100]]])
    hole = np.vstack([wave[10:90] + np.array([0, 1.6]), [[178, 60], [20, 60]]])
    contour = Contour(exterior + 300, (hole[::-1] + 300,))
    assert contour_defect(contour) is None
    polygon = converted(contour, tolerance_mm=1.2)
    assert contour_defect(polygon.pixels) is None
    assert polygon.pixels.point_count < contour.point_count
    assert polygon.millimetres is not None
    assert shapely.Polygon(polygon.millimetres.exterior, polygon.millimetres.holes).is_valid


def test_stages_are_told_as_they_end() -> None:
    for calibration in (None, SIMPLE):
        stages: list[str] = []
        cutting_polygon(Contour(OUTLINE), calibration, height_mm=0.0, tolerance_mm=0.1, on_stage=stages.append)
        assert stages == ["convert", "simplify"]


def test_a_contour_that_meets_itself_is_handed_on_to_be_judged() -> None:
    bow_tie = np.array([[300.0, 300.0], [500.0, 500.0], [500.0, 300.0], [300.0, 500.0]])
    polygon = converted(Contour(bow_tie))
    assert len(polygon.pixels.exterior) == 4


@pytest.mark.parametrize("tolerance", [-0.1, float("nan"), float("inf")])
def test_a_bad_tolerance_is_refused(tolerance: float) -> None:
    with pytest.raises(ParameterError, match="tolerance is"):
        converted(Contour(OUTLINE), tolerance_mm=tolerance)


def test_a_contour_that_cannot_be_converted_is_an_error() -> None:
    with pytest.raises(CalibrationError, match="not below the camera"):
        cutting_polygon(Contour(OUTLINE), camera(), height_mm=2000.0, tolerance_mm=0.1)


def test_a_margin_moves_the_millimetres_and_the_pixels_follow() -> None:
    for calibration in (SIMPLE, camera(tilt=(8.0, 3.0), distortion=(-0.1, 0.0, 0.0, 0.0, 0.0))):
        contour = Contour(OUTLINE, (OPENING,))
        plain = cutting_polygon(contour, calibration, height_mm=20.0, tolerance_mm=0.2)
        moved = cutting_polygon(contour, calibration, height_mm=20.0, tolerance_mm=0.2, finish=Finish(margin_mm=2.0))
        assert plain.millimetres is not None
        assert moved.millimetres is not None
        inner = shapely.Polygon(moved.millimetres.exterior, moved.millimetres.holes)
        outer = shapely.Polygon(plain.millimetres.exterior, plain.millimetres.holes)
        assert outer.contains(inner)
        assert shapely.distance(outer.boundary, inner.boundary) == pytest.approx(2.0, abs=1e-5)
        for pixels, millimetres in zip(moved.pixels.rings, moved.millimetres.rings, strict=True):
            again = calibration.to_machine(calibration.to_work(pixels, 20.0))
            np.testing.assert_allclose(again, millimetres, atol=1e-6)


def test_a_margin_that_leaves_nothing_is_told_with_the_polygon_as_it_was() -> None:
    polygon = cutting_polygon(Contour(OUTLINE), SIMPLE, height_mm=0.0, tolerance_mm=0.1, finish=Finish(margin_mm=60.0))
    assert polygon.defect is not None
    assert "vanishes" in polygon.defect
    assert len(polygon.pixels.exterior) == 4


@settings(max_examples=25)
@given(blobs, st.integers(8, 30))
def test_a_budget_is_kept_within_the_traced_contour_or_not_at_all(ring: np.ndarray, most: int) -> None:
    plain = converted(Contour(ring * 10))
    finish = Finish(max_vertices=most, budget_mm=3.0)
    polygon = cutting_polygon(Contour(ring * 10), SIMPLE, height_mm=0.0, tolerance_mm=0.1, finish=finish)
    assert polygon.millimetres is not None
    if polygon.millimetres.point_count > most:
        assert polygon.pixels.point_count == plain.pixels.point_count
    elif polygon.given_up_px:
        assert polygon.given_up_px * 0.375 <= 3.0
        traced = SIMPLE.to_machine(SIMPLE.to_work(ring * 10, 0.0))
        sent = shapely.Polygon(polygon.millimetres.exterior)
        assert sent.difference(shapely.Polygon(traced).buffer(1e-9)).area < 1e-9


@pytest.mark.parametrize("calibration", [SIMPLE, None])
def test_the_first_vertex_is_the_recipes(calibration: SimpleCalibration | None) -> None:
    for start, sign in (("lower-left", 1), ("upper-right", -1)):
        polygon = cutting_polygon(
            Contour(OUTLINE), calibration, height_mm=0.0, tolerance_mm=0.1, finish=Finish(start=start)
        )
        ring = polygon.pixels.exterior * [1, -1] if polygon.millimetres is None else polygon.millimetres.exterior
        assert (sign * (ring @ [1, 1])).argmin() == 0


@pytest.mark.parametrize("finish", [Finish(margin_mm=1.0), Finish(start=(0.0, 0.0))])
def test_millimetres_without_a_calibration_are_refused(finish: Finish) -> None:
    with pytest.raises(ParameterError, match="need a calibration"):
        cutting_polygon(Contour(OUTLINE), None, height_mm=0.0, tolerance_mm=0.1, finish=finish)
