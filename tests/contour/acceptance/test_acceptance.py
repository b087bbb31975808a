from dataclasses import replace

import cv2
import numpy as np
import pytest

from contour.acceptance.acceptance import View, judge, judge_without_block
from contour.acceptance.block_findings import vague
from contour.acceptance.disagreement import Disagreement
from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.findings import Finding, Limits, Refusal, closed, runs_where
from contour.acceptance.quality import Quality
from contour.acceptance.trace_check import CheckedTrace
from contour.edge.stretches import Stretch
from contour.geometry.rings import Contour
from contour.image.region import Region
from contour.narrow_features.feature import NarrowFeature
from contour.polygon.polygon import Polygon
from contour.tracing.trace import Trace
from contour.walls.comb_likeness import Comb
from contour.walls.pieces import Piece
from tests.support.pictures.narrow_shapes import BLOCK, contour, dent
from tests.support.pictures.rings import SQUARE

FRAME = View((640, 480))
LIMITS = Limits(min_area_mm2=1000, max_area_mm2=20_000, max_vertices=10)


def polygon(ring_px: np.ndarray, holes: tuple[np.ndarray, ...] = (), mm_per_px: float | None = 1.0) -> Polygon:
    pixels = Contour(ring_px, holes)
    if mm_per_px is None:
        return Polygon(pixels, None, 10_000.0, None, None)
    scaled = Contour(ring_px * [1, -1] * mm_per_px, tuple(hole * [1, -1] * mm_per_px for hole in holes))
    return Polygon(pixels, scaled, 10_000.0, 10_000.0 * mm_per_px**2, mm_per_px)


GOOD = polygon(SQUARE * 10 + 100)


def test_a_good_polygon_is_accepted() -> None:
    assert judge(GOOD, FRAME, LIMITS) == ()


def test_codes_and_names_are_the_protocols() -> None:
    table = {
        102: "image_quality",
        103: "scene_moved",
        110: "no_block_found",
        111: "touches_border",
        112: "area_out_of_limits",
        113: "methods_disagree",
        114: "uncertainty_too_large",
        115: "outside_work_area",
        116: "several_blocks",
        117: "edge_covered",
        130: "too_many_points",
        131: "self_intersecting",
    }
    assert {int(refusal): refusal.reason for refusal in Refusal} == table


@pytest.mark.parametrize(
    ("shift", "side"),
    [((-99, 0), "left"), ((0, -99), "top"), ((640 - 1 - 201, 0), "right"), ((0, 480 - 1 - 201), "bottom")],
)
def test_a_contour_within_two_pixels_of_the_frame_touches_it(shift: tuple[int, int], side: str) -> None:
    # One pixel of margin on pixel centres is 1.5 px from the frame's edge.
    near = polygon(SQUARE * 10 + 100 + np.array(shift))
    (finding,) = judge(near, FRAME, LIMITS)
    assert finding.refusal == Refusal.TOUCHES_BORDER
    assert "1.5 px" in finding.text
    assert side in finding.text
    (shown,) = finding.shown_px
    assert len(shown) == 4, "the edge that touches, from the vertex before to the one after"
    along = {"left": 1.0, "top": 1.0, "right": 638.0, "bottom": 478.0}[side]
    assert (shown[1:3, 0 if side in ("left", "right") else 1] == along).all()
    inwards = -np.sign(shift)
    assert judge(polygon(SQUARE * 10 + 100 + np.array(shift) + inwards), FRAME, LIMITS) == ()


def test_a_contour_beyond_the_frame_touches_it() -> None:
    (finding,) = judge(polygon(SQUARE * 10 - 50), FRAME, LIMITS)
    assert finding.refusal == Refusal.TOUCHES_BORDER


@pytest.mark.parametrize(("mm_per_px", "area"), [(0.3, "900 mm²"), (1.5, "22500 mm²")])
def test_an_area_beyond_the_recipes_limits_names_all_three_numbers(mm_per_px: float, area: str) -> None:
    (finding,) = judge(polygon(SQUARE * 10 + 100, mm_per_px=mm_per_px), FRAME, LIMITS)
    assert finding.refusal == Refusal.AREA_OUT_OF_LIMITS
    assert area in finding.text
    assert "1000 to 20000 mm²" in finding.text


