"""Nothing is seen outside of the region of interest."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.errors import ParameterError
from contour.geometry.rings import hausdorff
from contour.image.region import Region
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.tracing import trace
from tests.support.pictures.small_scenes import block

SETTINGS = TraceSettings()


def traced_in(picture: NDArray[np.uint8], region: Region) -> Trace:
    """The block in the region alone, in pixels of the whole picture."""
    part, first = region.cut(picture)
    return trace(part, SETTINGS).moved(first)


def test_a_box_cuts_out_its_pixels() -> None:
    picture = np.arange(100 * 120, dtype=np.uint32).astype(np.uint8).reshape(100, 120)
    part, first = Region.of_box(10, 20, 59, 69).cut(picture)
    assert first.tolist() == [10.0, 20.0]
    assert np.array_equal(part, picture[20:70, 10:60])


def test_what_lies_in_the_box_of_a_turned_region_but_outside_of_it_is_hidden() -> None:
    picture = np.full((200, 200, 3), 40, np.uint8)
    picture[:50, :50] = 250
    diamond = Region(np.array([[100.0, 10.0], [190.0, 100.0], [100.0, 190.0], [10.0, 100.0]]))
    part, _ = diamond.cut(picture)
    assert part.max() == 40
    assert picture.max() == 250


@pytest.mark.parametrize("box", [(300, 300, 400, 400), (-50, -50, 20, 20), (10, 10, 20, 150)])
def test_a_region_that_leaves_too_little_is_an_error_with_numbers(box: tuple[int, int, int, int]) -> None:
    with pytest.raises(ParameterError, match="200 x 200 px"):
        Region.of_box(*box).cut(np.zeros((200, 200), np.uint8))


def test_the_contour_is_the_same_in_pixels_of_the_whole_picture() -> None:
    rendered = block("rectangle")
    whole = trace(rendered.picture, SETTINGS).contour
    cut = traced_in(rendered.picture, Region.of_box(30, 20, 620, 470)).contour
    assert hausdorff(whole.exterior, cut.exterior, 1.0) < 1.5


def test_a_block_outside_of_the_region_is_not_seen() -> None:
    one = block("rectangle").picture
    two = np.concatenate([one, one], axis=1)
    left = traced_in(two, Region.of_box(0, 0, 639, 479))
    right = traced_in(two, Region.of_box(640, 0, 1279, 479))
    assert left.others == right.others == ()
    assert np.allclose(right.contour.exterior.mean(axis=0) - left.contour.exterior.mean(axis=0), [640, 0], atol=2)


def test_other_pieces_are_told_in_pixels_of_the_whole_picture() -> None:
    one = block("rectangle").picture
    two = np.concatenate([one, one[:, :420]], axis=1)
    plain = trace(two, SETTINGS).others[0].box_px
    in_region = traced_in(two, Region.of_box(40, 8, 1059, 470)).others[0].box_px
    assert np.allclose(plain, in_region, atol=5)


def test_margin_is_the_distance_to_the_border_and_negative_outside() -> None:
    region = Region.of_box(0, 0, 100, 50)
    assert region.margin(np.array([[10.0, 20.0], [50.0, 47.0]])) == pytest.approx(3.0)
    assert region.margin(np.array([[10.0, 20.0], [103.0, 25.0]])) == pytest.approx(-3.0)
