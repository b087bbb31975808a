import cv2
import numpy as np
import pytest

from contour.errors import PictureError
from contour.geometry.rings import Contour
from contour.image.overlay import ACCEPTED, DOUBTED, HOLE, PART, REFUSED, VERTEX, DrawnPart, Hidden, draw_overlay
from tests.support.pictures.rings import SQUARE

OUTLINE = Contour(SQUARE * [50, 30] + [150.0, 150.0], (SQUARE[::-1] * 8 + [300.0, 250.0],))


def near(picture: np.ndarray, x: int, y: int, colour: tuple[int, int, int], reach: int = 2) -> bool:
    """True where the colour is on some pixel around (x, y), nearly."""
    around = picture[y - reach : y + reach + 1, x - reach : x + reach + 1].reshape(-1, 3).astype(int)
    return bool((np.abs(around - colour).max(axis=1) < 40).any())


@pytest.mark.parametrize("level", [0, 128, 255])
def test_exterior_holes_and_vertices_stand_out_on_any_grey(level: int) -> None:
    drawn = draw_overlay(np.full((600, 800), level, np.uint8), OUTLINE)
    assert drawn.shape == (600, 800, 3)
    assert near(drawn, 400, 150, ACCEPTED)
    assert near(drawn, 300, 290, HOLE)
    assert near(drawn, 150, 150, VERTEX)
    assert not near(drawn, 400, 350, ACCEPTED)


def test_a_refused_contour_is_red() -> None:
    drawn = draw_overlay(np.zeros((600, 800, 3), np.uint8), OUTLINE, refused=True)
    assert near(drawn, 400, 150, REFUSED)
    assert not near(drawn, 400, 150, ACCEPTED)


def test_lines_are_drawn_at_fractions_of_a_pixel() -> None:
    picture = np.zeros((100, 100), np.uint8)
    first = draw_overlay(picture, Contour(SQUARE * 5 + 20.0))
    second = draw_overlay(picture, Contour(SQUARE * 5 + 20.4))
    assert (first != second).any()


def test_lines_and_letters_grow_with_the_picture() -> None:
    small = draw_overlay(np.zeros((600, 800), np.uint8), OUTLINE, caption=["accepted"])
    scaled = Contour(OUTLINE.exterior * 5, tuple(hole * 5 for hole in OUTLINE.holes))
    large = draw_overlay(np.zeros((3000, 4000), np.uint8), scaled, caption=["accepted"])
    shares = [np.mean(drawn.max(axis=2) > 60) for drawn in (small, large)]
    assert shares[1] == pytest.approx(shares[0], rel=0.4)


def test_no_line_of_the_caption_is_wider_than_the_picture_however_long() -> None:
    blank = np.zeros((400, 600), np.uint8)
    drawn = draw_overlay(blank, None, caption=["refused: area_out_of_limits", "a long reason, " * 20])
    written = np.flatnonzero(drawn.max(axis=(0, 2)) > 100)
    assert len(written)
    assert written.max() < 598


def test_a_picture_without_a_contour_and_without_text_is_the_picture() -> None:
    picture = np.random.default_rng(0).integers(0, 256, (50, 60)).astype(np.uint8)
    np.testing.assert_array_equal(draw_overlay(picture, None), cv2.merge([picture] * 3))


def test_the_input_is_left_alone() -> None:
    for shape in ((200, 300), (200, 300, 3)):
        picture = np.full(shape, 90, np.uint8)
        draw_overlay(picture, Contour(SQUARE * 10 + 50), caption=["text"])
        assert (picture == 90).all()


def test_a_contour_far_outside_and_a_tiny_picture_are_no_special_case() -> None:
    far = draw_overlay(np.zeros((3, 3), np.uint8), Contour(SQUARE * 1e9 - 1e9), caption=["accepted", "text"])
    tiny = draw_overlay(np.zeros((1, 1, 3), np.uint8), OUTLINE, caption=["accepted"])
    assert (far.shape[1:], tiny.shape[1:]) == ((3, 3), (1, 3))
    assert (far.dtype, tiny.dtype) == (np.uint8, np.uint8)


def test_thousands_of_vertices_are_drawn_as_a_line_without_marks() -> None:
    angle = np.linspace(0, 2 * np.pi, 5000, endpoint=False)
    circle = Contour(np.column_stack([np.cos(angle), np.sin(angle)]) * 200 + 300)
    drawn = draw_overlay(np.zeros((600, 600), np.uint8), circle)
    assert near(drawn, 500, 300, ACCEPTED)
    assert not (np.abs(drawn.astype(int) - VERTEX).max(axis=2) < 20).any()


def test_an_array_that_is_no_picture_is_refused() -> None:
    with pytest.raises(PictureError):
        draw_overlay(np.zeros((5, 5), np.uint16), None)