@pytest.mark.parametrize("mm_per_px", [None, 1.0])
def test_more_holes_than_the_recipe_allows_are_refused_with_a_place(mm_per_px: float | None) -> None:
    hole = SQUARE[::-1] * 2 + 110
    holed = polygon(SQUARE * 10 + 100, (hole, hole + 40), mm_per_px=mm_per_px)
    limits = replace(LIMITS, max_vertices=12)
    assert judge(holed, FRAME, replace(limits, max_holes=2)) == ()
    (finding,) = judge(holed, FRAME, replace(limits, max_holes=1))
    assert finding.refusal == Refusal.AREA_OUT_OF_LIMITS
    assert "2 in place of 1" in finding.text
    x, y = hole.mean(axis=0)
    assert f"({x:.0f}, {y:.0f}) px" in finding.text
    assert len(finding.shown_px) == 2


def test_limits_in_millimetres_do_not_apply_without_a_calibration() -> None:
    far_away = SQUARE + 1e6
    limits = replace(LIMITS, max_area_mm2=2.0, min_area_mm2=1.0, work_area_mm=far_away)
    assert judge(polygon(SQUARE * 10 + 100, mm_per_px=None), FRAME, limits) == ()


def test_too_many_vertices_of_all_rings_together_are_refused_without_a_calibration_too() -> None:
    hole = SQUARE[::-1] * 2 + 110
    many = polygon(SQUARE * 10 + 100, (hole, hole + 40), mm_per_px=None)
    (finding,) = judge(many, FRAME, LIMITS)
    assert finding.refusal == Refusal.TOO_MANY_POINTS
    assert "12 vertices" in finding.text
    assert "allows 10" in finding.text


def test_a_ring_that_meets_itself_is_refused() -> None:
    crossed = SQUARE[[0, 2, 1, 3]] * 10 + 100
    for mm_per_px in (None, 1.0):
        (finding,) = judge(polygon(crossed, mm_per_px=mm_per_px), FRAME, LIMITS)
        assert finding.refusal == Refusal.SELF_INTERSECTING
        assert "exterior meets itself" in finding.text


def test_a_hole_that_leaves_the_exterior_is_refused() -> None:
    (finding,) = judge(polygon(SQUARE * 10 + 100, (SQUARE[::-1] + 300,)), FRAME, LIMITS)
    assert finding.refusal == Refusal.SELF_INTERSECTING
    assert "hole 1 lies outside" in finding.text


WORK_AREA = np.array([[0.0, -400.0], [400.0, -400.0], [400.0, 0.0], [0.0, 0.0]])
NOTCHED = np.array(
    [[0.0, -400.0], [149.0, -400.0], [150.0, -150.0], [151.0, -400.0], [400.0, -400.0], [400, 0], [0, 0]]
)


@pytest.mark.parametrize(
    ("work_area", "words"),
    [
        (WORK_AREA, None),
        (WORK_AREA[::-1], None),
        (WORK_AREA + np.array([150, 0]), r"lie outside"),
        (NOTCHED, "crosses or touches"),
        (WORK_AREA + 5000, "lie outside"),
    ],
)
def test_the_whole_contour_must_lie_in_the_work_area(work_area: np.ndarray, words: str | None) -> None:
    findings = judge(GOOD, FRAME, replace(LIMITS, work_area_mm=work_area))
    if words is None:
        assert findings == ()
    else:
        assert [finding.refusal for finding in findings] == [Refusal.OUTSIDE_WORK_AREA]
        assert words in findings[0].text


def test_what_lies_outside_the_work_area_is_shown_where_it_lies_in_the_picture() -> None:
    (finding,) = judge(GOOD, FRAME, replace(LIMITS, work_area_mm=WORK_AREA + np.array([150, 0])))
    (shown,) = finding.shown_px
    right = GOOD.pixels.exterior[:, 0].max()
    left = GOOD.pixels.exterior[:, 0].min()
    np.testing.assert_array_equal(shown[:, 0], [right, left, left, right])
    (far,) = judge(GOOD, FRAME, replace(LIMITS, work_area_mm=WORK_AREA + 5000))
    np.testing.assert_array_equal(far.shown_px[0], closed(GOOD.pixels.exterior))


