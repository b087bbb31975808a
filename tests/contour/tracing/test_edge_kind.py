"""Whether a border was cut or closes its cells is read from the picture, and a promise that it contradicts refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Literal

import cv2
import numpy as np
import pytest

from contour.errors import EdgeContradicted, NoBlockFound
from contour.geometry.agreement import agreement
from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour
from contour.material.closed_cells import material_edge
from contour.synthetic import render
from contour.tracing import solid
from contour.tracing.edge_kind import lined_by_walls
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.wall_tips import wall_tips
from contour.walls import see_block
from contour.walls.cell_scale import CellScale, probe
from contour.walls.lightness import wall_light
from contour.walls.wall_mask import wall_mask
from tests.support.scenes.lattices import Border, Cells, Lattice, lattice
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

# Drawn for these tests, and looked at by no rule.
SEED = 977001


@cache
def drawn(cells: Cells, border: Border) -> Lattice:
    return lattice(SEED, cells, border)


def smaller(one: Lattice, pitch_px: float) -> Bytes:
    """Its picture with cells of that pitch."""
    share = pitch_px / one.pitch_px
    return np.asarray(cv2.resize(one.picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), np.uint8)


def traced(one: Lattice, edge: Literal["auto", "cut", "cells"] = "auto") -> Trace:
    return wall_tips(one.picture, TraceSettings(edge=edge))


@pytest.mark.parametrize("cells", ["hexagonal", "square", "flex"])
def test_closed_cells_are_seen_and_traced_as_if_they_were_promised(cells: Cells) -> None:
    one = drawn(cells, "closed")
    found = traced(one)
    assert found.edge == "cells"
    near = agreement(found.contour, one.outline)
    assert near.mean_px < 0.7
    assert near.hausdorff_px < 0.3 * one.pitch_px
    assert found.uncertainty_px is not None
    assert near.holds(found.uncertainty_px)
    promised = traced(one, "cells")
    assert all(np.array_equal(a, b) for a, b in zip(found.contour.rings, promised.contour.rings, strict=True))


@pytest.mark.parametrize("cells", ["hexagonal", "square"])
def test_cut_cells_are_seen_and_traced_as_if_they_were_promised(cells: Cells) -> None:
    one = drawn(cells, "cut")
    found = traced(one)
    assert found.edge == "cut"
    assert agreement(found.contour, one.outline).mean_px < 0.3
    promised = traced(one, "cut")
    assert all(np.array_equal(a, b) for a, b in zip(found.contour.rings, promised.contour.rings, strict=True))


def test_a_cut_border_is_told_also_where_no_line_leads_through_its_ends() -> None:
    with pytest.raises(NoBlockFound) as refused:
        traced(lattice(1051442, "hexagonal", "cut"))
    assert refused.value.edge == "cut"


@pytest.mark.parametrize(("promise", "border"), [("cut", "closed"), ("cells", "cut")])
def test_a_promise_that_the_picture_contradicts_is_refused(promise: Literal["cut", "cells"], border: Border) -> None:
    with pytest.raises(EdgeContradicted, match=f"the recipe says edge: {promise}, but") as refused:
        traced(drawn("hexagonal", border), promise)
    assert refused.value.edge == {"closed": "cells", "cut": "cut"}[border]


@pytest.mark.parametrize("cells", ["hexagonal", "square", "over-expanded", "flex"])
def test_closed_cells_that_were_cut_along_a_line_are_traced_stretch_by_stretch(cells: Cells) -> None:
    one = drawn(cells, "mixed")
    found = traced(one)
    assert found.edge == "mixed"
    near = agreement(found.contour, one.outline)
    assert near.mean_px < 0.7
    assert near.hausdorff_px < 0.3 * one.pitch_px
    assert found.uncertainty_px is not None
    assert near.holds(found.uncertainty_px)


@pytest.mark.parametrize(("seed", "border"), [(994007, "closed"), (994008, "closed"), (994014, "mixed")])
def test_teeth_of_closed_triangles_are_no_ends_of_walls(seed: int, border: Border) -> None:
    one = lattice(seed, "triangular", border)
    found = traced(one)
    assert found.edge == {"closed": "cells", "mixed": "mixed"}[border]
    assert agreement(found.contour, one.outline).hausdorff_px < 0.3 * one.pitch_px


@pytest.mark.parametrize(
    ("seed", "cells"),
    [
        (1051003, "over-expanded"),
        (1051006, "hexagonal"),
        (1051004, "square"),
        (1051443, "over-expanded"),
        (1204007, "over-expanded"),
    ],
    ids=["two arms", "an end in an arm", "a bay larger than a cell", "a bay of a cell and a half", "no bay, but noise"],
)
def test_one_cut_across_a_dent_is_one_cut(seed: int, cells: Cells) -> None:
    one = lattice(seed, cells, "mixed")
    found = traced(one)
    assert found.edge == "mixed"
    assert agreement(found.contour, one.outline).hausdorff_px < 0.3 * one.pitch_px


@pytest.mark.parametrize(
    ("seed", "cells"),
    [
        (1051302, "hexagonal"),
        (1051404, "triangular"),
        (1051322, "over-expanded"),
        (1092020, "square"),
        (1206035, "triangular"),
        (1214002, "triangular"),
        (1224005, "over-expanded"),
        (1224023, "over-expanded"),
        (1246032, "hexagonal"),
        (1250012, "hexagonal"),
        (1222036, "flex"),
        (1400043, "over-expanded"),
        (1400009, "hexagonal"),
    ],
    ids=[
        "no end",
        "no end of triangles",
        "an end beyond the second",
        "openings that grow",
        "nothing hides the border",
        "one opening as deep as teeth",
        "walls thinner and thinner",
        "ends at one end of it",
        "a last wall that stops short",
        "a wall's end beside closed cells that another cut left",
        "walls of which one is left whole",
        "a single cell",
        "floors of cells that differ from the table",
    ],
)
def test_a_cut_at_which_hardly_a_wall_ends_is_seen_by_what_touches_its_line(seed: int, cells: Cells) -> None:
    one = lattice(seed, cells, "mixed")
    found = traced(one)
    assert found.edge == "mixed"
    assert agreement(found.contour, one.outline).hausdorff_px < 0.3 * one.pitch_px


@pytest.mark.parametrize(
    ("seed", "cells", "pitch_px"),
    [(1051321, "hexagonal", 9.0), (1051403, "flex", 12.0), (1051320, "triangular", 48.0)],
    ids=["pixels", "a wave", "teeth"],
)
def test_rows_of_closed_cells_are_no_cut(seed: int, cells: Cells, pitch_px: float) -> None:
    assert wall_tips(smaller(lattice(seed, cells, "closed"), pitch_px), TraceSettings()).edge == "cells"


def test_a_missing_cell_in_an_inner_corner_is_no_cell_that_a_broken_wall_opens() -> None:
    one = lattice(1206004, "square", "closed")
    assert agreement(traced(one).contour, one.outline).hausdorff_px < 0.3 * one.pitch_px


def test_corners_of_fine_closed_cells_are_no_ends_of_walls() -> None:
    """A cut border as fine is traced also where the material runs along it and has no ends."""
    with pytest.raises(EdgeContradicted, match="too small to tell"):
        wall_tips(smaller(lattice(1212000, "hexagonal", "mixed"), 7.38), TraceSettings())
    assert wall_tips(smaller(lattice(1211009, "square", "cut"), 8.0), TraceSettings()).edge == "cut"


def test_a_border_cut_on_all_sides_is_traced_by_its_ends_whatever_touches_some_of_them() -> None:
    """Of floors that differ little from the table two cells were bays, 0.6 of a pitch deep."""
    one = lattice(1492010, "triangular", "cut")
    found = traced(one)
    assert found.edge == "cut"
    assert agreement(found.contour, one.outline).hausdorff_px < 0.1 * one.pitch_px


def test_fine_teeth_that_blur_rounds_are_no_cut() -> None:
    assert traced(lattice(1205017, "triangular", "closed")).edge == "cells"


def test_a_cut_that_ends_in_a_sliver_of_a_wall_is_refused() -> None:
    with pytest.raises(EdgeContradicted):
        traced(lattice(1204005, "triangular", "mixed"))


def test_triangles_that_a_cut_opened_are_not_traced_as_closed_ones() -> None:
    with pytest.raises(EdgeContradicted, match="walls end along a part"):
        traced(lattice(4460009, "triangular", "mixed"))


def test_such_a_cut_runs_to_the_last_thing_that_touches_its_line() -> None:
    one = lattice(1051322, "over-expanded", "mixed")
    found = wall_tips(smaller(one, 12.0), TraceSettings())
    back = Contour((found.contour.exterior + 0.5) * (one.pitch_px / 12.0) - 0.5)
    assert agreement(back, one.outline).hausdorff_px < 0.3 * one.pitch_px


def test_a_border_of_both_kinds_does_not_hold_the_promise_that_it_was_cut() -> None:
    with pytest.raises(EdgeContradicted, match="was cut there"):
        traced(drawn("hexagonal", "mixed"), "cut")


def test_closed_cells_that_were_cut_along_a_curve_are_refused() -> None:
    one = drawn("hexagonal", "closed")
    y, x = np.mgrid[: one.picture.shape[0], : one.picture.shape[1]]
    middle, corner = one.outline.exterior.mean(axis=0), one.outline.exterior.max(axis=0)
    away = np.hypot(x - corner[0], y - middle[1]) < 0.7 * (corner - middle)[0]
    with pytest.raises(EdgeContradicted, match="was cut there") as refused:
        wall_tips(np.where(away, one.picture[0, 0], one.picture), TraceSettings())
    assert refused.value.edge == "mixed"


@pytest.mark.parametrize(
    ("seed", "cells", "border", "kind"),
    [
        (1081002, "flex", "closed", "cells"),
        (1081005, "hexagonal", "closed", "cells"),
        (1081010, "round", "closed", "cells"),
        (1081007, "round", "mixed", "mixed"),
        (1081004, "round", "cut", "cut"),
        (1081009, "triangular", "cut", "cut"),
        (1081001, "square", "mixed", "mixed"),
        (1084011, "triangular", "mixed", "mixed"),
        (1051004, "triangular", "mixed", "mixed"),
        (1085039, "round", "cut", "cut"),
    ],
    ids=[
        "a row that waves",
        "fine cells that may be round",
        "a sheet's inner corner",
        "holes opened by little",
        "webs as wide as holes",
        "rows of shallow teeth on several sides",
        "a wall that ends short of the cut",
        "fine triangles",
        "one end among fine triangles",
        "a sheet cut along four lines",
    ],
)
def test_borders_that_were_once_mistaken_are_told_and_traced(
    seed: int, cells: Cells, border: Border, kind: str
) -> None:
    one = lattice(seed, cells, border)
    found = traced(one)
    assert found.edge == kind
    assert agreement(found.contour, one.outline).hausdorff_px < 0.25 * one.pitch_px


def test_the_scale_of_a_grey_picture_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def counted(light: Bytes, polarity: str) -> CellScale:
        read.append(polarity)
        return probe(light, polarity)

    for module in (solid, see_block):
        monkeypatch.setattr(module, "probe", counted)
    assert wall_tips(drawn("hexagonal", "closed").picture, TraceSettings()).edge == "cells"
    assert read == ["auto"]


@pytest.mark.parametrize(("border", "lined"), [("closed", True), ("cut", False)])
def test_walls_line_a_closed_border_and_no_cut_one_on_a_table_as_light_as_they(border: Border, lined: bool) -> None:
    one = drawn("hexagonal", border)
    level = probe(wall_light(one.picture), "auto").level
    block = cv2.fillPoly(np.zeros_like(one.picture), [np.rint(one.outline.exterior).astype(np.int32)], 255)
    table = level if border == "cut" else float(np.median(one.picture[block == 0]))
    picture = cv2.GaussianBlur(np.where(block > 0, one.picture, np.uint8(table)), (0, 0), 0.7)
    light = wall_light(np.asarray(picture, np.uint8))
    cells = probe(light, "auto")
    mask = wall_mask(light, cells.pitch_px, bright=cells.bright, contrast=cells.contrast).mask
    material = material_edge(np.asarray(picture, np.uint8), cells.pitch_px, mask)
    assert lined_by_walls(material.contour.exterior, light, cells) == lined
    assert not lined_by_walls(material.contour.exterior, light, replace(cells, level=cells.floor, floor=cells.level))


def test_cells_filled_with_light_compound_amid_a_block_are_no_block_of_closed_cells() -> None:
    rendered = render(shop_floor_scene("light_table", 1_720_027).scene)
    with pytest.raises(NoBlockFound):
        wall_tips(rendered.picture, TraceSettings())
