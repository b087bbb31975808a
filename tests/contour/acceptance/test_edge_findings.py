"""A polygon along an edge that is hidden is refused by name, with what hides it, over how much, and where."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contour.acceptance.acceptance import View, judge
from contour.acceptance.edge_findings import edge_covered
from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.sent_evidence import ToMillimetres, sent_evidence
from contour.acceptance.trace_check import CheckedTrace
from contour.edge.stretches import Stretch
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.polygon.polygon import Polygon
from contour.tracing.trace import Trace
from tests.support.pictures.rings import SQUARE

# As seen counter-clockwise: from (100, 100) px down to (100, 500), then right, up, and back. A pixel is half a mm.
EXTERIOR = np.roll(SQUARE[::-1], 1, axis=0) * 40 + 100
HOLE = SQUARE * 10 + 250
PIXELS = Contour(EXTERIOR, (HOLE,))


def half(pixels: Float64s) -> Float64s:
    return pixels * [0.5, -0.5]


POLYGON = Polygon(
    PIXELS, Contour(half(EXTERIOR), (half(HOLE),)), 150_000.0, 37_500.0, 0.5, shift_px=0.3, given_up_px=1.0
)
VIEW = View((640, 640))


def stretches(*parts: tuple[float, str], ring: int = 0, **hidden: Any) -> list[Stretch]:
    """Stretches that end at these lengths, in these states; what is hidden has more fields."""
    starts = [0.0, *(end for end, _ in parts)]
    return [
        Stretch(ring, start, end, state, None, 0.4)
        if state == "seen"
        else Stretch(ring, start, end, state, **{"by": "object", "bound_px": 4.0, **hidden})
        for start, (end, state) in zip(starts, parts, strict=False)
    ]


SEEN = stretches((1600.0, "seen"))
HOLE_SEEN = stretches((400.0, "seen"), ring=1)


def traced(*given: Stretch) -> Trace:
    return Trace("wall-tips", "bright", 24.0, PIXELS, np.zeros((1, 1), np.uint8), evidence=given)


def text(trace: Trace, limits: Limits | None = None, to_mm: ToMillimetres | None = half) -> str | None:
    finding = edge_covered(trace, to_mm, limits or Limits())
    assert finding is None or finding.refusal is Refusal.EDGE_COVERED
    return finding and finding.text


def test_what_is_seen_all_around_is_accepted_and_so_is_what_says_nothing() -> None:
    assert text(traced(*SEEN, *HOLE_SEEN)) is None
    assert text(replace(traced(), evidence=None)) is None
    assert edge_covered(None, half, Limits()) is None


def test_a_covered_stretch_in_the_middle_of_an_edge_is_told_with_what_hides_it_how_long_and_where() -> None:
    covered = traced(*stretches((150.0, "seen"), (250.0, "covered"), (1600.0, "seen")), *HOLE_SEEN)
    assert text(covered, Limits(max_bridged_mm=1000.0, bridge="arcs")) == (
        "An object lies over 50.0 mm (100 px) of the block's edge near (100, 300) px, (50.0, -150.0) mm: "
        "how it runs below cannot be told. Take it away."
    )


def test_across_the_first_vertex_it_is_one_stretch() -> None:
    parts = stretches((60.0, "covered"), (1560.0, "seen"), (1600.0, "covered"), by="ink")
    assert "Ink lies over 50.0 mm (100 px) of the block's edge near (100, 110) px, (50.0, -55.0) mm: how" in str(
        text(traced(*parts, *HOLE_SEEN))
    )


def test_a_hole_is_named_and_unknown_things_are_something() -> None:
    parts = stretches((10.0, "seen"), (30.0, "covered"), (400.0, "seen"), ring=1, by=None)
    told = str(text(traced(*SEEN, *parts)))
    assert told.startswith("Something lies over 10.0 mm (20 px) of the edge of hole 1 near (270, 250) px")


def test_of_two_the_longer_is_told_and_the_other_counted() -> None:
    parts = stretches((100.0, "seen"), (120.0, "covered"), (600.0, "seen"), (660.0, "covered"), (1600.0, "seen"))
    assert "over 30.0 mm (60 px) of the block's edge near (330, 500) px, (165.0, -250.0) mm, and 1 more: " in (
        str(text(traced(*parts, *HOLE_SEEN)))
    )


def test_all_of_a_ring_may_be_covered() -> None:
    told = text(traced(*SEEN, *stretches((400.0, "covered"), ring=1)))
    assert "200.0 mm (400 px) of the edge of hole 1" in str(told)


def test_a_bridge_is_refused_where_the_recipe_allows_none_or_a_shorter_one() -> None:
    bridged = traced(*stretches((150.0, "seen"), (250.0, "bridged"), (1600.0, "seen")), *HOLE_SEEN)
    assert "50.0 mm (100 px)" in str(text(bridged))
    assert "the recipe allows 0 mm to be bridged. Take" in str(text(bridged))
    assert "the recipe allows 49 mm" in str(text(bridged, Limits(max_bridged_mm=49.0)))
    assert text(bridged, Limits(max_bridged_mm=50.1)) is None


def test_two_bridges_side_by_side_are_one_hidden_part_of_the_edge() -> None:
    parts = stretches((200.0, "bridged"), (240.0, "bridged"), (1500.0, "seen"), (1600.0, "bridged"))
    parts[1] = replace(parts[1], by="ink", bound_px=9.0)
    found = traced(*parts, *HOLE_SEEN)
    assert "An object lies over 170.0 mm (340 px)" in str(text(found, Limits(max_bridged_mm=169.0)))
    assert text(found, Limits(max_bridged_mm=171.0)) is None


def test_a_bridge_along_an_arc_needs_a_recipe_that_has_arcs_bridged() -> None:
    bent = traced(*stretches((150.0, "seen"), (250.0, "bridged"), (1600.0, "seen"), straight=False), *HOLE_SEEN)
    straight = Limits(max_bridged_mm=60.0)
    assert "it is not straight there" in str(text(bent, straight))
    assert text(bent, replace(straight, bridge="arcs")) is None


def test_how_long_a_hidden_part_is_does_not_depend_on_the_margin() -> None:
    """A curve is shorter on the polygon, moved inwards: what counts is the edge itself."""
    angle = np.linspace(0.0, 2 * np.pi, 200, endpoint=False)[::-1]
    ring = 300.0 + 200.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    round_ = replace(traced(*stretches((100.0, "bridged"), (1256.0, "seen"))), contour=Contour(ring))
    small = Contour((ring - 300.0) * 0.5 + 300.0)
    polygon = replace(POLYGON, pixels=small, millimetres=Contour(half(small.exterior)))
    limits = Limits(max_bridged_mm=30.0)
    told = [finding.text for finding in judge(polygon, VIEW, limits, traced=CheckedTrace(round_), to_mm=half)]
    assert [text.split(" of ")[0] for text in told] == ["An object lies over 50.0 mm (100 px)"]


def test_without_a_calibration_nothing_is_bridged() -> None:
    """How long it is in millimetres nobody knows."""
    parts = [*stretches((150.0, "seen"), (250.0, "bridged"), (1600.0, "seen")), *HOLE_SEEN]
    found = sent_evidence(traced(*parts), replace(POLYGON, millimetres=None, mm_per_px=None), None, None)
    assert found is not None
    assert {(s.from_mm, s.to_mm, s.bound_mm) for s in found} == {(None, None, None)}
    assert "An object lies over 100 px of the block's edge near (100, 300) px: the" in str(
        text(traced(*parts), Limits(max_bridged_mm=1000.0), None)
    )


def test_the_verdict_on_the_whole_tells_it_among_the_others() -> None:
    covered = traced(*stretches((150.0, "seen"), (250.0, "covered"), (1600.0, "seen")), *HOLE_SEEN)
    limits = Limits(max_area_mm2=1.0)
    codes = [int(finding.refusal) for finding in judge(POLYGON, VIEW, limits, traced=CheckedTrace(covered))]
    assert codes == [112, 117]


def test_each_stretch_has_the_bound_of_what_is_sent() -> None:
    """With what leaving vertices out, and the budget, may have shifted; in millimetres with all other causes."""
    trace = traced(*stretches((150.0, "seen"), (250.0, "bridged"), (1600.0, "seen")), *HOLE_SEEN)
    found = sent_evidence(trace, POLYGON, ErrorBudget(0.2, 0.3, None), half)
    assert found is not None
    bridged = found[1]
    sure_px = np.hypot(4.0, 0.3) + 1.0
    assert bridged.bound_px == pytest.approx(sure_px)
    assert bridged.bound_mm == pytest.approx(np.hypot(sure_px * 0.5, 0.3))


def test_lengths_in_millimetres_follow_the_scale_along_an_edge() -> None:
    """Seen at a slant, the nearer half of an edge has more pixels: places are converted, not shares of edges."""

    def slanted(pixels: Float64s) -> Float64s:
        return pixels / (1.0 + 0.001 * pixels[:, 1:]) * [1.0, -1.0]

    polygon = replace(POLYGON, millimetres=Contour(slanted(EXTERIOR), (slanted(HOLE),)))
    parts = stretches((150.0, "seen"), (250.0, "covered"), (1600.0, "seen"))
    found = sent_evidence(traced(*parts, *HOLE_SEEN), polygon, None, slanted)
    assert found is not None
    ends = slanted(np.array([[100.0, 100.0], [100.0, 250.0], [100.0, 350.0]]))
    assert [found[1].from_mm, found[1].to_mm] == pytest.approx(np.hypot(*(ends[1:] - ends[0]).T))
    assert found[0].from_mm == 0.0
    assert found[2].to_mm == pytest.approx(np.hypot(*(np.roll(slanted(EXTERIOR), -1, 0) - slanted(EXTERIOR)).T).sum())
    assert {stretch.bound_mm for stretch in found} == {None}