@pytest.mark.parametrize(
    ("chosen", "paths"),
    [
        ([], []),
        ([0], [[5, 0, 1]]),
        ([5, 0], [[4, 5, 0, 1]]),
        ([1, 2, 4], [[3, 4, 5], [0, 1, 2, 3]]),
        ([0, 1, 2, 3, 4, 5], [[0, 1, 2, 3, 4, 5, 0]]),
        ([1, 2, 3, 4, 5], [[0, 1, 2, 3, 4, 5, 0]]),
    ],
)
def test_the_parts_of_a_ring_that_are_shown_go_from_neighbour_to_neighbour(
    chosen: list[int], paths: list[list[int]]
) -> None:
    ring = np.column_stack([np.arange(6.0), np.zeros(6)])
    flags = np.isin(np.arange(6), chosen)
    found = sorted(path[:, 0].astype(int).tolist() for path in runs_where(ring, flags))
    assert found == sorted(paths)


def test_an_uncertainty_is_judged_where_it_is_limited_and_told_with_its_parts() -> None:
    limits = replace(LIMITS, max_uncertainty_mm=0.5)
    assert judge(GOOD, FRAME, limits, budget=ErrorBudget(0.3, 0.4, 0.0)) == ()
    assert judge(GOOD, FRAME, LIMITS, budget=ErrorBudget(99.0, 0.0, None)) == ()
    (finding,) = judge(GOOD, FRAME, limits, budget=ErrorBudget(0.3, 0.41, None))
    assert finding.refusal == Refusal.UNCERTAINTY_TOO_LARGE
    assert "0.51 mm only (picture 0.30, thickness 0.41, calibration not stated), 0.5 mm are allowed" in finding.text


def test_an_uncertainty_that_nobody_knows_is_not_within_a_limit() -> None:
    limits = replace(LIMITS, max_uncertainty_mm=0.5)
    assert [finding.refusal for finding in judge(GOOD, FRAME, limits)] == [Refusal.UNCERTAINTY_TOO_LARGE]
    assert judge(polygon(SQUARE * 10 + 100, mm_per_px=None), FRAME, limits) == ()


def traced(quality: Quality | None = None, **changes: object) -> CheckedTrace:
    """A good trace of the good polygon."""
    return CheckedTrace(
        replace(Trace("wall-tips", "bright", 24.0, GOOD.pixels, np.zeros((480, 640), np.uint8)), **changes), quality
    )


def test_a_contour_that_is_not_sure_within_a_quarter_of_a_cell_is_refused_whatever_the_recipe_allows() -> None:
    assert judge(GOOD, FRAME, LIMITS, traced=traced(uncertainty_px=6.0)) == ()
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(uncertainty_px=7.2))
    assert finding.refusal == Refusal.UNCERTAINTY_TOO_LARGE
    assert "sure within 7.2 px only, 0.3 cells, 0.25 are allowed" in finding.text


@pytest.mark.parametrize(("deep", "refused"), [(0.5, False), (1.5, True)])
def test_material_is_sure_to_a_share_of_the_block_unless_its_edge_is_torn(deep: float, refused: bool) -> None:
    whole = traced(contour=contour(BLOCK - dent(0.6, deep)), pitch_px=19.0, uncertainty_px=4.85)
    for edge in ("cells", "mixed"):
        finding = vague(replace(whole.trace, edge=edge))
        assert [finding is None, vague(replace(whole.trace, edge="cut")) is None] == [not refused, False]
        assert finding is None or "0.26 cells, 0.25 are allowed" in finding.text


def test_a_corner_that_may_as_well_be_round_is_refused_with_its_place() -> None:
    whole = traced(uncertainty_px=1.0, untold_px=(100.0, 80.0)).moved(np.array([20.0, 10.0]))
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=whole)
    assert finding.refusal == Refusal.UNCERTAINTY_TOO_LARGE
    assert "(120, 90) px" in finding.text
    assert len(finding.shown_px) == 1


def test_a_wall_that_ends_outside_beside_a_corner_is_refused_with_its_place_where_the_picture_is_asked() -> None:
    whole = traced(uncertainty_px=1.0, outside_px=(100.0, 80.0)).moved(np.array([20.0, 10.0]))
    whole = replace(whole, disagreement=Disagreement(0.0, (0.0, 0.0), True, 0.0))
    (finding,) = judge(GOOD, FRAME, replace(LIMITS, max_disagreement_pitches=2.0), traced=whole)
    assert finding.refusal == Refusal.METHODS_DISAGREE
    assert "Beside a corner of the contour a wall ends outside of it, near (120, 90) px" in finding.text
    assert len(finding.shown_px) == 1
    assert judge(GOOD, FRAME, replace(LIMITS, max_disagreement_pitches=None), traced=whole) == ()


