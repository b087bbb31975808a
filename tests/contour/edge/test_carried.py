"""What is hidden along a traced contour stays hidden along the polygon that was made of it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.edge.carried import carried
from contour.edge.stretches import Stretch, bound_with_bridges
from contour.geometry.offset import offset_contour
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, densified, oriented_contour
from contour.polygon.polygon import cutting_polygon
from tests.support.pictures.rings import SQUARE

# As seen counter-clockwise, so clockwise by y-down pixels; edges of 400 px in steps of 5.
CORNERS = SQUARE[::-1] * 40 + 100
TRACED = Contour(densified(CORNERS, 5.0))
HOLED = Contour(TRACED.exterior, (densified(SQUARE * 10 + 250, 5.0),))


def along(*parts: tuple[float, str], ring: int = 0, first: float = 0.0) -> list[Stretch]:
    """Stretches that end at the given lengths and are in the given states."""
    starts = [first, *(end for end, _ in parts)]
    by = {"seen": None, "bridged": "ink", "covered": "object"}
    return [
        Stretch(ring, start, end, state, by[state], 0.4 if state == "seen" else 3.0)
        for start, (end, state) in zip(starts, parts, strict=False)
    ]


def told(stretches: tuple[Stretch, ...], ring: int = 0) -> list[tuple[float, float, str]]:
    return [(round(s.from_px, 6), round(s.to_px, 6), s.state) for s in stretches if s.ring == ring]


def test_stretches_come_along_with_their_lengths_where_only_vertices_are_left_out() -> None:
    given = along((500.0, "seen"), (612.5, "covered"), (1600.0, "seen"))
    found = carried(given, TRACED, Contour(CORNERS))
    assert told(found) == [(0.0, 500.0, "seen"), (500.0, 612.5, "covered"), (612.5, 1600.0, "seen")]
    assert [(s.by, s.bound_px) for s in found] == [(None, 0.4), ("object", 3.0), (None, 0.4)]


def test_a_ring_that_begins_elsewhere_tells_them_from_there() -> None:
    """Begun a corner earlier, all lies 400 px farther on; what ran across the first vertex then is of one piece."""
    given = along((30.0, "covered"), (700.0, "seen"), (800.0, "bridged"), (1560.0, "seen"), (1600.0, "covered"))
    found = carried(given, TRACED, Contour(np.roll(CORNERS, 1, axis=0)))
    assert told(found) == [
        (0.0, 360.0, "seen"), (360.0, 430.0, "covered"), (430.0, 1100.0, "seen"), (1100.0, 1200.0, "bridged"),
        (1200.0, 1600.0, "seen"),
    ]  # fmt: skip


def test_and_across_the_new_first_vertex_they_are_cut() -> None:
    given = along((380.0, "seen"), (430.0, "covered"), (1600.0, "seen"))
    found = carried(given, TRACED, Contour(np.roll(CORNERS, -1, axis=0)))
    assert told(found) == [(0.0, 30.0, "covered"), (30.0, 1580.0, "seen"), (1580.0, 1600.0, "covered")]


def test_holes_have_their_own() -> None:
    given = [*along((1600.0, "seen")), *along((150.0, "seen"), (190.0, "covered"), (400.0, "seen"), ring=1)]
    found = carried(given, HOLED, Contour(CORNERS, (SQUARE * 10 + 250,)))
    assert told(found) == [(0.0, 1600.0, "seen")]
    assert told(found, ring=1) == [(0.0, 150.0, "seen"), (150.0, 190.0, "covered"), (190.0, 400.0, "seen")]


@pytest.mark.parametrize("margin", [30.0, -30.0])
def test_a_margin_moves_them_with_their_edges(margin: float) -> None:
    """An edge of 400 px becomes one of 340 or 460; what lies in its middle stays there."""
    given = along((150.0, "seen"), (250.0, "covered"), (1600.0, "seen"))
    y_up = np.array([1.0, -1.0])
    moved = offset_contour(Contour(CORNERS * y_up), margin)
    polygon = Contour(moved.exterior * y_up)
    (low, high, _), *_ = [piece for piece in told(carried(given, TRACED, polygon)) if piece[2] == "covered"]
    ends = RingLengths.of(polygon.exterior).at(np.array([low, high]))
    before = RingLengths.of(CORNERS).at(np.array([150.0, 250.0]))
    assert np.abs(ends - before).min(axis=1) == pytest.approx([0.0, 0.0], abs=1e-3)
    assert np.abs(ends - before).max(axis=1) == pytest.approx([30.0, 30.0], abs=1e-3)


def test_a_corner_that_the_margin_swallows_is_still_hidden() -> None:
    given = along((390.0, "seen"), (410.0, "covered"), (1600.0, "seen"))
    inner = (CORNERS - 300.0) * 0.8 + 300.0
    states = [piece[2] for piece in told(carried(given, TRACED, Contour(inner)))]
    assert states == ["seen", "covered", "seen"]


def test_a_seen_sliver_between_hidden_parts_is_hidden() -> None:
    given = along((500.0, "seen"), (540.0, "covered"), (540.6, "seen"), (580.0, "covered"), (1600.0, "seen"))
    found = told(carried(given, TRACED, Contour(CORNERS)))
    assert found == [(0.0, 500.0, "seen"), (500.0, 580.0, "covered"), (580.0, 1600.0, "seen")]


def test_a_hidden_sliver_is_never_seen() -> None:
    given = along((500.0, "seen"), (500.01, "covered"), (1600.0, "seen"))
    (_, (low, high, state), _) = told(carried(given, TRACED, Contour(CORNERS)))
    assert state == "covered"
    assert (low, high) == pytest.approx((499.5, 500.5), abs=0.01)


def test_where_parts_of_the_contour_fall_together_the_worse_counts() -> None:
    """A slot of 3 px that the polygon leaves out: its walls are hidden, so is its mouth."""
    slot = np.array([[298.5, 100.0], [298.5, 160.0], [301.5, 160.0], [301.5, 100.0]])
    lower = next(k for k in range(4) if (CORNERS[[k, (k + 1) % 4], 1] == 100.0).all())
    start, end = CORNERS[lower], CORNERS[(lower + 1) % 4]
    slot = slot if start[0] < end[0] else slot[::-1]
    ring = np.vstack([start, slot, end, CORNERS[(lower + 2) % 4], CORNERS[(lower + 3) % 4]])
    given = along((203.0, "seen"), (310.0, "covered"), (1720.0, "seen"))
    found = carried(given, Contour(ring), Contour(np.delete(ring, [1, 2, 3, 4], axis=0)))
    covered = [(low, high) for low, high, state in told(found) if state == "covered"]
    assert covered == [(198.5, 201.5)]


@st.composite
def blocks(draw: st.DrawFn) -> tuple[Contour, list[Stretch]]:
    """A round outline with dents, and stretches of any states along it."""
    radii = np.array(draw(st.lists(st.floats(60.0, 200.0), min_size=5, max_size=40)))
    angle = np.linspace(0.0, 2 * np.pi, len(radii), endpoint=False)
    ring = 400.0 + radii[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    contour = oriented_contour(Contour(densified(ring, 8.0)), counter_clockwise=False)
    around = RingLengths.of(contour.exterior).length
    shares = draw(st.lists(st.floats(0.001, 0.999), max_size=6, unique=True))
    ends = [*sorted(share * around for share in shares), around]
    return contour, along(*((end, draw(st.sampled_from(["seen", "bridged", "covered"]))) for end in ends))


@given(blocks(), st.integers(0, 50), st.sampled_from([0.25, 1.0, 4.0]))
def test_whatever_the_polygon_there_are_no_gaps_and_nothing_hidden_becomes_seen(
    block: tuple[Contour, list[Stretch]], first: int, tolerance: float
) -> None:
    contour, stretches = block
    kept = cutting_polygon(contour, None, height_mm=0.0, tolerance_mm=tolerance).pixels.exterior
    polygon = RingLengths.of(np.roll(kept, first, axis=0))
    found = carried(stretches, contour, Contour(polygon.ring))
    assert (found[0].from_px, found[-1].to_px) == (0.0, polygon.length)
    assert all(one.to_px == other.from_px for one, other in pairwise(found))
    worse = ["seen", "bridged", "covered"]
    traced = RingLengths.of(contour.exterior)
    for stretch in stretches:
        inside = np.linspace(stretch.from_px, stretch.to_px, 20)[1:-1]
        for foot in polygon.feet(traced.at(inside)).tolist():
            there = [s.state for s in found if s.from_px - 1e-6 <= foot <= s.to_px + 1e-6]
            assert max(map(worse.index, there)) >= worse.index(stretch.state)


def test_a_bridged_stretch_widens_the_whole_outlines_bound_and_a_covered_one_does_not() -> None:
    bridged, covered = along((10.0, "bridged"), (20.0, "covered"))
    assert bound_with_bridges(0.5, [replace(covered, bound_px=9.0)]) == 0.5
    assert bound_with_bridges(0.5, [bridged, covered]) == 3.0
    assert bound_with_bridges(4.0, [bridged]) == 4.0
    assert bound_with_bridges(None, [bridged]) is None
