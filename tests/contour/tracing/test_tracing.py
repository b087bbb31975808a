from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
import shapely

from contour.errors import NoBlockFound, ParameterError, PictureError
from contour.geometry.rings import contour_defect, signed_area
from contour.synthetic import CellGeometry, Scene, camera_above, render
from contour.tracing.binarize import binarize
from contour.tracing.sliding_matrix import coarse_step, default_core_px
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.pictures.small_scenes import HEIGHT, MM_PER_PX, OUTLINES, WIDTH, block

PAPER_METHODS = ("sliding-matrix", "direct-scan", "find-contours")


def overlap(found: np.ndarray, truth: np.ndarray) -> float:
    """Intersection over union of two rings."""
    a, b = shapely.Polygon(found).buffer(0), shapely.Polygon(truth)
    return float(a.intersection(b).area / a.union(b).area)


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
@pytest.mark.parametrize("name", OUTLINES)
def test_sliding_matrix_is_close_to_the_block_with_sizes_from_the_picture(name: str, kind: str) -> None:
    scene = block(name, kind)
    found = trace(scene.picture, TraceSettings(method="sliding-matrix"))
    assert contour_defect(found.contour) is None
    assert overlap(found.contour.exterior, scene.truth_px.exterior) > 0.85
    assert found.pitch_px == pytest.approx(scene.pitch_px, rel=0.08)
    assert found.method == "sliding-matrix"
    assert found.uncertainty_px is None


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
def test_the_hole_through_a_block_is_found_and_no_other(kind: str) -> None:
    scene = block("holed", kind)
    found = trace(scene.picture, TraceSettings(method="sliding-matrix"))
    assert len(found.contour.holes) == 1
    assert overlap(found.contour.holes[0], scene.truth_px.holes[0]) > 0.5
    for name in ("rectangle", "l", "crescent"):
        assert trace(block(name, kind).picture, TraceSettings(method="sliding-matrix")).contour.holes == ()


def test_direct_scan_is_right_on_a_convex_block_and_fills_a_concave_one() -> None:
    settings = TraceSettings(method="direct-scan")
    convex, concave = block("rectangle"), block("l")
    assert overlap(trace(convex.picture, settings).contour.exterior, convex.truth_px.exterior) > 0.85
    good = overlap(
        trace(concave.picture, TraceSettings(method="sliding-matrix")).contour.exterior, concave.truth_px.exterior
    )
    bad = overlap(trace(concave.picture, settings).contour.exterior, concave.truth_px.exterior)
    assert bad < good - 0.03


def test_find_contours_is_lost_in_the_cells() -> None:
    scene = block("rectangle")
    found = trace(scene.picture, TraceSettings(method="find-contours"))
    plain = trace(scene.picture, TraceSettings(method="sliding-matrix"))
    assert overlap(found.contour.exterior, scene.truth_px.exterior) < overlap(
        plain.contour.exterior, scene.truth_px.exterior
    )


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_exteriors_run_counter_clockwise_as_seen_and_holes_the_other_way(method: Any) -> None:
    contour = trace(block("holed").picture, TraceSettings(method=method)).contour
    assert signed_area(contour.exterior) < 0
    assert all(signed_area(hole) > 0 for hole in contour.holes)
    assert contour.exterior.dtype == np.float64


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_contours_of_the_papers_methods_lie_on_pixel_centres(method: Any) -> None:
    contour = trace(block("crescent").picture, TraceSettings(method=method)).contour
    np.testing.assert_array_equal(contour.exterior, np.round(contour.exterior))


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_stages_are_told_as_they_end(method: Any) -> None:
    stages: list[str] = []
    trace(block("rectangle").picture, TraceSettings(method=method), on_stage=stages.append)
    assert stages == ["mask", "trace"]


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_grey_and_grey_as_colour_give_the_same_contour(method: Any) -> None:
    picture = block("crescent").picture
    settings = TraceSettings(method=method)
    grey, colour = trace(picture, settings), trace(cv2.merge([picture] * 3), settings)
    np.testing.assert_array_equal(grey.contour.exterior, colour.contour.exterior)


def test_sizes_given_are_used() -> None:
    picture = block("rectangle").picture
    loose = trace(picture, TraceSettings(method="sliding-matrix", core_px=30, step_px=5, threshold=20.0)).contour
    tight = trace(picture, TraceSettings(method="sliding-matrix", core_px=8, step_px=8, threshold=40.0)).contour
    assert abs(signed_area(loose.exterior)) > 1.15 * abs(signed_area(tight.exterior))
    scan = TraceSettings(method="direct-scan", max_gap_px=3, min_width_px=1)
    narrow = trace(picture, scan).contour
    wide = trace(picture, replace(scan, max_gap_px=60, min_width_px=40)).contour
    assert np.ptp(narrow.exterior[:, 0]) != np.ptp(wide.exterior[:, 0])