@pytest.mark.parametrize(("unsure_px", "bound_px", "refused"), [(25, 15.0, True), (15, 15.0, False), (60, 11.0, False)])
def test_a_ring_of_which_a_fifth_is_no_surer_than_half_a_cell_is_refused(
    unsure_px: float, bound_px: float, refused: bool
) -> None:
    """However sure the outline is as a whole."""
    hole = Contour(GOOD.pixels.exterior, (SQUARE[::-1] * 2.5 + 130,))
    evidence = (
        Stretch(0, 0.0, 400.0, "seen", None, 1.0),
        Stretch(1, 0.0, 100.0 - unsure_px, "seen", None, 1.0),
        Stretch(1, 100.0 - unsure_px, 100.0, "seen", None, bound_px),
    )
    findings = judge(GOOD, FRAME, LIMITS, traced=traced(contour=hole, uncertainty_px=1.0, evidence=evidence))
    assert [finding.refusal for finding in findings] == [Refusal.UNCERTAINTY_TOO_LARGE] * refused
    assert all(f"Of the edge of hole 1 {unsure_px} %" in finding.text for finding in findings)


def test_the_ring_that_the_polygon_was_made_of_must_keep_off_the_frame_too() -> None:
    bulge = np.insert(GOOD.pixels.exterior, 1, [0.0, 150.0], axis=0)
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(contour=Contour(bulge)))
    assert finding.refusal == Refusal.TOUCHES_BORDER
    assert judge(GOOD, FRAME, LIMITS, traced=traced()) == ()


def test_a_contour_at_the_regions_edge_is_told_as_such() -> None:
    (finding,) = judge(GOOD, replace(FRAME, region=Region.of_box(50, 50, 201, 400)), LIMITS)
    assert finding.refusal == Refusal.TOUCHES_BORDER
    assert "1.5 px" in finding.text
    assert "region of interest" in finding.text
    assert judge(GOOD, replace(FRAME, region=Region.of_box(50, 50, 202, 400)), LIMITS) == ()


def test_a_bad_picture_is_told_before_what_was_traced_in_it() -> None:
    quality = Quality(180.0, 120.0, 1.5, 4.0, 24.0, 0.01)
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(quality=quality))
    assert finding.refusal == Refusal.IMAGE_QUALITY
    assert finding.text.startswith("The picture is not good enough: walls are blurred by 4.0 px")


def test_all_that_is_wrong_with_a_picture_is_told_in_one_finding() -> None:
    quality = Quality(12.0, 120.0, 1.5, 4.0, 24.0, 0.01)
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(quality=quality))
    assert "12 of 255" in finding.text
    assert ". Besides, walls are blurred by 4.0 px" in finding.text


def test_another_block_is_refused_where_the_recipe_wants_one() -> None:
    other = Piece(3000.0, (400, 50, 460, 120))
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(others=(other,)))
    assert finding.refusal == Refusal.SEVERAL_BLOCKS
    assert "10000 px²" in finding.text
    assert "3000 px² (x 400 to 460, y 50 to 120 px)" in finding.text
    assert judge(GOOD, FRAME, replace(LIMITS, pieces="largest"), traced=traced(others=(other,))) == ()


def test_an_offcut_is_no_block() -> None:
    assert judge(GOOD, FRAME, LIMITS, traced=traced(others=(Piece(390.0, (400, 50, 460, 120)),))) == ()
    assert judge(GOOD, FRAME, LIMITS, traced=traced(others=(Piece(410.0, (400, 50, 460, 120)),))) != ()


@pytest.mark.parametrize(("cells", "refused"), [(4.0, False), (5.0, True)])
def test_a_strip_narrower_than_any_block_is_none_however_long(cells: float, refused: bool) -> None:
    one = replace(traced(others=(Piece(3000.0, (400, 50, 460, 120), width_px=20.0 * cells),)))
    one = replace(one, trace=replace(one.trace, pitch_px=20.0))
    assert (
        Refusal.SEVERAL_BLOCKS in [finding.refusal for finding in judge(GOOD, FRAME, LIMITS, traced=one)]
    ) == refused