def test_a_veil_covers_what_the_contour_may_be_off_by_where_it_is_wider_than_the_line() -> None:
    grey = np.full((600, 800), 100, np.uint8)
    plain, narrow, wide = (draw_overlay(grey, OUTLINE, marks=False, uncertainty_px=px) for px in (None, 0.5, 12.0))
    np.testing.assert_array_equal(narrow, plain)
    assert near(plain, 400, 160, (100, 100, 100), reach=0)
    assert near(wide, 400, 160, tuple(round(0.65 * 100 + 0.35 * part) for part in VERTEX), reach=0)
    assert near(wide, 400, 175, (100, 100, 100), reach=0)


def test_the_caption_stands_beside_the_picture_and_hides_nothing_of_it() -> None:
    picture = np.random.default_rng(0).integers(100, 256, (600, 800)).astype(np.uint8)
    drawn = draw_overlay(picture, None, caption=["refused: 111 touches_border", "wall-tips"], refused=True)
    rows = len(drawn) - 600
    assert 20 < rows < 100
    np.testing.assert_array_equal(drawn[rows:], cv2.merge([picture] * 3))
    assert near(drawn, 12, rows // 3, REFUSED, reach=10)
    assert draw_overlay(picture, None, refused=True).shape == (600, 800, 3)


def test_what_speaks_against_it_is_shown_over_all_else() -> None:
    why = np.array([[350.0, 150.0], [450.0, 150.0], [450.0, 500.0]])
    drawn = draw_overlay(np.zeros((600, 800), np.uint8), OUTLINE, refused=True, shown_px=[why], marks=False)
    assert near(drawn, 400, 150, VERTEX, reach=0)
    assert near(drawn, 450, 490, VERTEX, reach=0)
    assert near(drawn, 300, 150, REFUSED)
    assert not near(drawn, 400, 320, VERTEX), "it is a path and no ring"


def test_of_hidden_parts_covered_ones_are_red_and_bridged_ones_dashed() -> None:
    """The exterior's first edge runs from (150, 150) to the right, the hole's from (300, 330)."""
    parts = [Hidden(0, 100.0, 200.0, True), Hidden(0, 300.0, 400.0, False), Hidden(1, 0.0, 60.0, True)]
    blank = np.zeros((600, 800), np.uint8)
    drawn = draw_overlay(blank, OUTLINE, refused=True, hidden=parts, marks=False)
    assert near(drawn, 300, 150, REFUSED, reach=1)
    assert near(drawn, 200, 150, DOUBTED, reach=1)
    assert near(drawn, 330, 330, REFUSED, reach=1)
    assert near(drawn, 370, 330, HOLE, reach=1)
    dashes = drawn[150, 451:550].max(axis=1) > 128
    assert np.count_nonzero(np.diff(dashes.astype(int))) == 10
    assert 0.3 < dashes.mean() < 0.7
    assert dashes[0]
    assert dashes[-1]
    assert near(draw_overlay(blank, OUTLINE, refused=True, hidden=parts[1:2]), 200, 150, REFUSED, reach=1)
    assert near(draw_overlay(blank, OUTLINE, hidden=parts[1:2]), 200, 150, ACCEPTED, reach=1)


@pytest.mark.parametrize(("fits", "colour"), [(True, PART), (False, REFUSED)])
def test_a_part_is_drawn_with_its_margin_and_its_tightest_place(fits: bool, colour: tuple[int, int, int]) -> None:
    outline = Contour(SQUARE * [20, 10] + [400.0, 200.0], (SQUARE[::-1] * 4 + [480.0, 230.0],))
    part = DrawnPart(outline, 12.0, ((400.0, 250.0), (380.0, 250.0)), fits)
    drawn = draw_overlay(np.full((600, 800), 60, np.uint8), OUTLINE, parts=(part,))
    assert near(drawn, 500, 200, colour)
    assert near(drawn, 500, 230, colour)
    assert near(drawn, 400, 250, VERTEX, reach=1)
    assert near(drawn, 390, 250, VERTEX, reach=1)
    # The veil lies around the outline, not in the part's material, and no wider than the margin.
    assert (drawn[191, 450] != 60).any()
    assert (drawn[212, 450] == 60).all()
    assert (drawn[185, 450] == 60).all()


def test_one_of_several_parts_has_its_number_in_its_material() -> None:
    hollow = Contour(SQUARE * [30, 20] + [300.0, 200.0], (SQUARE[::-1] * [10, 16] + [440.0, 220.0],))
    one, other = (
        draw_overlay(
            np.full((600, 800), 60, np.uint8),
            OUTLINE,
            parts=(DrawnPart(hollow, 0.0, ((300.0, 250.0), (280.0, 250.0)), True, number),),
        )
        for number in (None, 3)
    )
    rows, columns = np.nonzero((one != other).any(axis=2))
    assert len(rows)
    assert 300 < columns.min() <= columns.max() < 440
    assert 200 < rows.min() <= rows.max() < 400