@pytest.mark.parametrize(
    "settings",
    [
        TraceSettings(method="sliding-matrix", binarize=100, core_px=6, threshold=64.0),
        TraceSettings(method="direct-scan", binarize=100, max_gap_px=5, min_width_px=5),
        TraceSettings(method="find-contours", binarize=100),
    ],
)
def test_without_cells_sizes_must_be_given_and_then_suffice(settings: TraceSettings) -> None:
    plate = np.zeros((120, 160), np.uint8)
    plate[30:90, 40:120] = 200
    found = trace(plate, settings)
    assert found.pitch_px is None
    assert abs(signed_area(found.contour.exterior)) == pytest.approx(59 * 79, rel=0.35)
    if settings.method != "find-contours":
        open_sizes = replace(settings, core_px=None, max_gap_px=None)
        with pytest.raises(NoBlockFound, match=r"fewer than 6 regular cells.*(core_px|max_gap_px)"):
            trace(plate, open_sizes)
        with pytest.raises(NoBlockFound, match=r"fewer than 6 regular cells.*(threshold|min_width_px)"):
            trace(plate, replace(settings, threshold=None, min_width_px=None))


@pytest.mark.parametrize("method", PAPER_METHODS)
def test_an_empty_table_is_no_block(method: Any) -> None:
    table = np.random.default_rng(1).normal(60, 2, (240, 320)).astype(np.uint8)
    with pytest.raises(NoBlockFound, match="No block found"):
        trace(table, TraceSettings(method=method))


@pytest.mark.parametrize(
    ("picture", "words"),
    [
        (np.zeros((10, 10), np.uint16), "uint16.*expected 8 bits"),
        (np.zeros((10, 10), np.float32), "float32.*expected 8 bits"),
        (np.zeros((10, 10), np.bool_), "bool.*expected 8 bits"),
        (np.zeros((10, 10, 4), np.uint8), r"\(10, 10, 4\).*expected \(H, W\) grey"),
        (np.zeros((10, 10, 1), np.uint8), r"expected \(H, W\) grey"),
        (np.zeros(10, np.uint8), r"expected \(H, W\) grey"),
        (np.zeros((0, 10), np.uint8), "no pixels"),
        (np.zeros((10, 0, 3), np.uint8), "no pixels"),
    ],
)
def test_an_array_that_is_no_picture_is_refused_with_what_was_seen(picture: Any, words: str) -> None:
    with pytest.raises(PictureError, match=words):
        trace(picture, TraceSettings(method="sliding-matrix"))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (TraceSettings(method="sliding-matrix", core_px=0), "core_px is 0"),
        (TraceSettings(method="sliding-matrix", step_px=-1), "step_px is -1"),
        (TraceSettings(method="sliding-matrix", threshold=300.0), "threshold is 300"),
        (TraceSettings(method="sliding-matrix", threshold=float("nan")), "threshold is nan"),
        (TraceSettings(method="direct-scan", max_gap_px=-1), "max_gap_px is -1"),
        (TraceSettings(method="direct-scan", min_width_px=-2), "min_width_px is -2"),
        (TraceSettings(method="sliding-matrix", binarize=256), "binarize is 256"),
        (TraceSettings(method="magic"), "method is 'magic': expected one of .*sliding-matrix"),  # type: ignore[arg-type]
    ],
)
def test_a_parameter_out_of_range_is_refused_by_name(settings: TraceSettings, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        trace(block("rectangle").picture, settings)


def test_the_same_picture_gives_the_same_contour() -> None:
    picture = block("holed", "shop").picture
    first, second = (trace(picture.copy(), TraceSettings(method="sliding-matrix")) for _ in range(2))
    np.testing.assert_array_equal(first.contour.exterior, second.contour.exterior)


def test_a_picture_that_cannot_be_written_to_is_traced() -> None:
    picture = block("rectangle").picture.copy()
    picture.flags.writeable = False
    assert trace(picture, TraceSettings(method="sliding-matrix")).contour.point_count > 3


def test_a_view_into_a_larger_picture_is_traced_as_its_copy() -> None:
    larger = np.zeros((480, 1280), np.uint8)
    larger[:, ::2] = block("rectangle").picture
    view = larger[:, ::2]
    assert not view.flags.c_contiguous
    np.testing.assert_array_equal(
        trace(view, TraceSettings(method="sliding-matrix")).contour.exterior,
        trace(view.copy(), TraceSettings(method="sliding-matrix")).contour.exterior,
    )


@pytest.mark.parametrize("wall_mm", [0.6, 1.0, 5.0])
def test_the_threshold_follows_from_the_cells_whoever_gives_the_core(wall_mm: float) -> None:
    cells = CellGeometry(pitch_mm=10, wall_mm=wall_mm, ribbon_deg=17)
    picture = render(Scene(OUTLINES["rectangle"], camera_above(WIDTH, HEIGHT, MM_PER_PX), cells, seed=11)).picture
    seen = binarize(picture).cells
    assert seen is not None
    own = TraceSettings(method="sliding-matrix")
    followed = trace(picture, own).contour
    by_hand = trace(picture, replace(own, core_px=default_core_px(seen.pitch_px))).contour
    np.testing.assert_array_equal(by_hand.exterior, followed.exterior)
    half = trace(picture, replace(own, threshold=255 * seen.wall_share / 2)).contour
    np.testing.assert_array_equal(half.exterior, followed.exterior)


def test_a_step_above_twice_the_core_is_doubted() -> None:
    assert coarse_step(10, 20) is None
    assert "step_px is 21, expected up to 20, twice core_px" in str(coarse_step(10, 21))
