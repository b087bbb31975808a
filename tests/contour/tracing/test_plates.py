"""A perforated sheet is traced without a promise: its holes show the table; printed patches do not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound
from contour.geometry.agreement import agreement
from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour
from contour.tracing import solid
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.scenes.lattices import Border, Cells, Lattice, lattice

TABLE, SHEET = 60, 200
PITCH, RADIUS = 30, 8


def dotted(dot: int, *, square: bool = False) -> Bytes:
    """A light sheet of 480 × 360 px with patches of a grey level in rows, on a dark table."""
    picture = np.full((520, 640), TABLE, np.uint8)
    cv2.rectangle(picture, (80, 80), (560, 440), SHEET, -1)
    for row in range(13):
        for column in range(15 if row % 2 == 0 else 14):
            x, y = 110 + PITCH * column + (row % 2) * PITCH // 2, 104 + round(26 * row)
            if square:
                cv2.rectangle(picture, (x - RADIUS, y - RADIUS), (x + RADIUS, y + RADIUS), dot, -1)
            else:
                cv2.circle(picture, (x, y), RADIUS, dot, -1, cv2.LINE_AA)
    noise = np.random.default_rng(5).normal(0.0, 1.5, picture.shape)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.8) + noise, 0, 255).astype(np.uint8)


def assert_traced(one: Lattice, edge: str, *, within: float) -> None:
    """It is accepted, its border told, and its outline nowhere off by so many pitches."""
    found = Measurer(None).measure(one.picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), edge)
    assert found.pixels is not None
    assert agreement(found.pixels, one.outline).hausdorff_px < within * one.pitch_px


def test_a_sheet_whose_round_holes_show_the_table_is_traced() -> None:
    found = Measurer(None).measure(dotted(TABLE - 10), PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), "cells")
    assert found.pixels is not None
    truth = Contour(np.array([[79.5, 79.5], [79.5, 440.5], [560.5, 440.5], [560.5, 79.5]]))
    assert agreement(found.pixels, truth).p95_px < 1.0


@pytest.mark.parametrize("seed", [1222006, 1222045])
def test_a_dozen_large_holes_in_a_wide_rim_make_a_sheet(seed: int) -> None:
    assert_traced(lattice(seed, "round", "closed"), "cells", within=0.15)


def test_holes_of_which_few_were_counted_are_asked_whatever_these_look_like() -> None:
    """Webs are as wide as they: those at the cut run into the table where the scale is read."""
    assert_traced(lattice(1500104, "round", "mixed"), "mixed", within=0.15)


@pytest.mark.parametrize("seed", [1224003, 1240010], ids=["material left out", "beside its edge"])
def test_an_outline_that_leaves_the_edge_of_a_cut_sheet_is_refused(seed: int) -> None:
    with pytest.raises(NoBlockFound):
        trace(lattice(seed, "round", "cut").picture, TraceSettings())


@pytest.mark.parametrize("seed", [1240010, 1440042])
def test_a_cut_sheet_of_which_faint_ends_lead_astray_is_found_by_its_strong_webs(seed: int) -> None:
    assert_traced(lattice(seed, "round", "cut"), "cut", within=0.15)


@pytest.mark.parametrize("seed", [3_100_028, 3_100_027])
def test_edges_of_a_cut_sheet_lie_on_its_webs(seed: int) -> None:
    """Few webs end as walls do, and lines through these were off by 17 and 7 px at a corner."""
    assert_traced(lattice(seed, "round", "cut"), "cut", within=0.05)


def test_a_board_whose_squares_are_as_dark_as_the_table_is_none() -> None:
    picture = np.full((520, 640), TABLE, np.uint8)
    rows, columns = np.mgrid[:360, :480] // 40
    picture[80:440, 80:560] = np.where((rows + columns) % 2 == 0, TABLE - 25, SHEET)
    assert (
        Measurer(None)
        .measure(np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.8), np.uint8), PlainRecipe(), 0.0)
        .findings
    )


@pytest.mark.parametrize("border", ["closed", "mixed"])
def test_a_sheet_with_holes_of_a_few_pixels_is_one(border: Border) -> None:
    one = lattice(1211004, "round", border)
    share = 9.9 / one.pitch_px
    picture = np.asarray(cv2.resize(one.picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), np.uint8)
    truth = Contour(*((ring + 0.5) * share - 0.5 for ring in one.outline.rings))
    found = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), {"closed": "cells", "mixed": "mixed"}[border])
    assert found.pixels is not None
    assert agreement(found.pixels, truth).hausdorff_px < 0.3 * 9.9


def test_ink_of_a_few_pixels_is_a_print() -> None:
    picture = np.asarray(cv2.resize(dotted(130), None, fx=0.35, fy=0.35, interpolation=cv2.INTER_AREA), np.uint8)
    assert Reason.NO_BLOCK_FOUND in Measurer(None).measure(picture, PlainRecipe(), 0.0).reasons


@pytest.mark.parametrize(("dot", "square"), [(130, False), (TABLE, True)], ids=["ink", "squares"])
def test_patches_that_do_not_show_the_table_or_are_square_are_a_print(dot: int, square: bool) -> None:
    found = Measurer(None).measure(dotted(dot, square=square), PlainRecipe(), 0.0)
    assert Reason.NO_BLOCK_FOUND in found.reasons


@pytest.mark.parametrize(
    ("seed", "border"), [(977003, "mixed"), (977004, "mixed"), (977005, "mixed"), (977006, "cut"), (977007, "cut")]
)
def test_a_sheet_that_was_cut_through_its_holes_is_traced_along_that(seed: int, border: Border) -> None:
    one = lattice(seed, "round", border)
    found = Measurer(None).measure(one.picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), border)
    assert found.pixels is not None
    assert found.uncertainty_px is not None
    near = agreement(found.pixels, one.outline)
    assert near.hausdorff_px < 0.3 * one.pitch_px
    assert near.holds(found.uncertainty_px)


@pytest.mark.parametrize(
    "seed",
    [1051403, 1092044, 1092049, 1400017, 1400043],
    ids=["many", "two holes", "slivers of three", "one hole", "two small ones, and a dent"],
)
def test_a_cut_that_opens_holes_by_little_is_seen_by_what_touches_its_line(seed: int) -> None:
    assert_traced(lattice(seed, "round", "mixed"), "mixed", within=0.15)


@pytest.mark.parametrize("seed", [1440004, 1440031, 1502217], ids=["small holes", "large ones", "without a line"])
def test_a_dents_rounded_corner_is_no_hole_that_was_opened(seed: int) -> None:
    assert_traced(lattice(seed, "round", "closed"), "cells", within=0.15)


def test_a_cut_out_of_a_sheet_is_held_against_its_material() -> None:
    """Drawn through ends of webs farther out, 0.6 of a pitch."""
    with pytest.raises(NoBlockFound):
        trace(lattice(1440042, "round", "cut").picture, TraceSettings())


@pytest.mark.parametrize("seed", [1051003, 1051005, 1051006])
def test_webs_that_do_not_end_as_walls_do_are_no_closed_border(seed: int) -> None:
    assert_traced(lattice(seed, "round", "mixed"), "mixed", within=0.3)


@pytest.mark.parametrize("cells", ["hexagonal", "flex"])
def test_the_material_of_cells_large_enough_to_be_seen_is_not_looked_at(
    cells: Cells, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes as long as all else of a trace."""
    monkeypatch.setattr(solid, "material_edge", lambda *_: pytest.fail("looked at"))
    assert not Measurer(None).measure(lattice(1411000, cells, "cut").picture, PlainRecipe(), 0.0).reasons


@pytest.mark.parametrize(
    ("seed", "cells"),
    [(1051011, "hexagonal"), (1051013, "over-expanded"), (1204000, "hexagonal"), (1204024, "square")],
    ids=["wide walls", "wide walls, drawn out", "noise in their floor", "noise in the floor of fine ones"],
)
def test_cells_are_no_round_holes(seed: int, cells: Cells) -> None:
    found = Measurer(None).measure(lattice(seed, cells, "closed").picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), "cells")


def test_ends_of_walls_are_asked_where_holes_are_too_small_to_tell() -> None:
    assert_traced(lattice(1051303, "hexagonal", "mixed"), "mixed", within=0.3)
