"""What a part may count on: the traced outline, less where it is less sure."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour
from contour.placement.place import placement_at
from contour.placement.pose import Pose
from contour.synthetic import l_shape, rectangle, with_holes
from service.config.recipes import PartToCut
from service.parts.fit import fit_part
from service.parts.part import Asked
from service.parts.part_file import load_part
from service.parts.shapely_contours import polygon_of
from service.parts.sure_block import EVERYWHERE, SureBlock

BLOCK = rectangle((100.0, 50.0), 200.0, 100.0)
"""From (0, 0) to (200, 100)."""


def stretch(ring: int, low: float, high: float, bound_mm: float) -> SentStretch:
    return SentStretch(ring, low, high, "seen", None, 1.0, from_mm=low, to_mm=high, bound_mm=bound_mm)


def sure(block: Contour, uncertainty_mm: float, *evidence: SentStretch) -> SureBlock:
    found = SureBlock.of(block, uncertainty_mm, evidence)
    assert found is not None
    return found


def test_a_block_that_is_as_sure_everywhere_is_what_was_measured() -> None:
    block = sure(BLOCK, 0.3, stretch(0, 0.0, 600.0, 0.3))
    assert block.sure is block.measured
    assert block.bound_mm == EVERYWHERE * 0.3


def test_a_stretch_that_is_less_sure_loses_what_it_is_less_sure_by() -> None:
    start = BLOCK.exterior[0]
    along = float(np.hypot(*(BLOCK.exterior[1] - start)))
    block = sure(BLOCK, 0.5, stretch(0, 0.0, along, 4.0), stretch(0, along, 600.0, 0.5))
    lost = polygon_of(BLOCK).difference(polygon_of(block.sure))
    edge = shapely.LineString(BLOCK.exterior[:2])
    assert lost.area == pytest.approx(3.0 * along, rel=0.01)
    assert lost.hausdorff_distance(edge) == pytest.approx(3.0, abs=0.01)


def test_a_corner_that_points_into_the_material_is_less_sure_than_its_edges() -> None:
    block = l_shape((0.0, 0.0), 200.0, 150.0, 60.0)
    (corner,) = [
        place
        for place, before, after in zip(
            block.exterior, np.roll(block.exterior, 1, axis=0), np.roll(block.exterior, -1, axis=0), strict=True
        )
        if (place - before)[0] * (after - place)[1] - (place - before)[1] * (after - place)[0] < 0
    ]
    found = polygon_of(sure(block, 0.5).sure)
    assert found.distance(shapely.Point(corner)) == pytest.approx(np.sqrt(2.0) - 1.0, rel=0.1)
    lost = polygon_of(block).difference(found)
    assert lost.distance(shapely.Point(corner)) == 0.0
    assert lost.area < 1.0


def test_what_is_sure_of_a_block_with_a_hole_can_be_laid_into() -> None:
    block = with_holes(BLOCK, rectangle((60.0, 50.0), 20.0, 20.0).exterior)
    around = 80.0
    found = sure(block, 0.5, stretch(0, 0.0, 600.0, 0.5), stretch(1, 0.0, around, 6.0)).sure
    assert len(found.holes) == 1
    hole = polygon_of(found).interiors[0]
    assert hole.distance(shapely.Point(60.0, 50.0)) == pytest.approx(15.0, abs=0.01)
    # Corners of edges that may be off by 6 mm, of which 1 mm is the bound; an octagon around.
    corner = (6.0 * np.sqrt(2.0) - 1.0) / np.cos(np.pi / 8)
    assert hole.envelope.area == pytest.approx((20.0 + 2 * corner) ** 2, rel=0.001)


def test_a_block_of_which_nothing_is_sure_is_none() -> None:
    assert SureBlock.of(BLOCK, 0.5, (stretch(0, 0.0, 600.0, 90.0),)) is None


def test_a_part_lies_where_the_edge_is_sure_if_it_fits_nowhere_else(tmp_path: Path) -> None:
    path = tmp_path / "part.json"
    path.write_text(
        json.dumps({"type": "Polygon", "coordinates": [[[0, 0], [90, 0], [90, 90], [0, 90], [0, 0]]]}), encoding="utf-8"
    )
    part, asked = load_part(path, Asked("mm")), PartToCut(file=path, units="mm", margin_mm=3.0, rotation="fixed")
    block = sure(BLOCK, 0.5, stretch(0, 0.0, 600.0, 0.5))
    place = fit_part(part, block, asked).placement.pose.moved(np.array([[45.0, 45.0]]))[0]
    # Less sure above the place that it would have.
    lengths = RingLengths.of(BLOCK.exterior)
    at = float(lengths.feet(np.array([[place[0], 100.0]]))[0])
    less = sure(BLOCK, 0.5, stretch(0, at - 5.0, at + 5.0, 3.0))
    fit = fit_part(part, less, asked)
    assert fit.fits
    assert abs(float(fit.placement.pose.moved(np.array([[45.0, 45.0]]))[0, 0]) - place[0]) > 45.0
    assert fit.margin_mm == placement_at(part.contour, BLOCK, fit.placement.pose).margin


def test_the_bound_is_that_of_the_edge_near_the_part() -> None:
    start = BLOCK.exterior[0]
    along = float(np.hypot(*(BLOCK.exterior[1] - start)))
    block = sure(BLOCK, 0.5, stretch(0, 0.0, along, 4.0))
    part = rectangle((0.0, 0.0), 20.0, 20.0)
    middle = BLOCK.exterior[:2].mean(axis=0)
    inwards = (np.array([100.0, 50.0]) - middle) / np.hypot(*(np.array([100.0, 50.0]) - middle))
    near = middle + 15.0 * inwards
    bounds = [
        block.bound_at(part, placement_at(part, BLOCK, Pose(float(x), float(y), 0.0)))
        for x, y in (near, np.array([200.0, 100.0]) - near)
    ]
    assert bounds == pytest.approx([4.0, 1.0], abs=0.01)
