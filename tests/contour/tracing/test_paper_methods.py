"""The vectorised methods equal the literal ones bit for bit: random and rendered pictures, borders, odd sizes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from contour.errors import NoBlockFound, ParameterError
from contour.geometry.rings import contour_defect, signed_area
from contour.tracing.binarize import binarize
from contour.tracing.direct_scan import direct_scan_ring, scan_pairs, scan_rows
from contour.tracing.find_contours import largest_contour
from contour.tracing.sliding_matrix import fill_windows, sliding_matrix_contour
from tests.support.pictures import paper_literal
from tests.support.pictures.small_scenes import block

masks = hnp.array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=24).flatmap(
    lambda shape: hnp.arrays(np.uint8, shape, elements=st.sampled_from([0, 0, 255]), fill=st.just(0))
)
noise = st.builds(
    lambda seed, height, width, share: np.where(
        np.random.default_rng(seed).random((height, width)) < share, np.uint8(255), np.uint8(0)
    ),
    st.integers(0, 10_000),
    st.integers(1, 30),
    st.integers(1, 30),
    st.floats(0, 1),
)
pictures = st.one_of(masks, noise)


def assert_same_points(mask: np.ndarray, gap: int, width: int) -> None:
    expected = np.array(paper_literal.direct_scan(mask.tolist(), gap, width), dtype=np.float64).reshape(-1, 2)
    np.testing.assert_array_equal(scan_rows(mask, gap, width), expected)


def assert_same_picture(mask: np.ndarray, core: int, step: int, threshold: float) -> None:
    expected = np.array(paper_literal.sliding_matrix(mask.tolist(), core, step, threshold), dtype=np.uint8)
    filled = fill_windows(mask, core, step, threshold)
    assert filled.dtype == np.uint8
    np.testing.assert_array_equal(filled, expected.reshape(mask.shape))


@settings(max_examples=400)
@given(pictures, st.integers(0, 30), st.integers(0, 30))
def test_direct_scan_equals_the_literal_reading(mask: np.ndarray, gap: int, width: int) -> None:
    assert_same_points(mask, gap, width)


@settings(max_examples=400)
@given(
    pictures,
    st.integers(1, 14),
    st.integers(1, 30),
    st.one_of(st.sampled_from([0.0, 63.75, 64.0, 127.5, 254.0, 255.0]), st.floats(0, 255)),
)
def test_sliding_matrix_equals_the_literal_reading(mask: np.ndarray, core: int, step: int, threshold: float) -> None:
    assert_same_picture(mask, core, step, threshold)


@pytest.mark.parametrize("name", ["rectangle", "crescent"])
@pytest.mark.parametrize(("gap", "width"), [(0, 0), (6, 3), (60, 40), (10_000, 1)])
def test_direct_scan_equals_the_literal_reading_on_rendered_blocks(name: str, gap: int, width: int) -> None:
    assert_same_points(binarize(block(name).picture).mask, gap, width)


@pytest.mark.parametrize(
    ("core", "step", "threshold"),
    [(1, 1, 64.0), (5, 3, 64.0), (8, 8, 40.0), (8, 16, 40.0), (4, 11, 30.0), (16, 8, 64.0), (120, 7, 30.0)],
)
def test_sliding_matrix_equals_the_literal_reading_on_a_rendered_block(core: int, step: int, threshold: float) -> None:
    mask = binarize(block("crescent").picture).mask[100:340, 150:420]
    assert_same_picture(mask, core, step, threshold)


@pytest.mark.parametrize("value", [0, 255])
@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0), (1, 1), (1, 40), (40, 1), (2, 2), (3, 3)])
def test_tiny_and_empty_pictures_are_no_special_case(shape: tuple[int, int], value: int) -> None:
    mask = np.full(shape, value, np.uint8)
    for gap in (0, 1, 100):
        assert_same_points(mask, gap, 0)
    for core, step in ((1, 1), (1, 5), (2, 1), (50, 3)):
        assert_same_picture(mask, core, step, 64.0)


def test_a_window_that_fits_exactly_is_visited_and_one_pixel_less_is_not() -> None:
    mask = np.zeros((8, 9), np.uint8)
    mask[:4, :4] = 255
    assert fill_windows(mask, 4, 1, 60.0)[:, :8].all()
    assert not fill_windows(mask[:7], 4, 1, 0.0)[4:].any()


def test_a_mean_equal_to_the_threshold_does_not_fill() -> None:
    mask = np.zeros((4, 4), np.uint8)
    mask[:2, :2] = 255  # mean 63.75 over the only window of core 2
    assert not fill_windows(mask, 2, 1, 63.75)[3, 3]
    assert fill_windows(mask, 2, 1, 63.74)[3, 3]


def test_any_value_but_zero_is_white() -> None:
    mask = np.array([[0, 1, 0, 0, 7, 0]], np.uint8)
    np.testing.assert_array_equal(scan_rows(mask, 5, 1), [[1, 0], [4, 0]])
    np.testing.assert_array_equal(fill_windows(mask, 3, 1, 1.0), [[0, 255, 0, 0, 255, 0]])


def test_the_input_is_left_alone() -> None:
    mask = binarize(block("rectangle").picture).mask
    before = mask.copy()
    fill_windows(mask, 8, 8, 40.0)
    scan_rows(mask, 60, 40)
    np.testing.assert_array_equal(mask, before)


@pytest.mark.parametrize(("core", "step", "threshold"), [(0, 1, 64), (1, 0, 64), (-3, 1, 64), (1, 1, -1), (1, 1, 256)])
def test_sizes_out_of_range_are_refused_by_name(core: int, step: int, threshold: float) -> None:
    with pytest.raises(ParameterError, match=r"core_px is|step_px is|threshold is"):
        fill_windows(np.zeros((5, 5), np.uint8), core, step, threshold)


@pytest.mark.parametrize(("gap", "width", "name"), [(-1, 0, "max_gap_px"), (0, -1, "min_width_px")])
def test_negative_spans_are_refused_by_name(gap: int, width: int, name: str) -> None:
    with pytest.raises(ParameterError, match=name):
        scan_rows(np.zeros((5, 5), np.uint8), gap, width)


def test_a_row_that_crosses_the_block_twice_keeps_the_first_crossing_only() -> None:
    mask = np.zeros((3, 60), np.uint8)
    mask[:, 5:20] = 255
    mask[:, 40:55] = 255
    assert scan_rows(mask, 10, 5)[:, 0].max() == 19
    assert scan_rows(mask, 30, 5)[:, 0].max() == 54


def test_noise_before_the_block_is_dropped_and_the_row_goes_on() -> None:
    mask = np.zeros((1, 60), np.uint8)
    mask[0, [3, 4]] = 255
    mask[0, 30:50] = 255
    np.testing.assert_array_equal(scan_rows(mask, 10, 5), [[30, 0], [49, 0]])


def test_too_few_rows_are_no_block() -> None:
    mask = np.zeros((9, 30), np.uint8)
    mask[4, 3:20] = 255
    with pytest.raises(NoBlockFound, match="1 rows"):
        direct_scan_ring(mask, 3, 3)
    with pytest.raises(NoBlockFound):
        direct_scan_ring(np.zeros((9, 30), np.uint8), 3, 3)


@given(noise, st.integers(0, 10), st.integers(1, 10))
def test_the_scanned_ring_never_repeats_a_neighbour(mask: np.ndarray, gap: int, width: int) -> None:
    try:
        ring = direct_scan_ring(mask, gap, width)
    except NoBlockFound:
        return
    assert (ring != np.roll(ring, 1, axis=0)).any(axis=1).all()


def test_contours_run_through_pixel_centres() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[10:50, 10:70] = 255
    assert abs(signed_area(largest_contour(mask))) == 59 * 39
    mask[20:30, 20:40] = 0
    found = sliding_matrix_contour(mask, 50.0)
    assert abs(signed_area(found.exterior)) == 59 * 39
    # An inner contour runs on the block's pixels, around the hole: OpenCV cuts its corners.
    assert abs(signed_area(found.holes[0])) == 21 * 11 - 2


def test_openings_smaller_than_the_limit_are_gaps_not_holes() -> None:
    mask = np.full((100, 100), 255, np.uint8)
    mask[[0, -1]] = mask[:, [0, -1]] = 0
    mask[10:20, 10:20] = 0
    mask[40:80, 40:80] = 0
    found = sliding_matrix_contour(mask, 400.0)
    assert len(found.holes) == 1
    assert found.holes[0].min() == 39


def test_only_the_largest_piece_and_its_own_holes_are_kept() -> None:
    mask = np.zeros((100, 200), np.uint8)
    mask[10:90, 10:90] = 255
    mask[20:80, 110:190] = 255
    mask[30:70, 120:180] = 0
    found = sliding_matrix_contour(mask, 10.0)
    assert found.exterior[:, 0].max() == 89
    assert found.holes == ()


def test_filaments_of_one_pixel_do_not_spoil_the_contour() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[20:40, 20:60] = 255
    mask[30, 10:75] = 255
    mask[5:25, 40] = 255
    found = sliding_matrix_contour(mask, 10.0)
    assert contour_defect(found) is None
    assert abs(signed_area(found.exterior)) == pytest.approx(39 * 19, abs=6)  # the filaments' feet stay


@pytest.mark.parametrize("mask", [np.zeros((9, 9), np.uint8), np.diag(np.full(9, 255, np.uint8))])
def test_nothing_that_encloses_area_is_no_block(mask: np.ndarray) -> None:
    with pytest.raises(NoBlockFound):
        largest_contour(mask)
    with pytest.raises(NoBlockFound):
        sliding_matrix_contour(mask, 1.0)


@given(pictures, st.integers(0, 6), st.integers(0, 8))
def test_what_the_scan_drops_as_noise_is_narrow_and_lies_before_its_rows_pair(
    mask: np.ndarray, max_gap_px: int, min_width_px: int
) -> None:
    kept, noise = scan_pairs(mask, max_gap_px, min_width_px)
    assert (kept[:, 2] - kept[:, 1] >= min_width_px).all()
    left_at = dict(zip(kept[:, 0].tolist(), kept[:, 1].tolist(), strict=True))
    for y, left, right in noise.tolist():
        assert right - left < min_width_px
        assert right + max_gap_px < left_at.get(y, mask.shape[1] + max_gap_px)
    empty = set(np.flatnonzero((mask != 0).any(axis=1)).tolist()) - set(left_at)
    assert empty <= set(noise[:, 0].tolist())  # a row with white has a pair, or only noise
