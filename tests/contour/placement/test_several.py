"""Several parts in one block: what is laid keeps its distances by shapely's word, and nothing that has room is left."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from contour.errors import ParameterError
from contour.geometry.rings import Contour
from contour.placement.pose import Turns
from contour.placement.several import MOST_TRIES, Laid, Wanted, lay_several
from contour.synthetic import blob, crescent, disc_ring, l_shape, rectangle, with_holes

BLOCK = with_holes(rectangle((150.0, 100.0), 300.0, 200.0), disc_ring((220.0, 60.0), 30.0))
NEEDED, APART = 3.0, 2.0


def shape_of(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, list(contour.holes))


def placed(wanted: list[Wanted], laid: tuple[Laid, ...]) -> list[shapely.Polygon]:
    return [shape_of(one.placement.pose.placed(wanted[one.index].part)) for one in laid]


def check(wanted: list[Wanted], laid: tuple[Laid, ...], block: Contour, apart: float = APART) -> None:
    """Every distance, by shapely."""
    room, shapes = shape_of(block), placed(wanted, laid)
    for one, shape in zip(laid, shapes, strict=True):
        assert room.contains(shape)
        assert one.placement.margin == pytest.approx(shape.distance(room.boundary), abs=1e-9)
        assert one.placement.margin >= wanted[one.index].needed
        assert shapely.Point(one.placement.tightest[0]).distance(shape.boundary) < 1e-6
    for k, shape in enumerate(shapes):
        assert all(shape.distance(other) >= apart - 1e-9 for other in shapes[:k])


@pytest.mark.parametrize("turns", [Turns.free(), Turns.steps(1), Turns.steps(4), Turns.free().along(30.0, 5.0)])
def test_every_distance_is_kept_whatever_the_turns(turns: Turns) -> None:
    wanted = [
        Wanted(l_shape((0.0, 0.0), 80.0, 60.0, 25.0), 4, NEEDED, 1, turns),
        Wanted(blob((500.0, -300.0), 18.0, 5), 6, NEEDED + 2.0, 1, turns),
        Wanted(with_holes(rectangle((0.0, 0.0), 50.0, 40.0), disc_ring((3.0, 2.0), 12.0)), 2, NEEDED, 2, turns),
    ]
    laid = lay_several(wanted, BLOCK, APART)
    check(wanted, laid, BLOCK)
    assert len(laid) >= 6
    for one in laid:
        if turns == Turns.steps(4):
            assert np.sin(2 * one.placement.pose.angle) == pytest.approx(0.0, abs=1e-9)
        if turns == Turns.free().along(30.0, 5.0):
            off = (np.degrees(one.placement.pose.angle) - 30.0 + 90.0) % 180.0 - 90.0
            assert abs(off) <= 5.0 + 1e-6


def test_rectangles_fill_a_block_that_they_were_cut_from() -> None:
    """Six of 96 mm by 96 mm into 300 mm by 200 mm, with 3 mm between and 1.5 mm around: there is half a millimetre."""
    wanted = [Wanted(rectangle((0.0, 0.0), 96.0, 96.0), 9, 1.5, 1, Turns.steps(4))]
    laid = lay_several(wanted, rectangle((150.0, 100.0), 300.5, 200.5), 3.0)
    check(wanted, laid, rectangle((150.0, 100.0), 300.5, 200.5), 3.0)
    assert len(laid) == 6


def test_the_first_priority_goes_first_though_it_is_smaller() -> None:
    block = rectangle((0.0, 0.0), 110.0, 60.0)
    large = Wanted(rectangle((0.0, 0.0), 100.0, 50.0), 1, 1.0, 2, Turns.steps(1))
    small = Wanted(rectangle((0.0, 0.0), 20.0, 20.0), 1, 1.0, 1, Turns.steps(1))
    assert [one.index for one in lay_several([large, small], block, 1.0)] == [1]
    assert [one.index for one in lay_several([large], block, 1.0)] == [0]


def test_a_part_lies_in_the_hole_of_another() -> None:
    ring = with_holes(rectangle((0.0, 0.0), 190.0, 190.0), disc_ring((0.0, 0.0), 60.0))
    wanted = [
        Wanted(ring, 1, 2.0, 1, Turns.steps(1)),
        Wanted(rectangle((0.0, 0.0), 60.0, 60.0), 1, 2.0, 1, Turns.steps(1)),
    ]
    block = rectangle((0.0, 0.0), 200.0, 200.0)
    laid = lay_several(wanted, block, 2.0)
    check(wanted, laid, block, 2.0)
    assert len(laid) == 2


def test_a_small_hole_within_a_part_is_no_room() -> None:
    """No vertex of the part's outline is near it."""
    block = with_holes(rectangle((0.0, 0.0), 104.0, 104.0), disc_ring((0.0, 0.0), 3.0))
    assert lay_several([Wanted(rectangle((0.0, 0.0), 100.0, 100.0), 1, 1.0, 1, Turns.steps(1))], block, 1.0) == ()


def test_a_part_that_is_larger_than_the_block_is_left() -> None:
    wanted = [Wanted(crescent((0.0, 0.0), 400.0, 300.0, 200.0), 2, 1.0, 1, Turns.free())]
    assert lay_several(wanted, BLOCK, 1.0) == ()


def test_more_tries_never_lay_less() -> None:
    wanted = [Wanted(l_shape((0.0, 0.0), 70.0, 55.0, 20.0), 20, NEEDED, 1, Turns.free())]
    one, all_sides = lay_several(wanted, BLOCK, APART, 1), lay_several(wanted, BLOCK, APART, MOST_TRIES)
    check(wanted, all_sides, BLOCK)
    assert len(all_sides) >= len(one) >= 6
    assert lay_several(wanted, BLOCK, APART, 1) == one, "the same again"


def test_a_shape_that_cannot_be_cut_is_an_error_that_names_it() -> None:
    bow = Contour(np.array([[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0]]))
    with pytest.raises(ParameterError, match="The part 1 cannot be placed"):
        lay_several([Wanted(bow, 1, 1.0, 1, Turns.free())], BLOCK, 1.0)
    with pytest.raises(ParameterError, match="The block cannot be placed"):
        lay_several([], bow, 1.0)
