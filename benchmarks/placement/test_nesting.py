"""The bench's judge finds what is broken, its slits leave the block as it was, and its table counts."""

from __future__ import annotations

import pytest
import shapely

from benchmarks.placement.nesting import Case, Judged, by_u_nesting, drawn_parts, judged, report, slit_open
from contour.geometry.rings import area, contour_defect
from contour.synthetic import disc_ring, rectangle, with_holes

BLOCK = with_holes(rectangle((150.0, 100.0), 300.0, 200.0), disc_ring((220.0, 60.0), 30.0))


def test_parts_too_near_to_the_edge_or_to_one_another_are_counted() -> None:
    parts = [
        rectangle((30.0, 30.0), 50.0, 50.0),
        rectangle((82.0, 30.0), 50.0, 50.0),
        rectangle((220.0, 60.0), 9.0, 9.0),
    ]
    found = judged(parts, BLOCK, 5.5)
    assert (found.count, found.near_edge, found.near_another) == (3, 3, 1)
    assert judged(parts[:1], BLOCK, 5.0).near_edge == 0


def test_a_block_with_its_hole_slit_open_is_the_block() -> None:
    ring = shapely.Polygon(slit_open(BLOCK, 0.01))
    assert ring.is_valid
    assert not ring.interiors
    assert ring.area == pytest.approx(area(BLOCK), abs=2.0)


def test_what_the_other_lays_is_read_as_it_means_it() -> None:
    pytest.importorskip("u_nesting", reason="pip install u-nesting")
    parts = drawn_parts(BLOCK, 3)
    assert all(contour_defect(part) is None for part in parts)
    laid = by_u_nesting(parts, BLOCK, 3.0, 2.0, "nfp")
    found = judged(laid, BLOCK, 3.0)
    assert found.count > 0
    assert (found.near_edge, found.near_another) == (0, 0)


def test_the_table_counts_the_blocks_on_which_one_lays_less() -> None:
    cases = [
        Case(5, Judged(0.4, 9, 0, 0), Judged(0.3, 7, 1, 0), 0, 1.0, 1.0),
        Case(9, Judged(0.2, 4, 0, 0), Judged(0.3, 7, 0, 2), 1, 1.0, 1.0),
    ]
    text = report(cases)
    assert "| blocks on which it lays less than the other | 1 | 1 |" in text
    assert "| parts nearer to one another than asked | 0 | 2 |" in text
    assert "2 random blocks with holes from 5 to 9" in text