@pytest.mark.parametrize(("outwards", "words"), [(True, "stands out of"), (False, "goes into")])
def test_a_bump_or_dent_as_narrow_as_a_chip_is_told_with_its_size_and_place(outwards: bool, words: str) -> None:
    narrow = NarrowFeature(1.25, 3.5, (40.0, 60.0), outwards)
    seen = replace(traced(), disagreement=Disagreement(0.5, (0.0, 0.0), True, 0.0), narrow=narrow)
    (finding,) = judge(GOOD, FRAME, replace(LIMITS, max_disagreement_pitches=2.0), traced=seen)
    assert finding.refusal == Refusal.METHODS_DISAGREE
    assert f"{words} its edge by 1.2 cells over 3.5 cells near (40, 60) px" in finding.text
    assert "max_disagreement_pitches: 0" in finding.text
    assert judge(GOOD, FRAME, replace(LIMITS, max_disagreement_pitches=None), traced=seen) == ()


def test_of_two_nearly_equal_blocks_none_is_the_largest() -> None:
    twins = (Piece(8100.0, (400, 50, 500, 150)), Piece(100.0, (0, 0, 9, 9)))
    (finding,) = judge(GOOD, FRAME, replace(LIMITS, pieces="largest"), traced=traced(others=twins))
    assert finding.refusal == Refusal.SEVERAL_BLOCKS
    assert "80 %" in finding.text


def test_where_cells_are_none_the_picture_is_judged_as_a_whole() -> None:
    # By a pitch read wrong, 67 px, a blur of 7 px would pass.
    blurred = np.zeros((300, 400), np.uint8)
    blurred[:, 200:] = 120
    blurred = np.asarray(cv2.GaussianBlur(blurred, (0, 0), 7.0), np.uint8)
    view = replace(FRAME, picture=blurred)
    scattered = traced(comb=Comb(67.0, 18.0, True, 9, 0.15, 0.2))
    reasons = [finding.refusal for finding in judge(GOOD, view, LIMITS, traced=scattered)]
    assert reasons == [Refusal.IMAGE_QUALITY, Refusal.NO_BLOCK_FOUND]
    assert judge(GOOD, view, LIMITS, traced=traced()) == ()


def test_what_is_no_comb_is_no_block() -> None:
    seen = traced(comb=Comb(86.0, 35.6, False, 42, 1.0, 1.0))
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=seen)
    assert finding.refusal == Refusal.NO_BLOCK_FOUND
    assert "40 % as wide" in finding.text
    assert judge(GOOD, FRAME, LIMITS, traced=traced(comb=Comb(24.0, 3.0, True, 300, 0.6, 0.6))) == ()


def test_walls_that_go_on_to_the_last_pixels_touch_the_border() -> None:
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(reaches_frame=True))
    assert finding.refusal == Refusal.TOUCHES_BORDER


def test_walls_lost_in_noise_are_no_block() -> None:
    quality = Quality(180.0, 9.0, 3.0, 1.4, 24.0, 0.0)
    (finding,) = judge(GOOD, FRAME, LIMITS, traced=traced(quality=quality))
    assert finding.refusal == Refusal.NO_BLOCK_FOUND


def test_each_reason_is_told_once() -> None:
    findings = judge(polygon(SQUARE * 10 - 50), FRAME, LIMITS, traced=traced(reaches_frame=True))
    assert [int(finding.refusal) for finding in findings] == [111]


def test_without_a_contour_a_useless_picture_is_told_first() -> None:
    black = np.zeros((480, 640), np.uint8)
    assert [int(finding.refusal) for finding in judge_without_block(black, "nothing there.")] == [102, 110]
    grey = np.full((480, 640), 90, np.uint8)
    (finding,) = judge_without_block(grey, "nothing there.")
    assert finding == Finding(Refusal.NO_BLOCK_FOUND, "nothing there.")


def test_all_findings_are_told_lowest_code_first() -> None:
    crossed = polygon(SQUARE[[0, 2, 1, 3]] * 60, mm_per_px=3.0)
    limits = Limits(max_area_mm2=5, max_vertices=3, work_area_mm=WORK_AREA)
    codes = [int(finding.refusal) for finding in judge(crossed, FRAME, limits)]
    assert codes == [111, 112, 115, 130, 131]
