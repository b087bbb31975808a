"""What each kind of picture asks for: forms, materials, reliefs and places of things, table, block and light."""

from __future__ import annotations

from dataclasses import dataclass, field

from benchmarks.sixth_hand.camera import Lens
from benchmarks.sixth_hand.stage import Wish
from benchmarks.sixth_hand.things import Thing


@dataclass(frozen=True)
class Plan:
    """What a kind asks of its pictures, with things over the block and beside it."""

    wish: Wish = field(default_factory=Wish)
    over: tuple[Thing, ...] = ()
    beside: tuple[Thing, ...] = ()
    lens: Lens = field(default_factory=Lens)


def _over(*things: Thing, wish: Wish | None = None) -> Plan:
    """A plan with things over the block."""
    return Plan(wish or Wish(), things)


_SOLID = ("thin", "thick", "thick")
_LOW = ("flat", "thin", "thin")

_OVER: dict[str, Plan] = {
    "over_band_plain": _over(Thing(("band",), ("plain", "gradient", "glossy"), _LOW)),
    "over_band_printed": _over(Thing(("band",), ("text", "stripes"), _LOW)),
    "over_band_clear": _over(Thing(("band",), ("plain", "glossy", "brushed"), _LOW, clear=1)),
    "over_band_wood": _over(Thing(("band", "polygon"), ("wood",), ("thick",))),
    "over_band_metal": _over(Thing(("band", "polygon"), ("brushed", "glossy", "gradient"), _SOLID)),
    "over_band_woven": _over(Thing(("band", "curve"), ("woven", "corrugated", "fur"), _LOW)),
    "over_curve_cable": _over(Thing(("curve",), ("plain", "glossy", "woven"), ("round",), size=(0.8, 3), count=(1, 4))),
    "over_curve_hose": _over(Thing(("curve",), ("corrugated", "glossy", "plain"), ("round",), size=(2, 9))),
    "over_polygon_paper": _over(Thing(("polygon",), ("text", "plain", "grid", "stripes"), _LOW)),
    "over_polygon_perforated": _over(Thing(("polygon", "band"), ("perforated",), _SOLID)),
    "over_polygon_mesh": _over(Thing(("polygon", "sheet", "band"), ("mesh",), _LOW)),
    "over_polygon_comblike": _over(Thing(("polygon", "sheet", "band", "blob"), ("comblike",), _SOLID)),
    "over_sheet_bubble": _over(Thing(("sheet", "polygon"), ("bubble",), _LOW, clear=0.4)),
    "over_sheet_film": _over(Thing(("sheet", "polygon"), ("cloth", "glossy", "crumpled", "plain"), _LOW, clear=1)),
    "over_sheet_foil": _over(Thing(("sheet",), ("crumpled", "brushed"), _SOLID)),
    "over_sheet_torn": _over(Thing(("sheet",), ("plain", "text", "speckled", "woven"), _LOW)),
    "over_cloth_folds": _over(Thing(("sheet", "blob"), ("cloth", "fur", "woven"), ("thick", "round"))),
    "over_blob_foam": _over(Thing(("blob", "polygon", "disc"), ("foam",), ("thick",))),
    "over_disc_ring": _over(Thing(("disc", "ellipse", "ring"), (), ("thick", "round", "thin"))),
    "over_comb_teeth": _over(Thing(("rake",), (), _SOLID, size=(2.5, 9))),
    "over_bundle": _over(Thing(("bundle",), ("plain", "glossy", "woven"), ("round", "thin"))),
    "over_hand": _over(
        Thing(("hand",), ("plain", "cloth", "woven", "foam", "fur"), ("round", "thick"), ("edge", "corner"))
    ),
    "over_tool": _over(Thing(("tool",), ("brushed", "plain", "glossy"), ("thick", "round"))),
    "over_black": _over(Thing(light="black", materials=("plain", "foam", "fur", "cloth", "gradient"))),
    "over_white": _over(Thing(light="white", materials=("plain", "gradient", "cloth", "foam", "brushed"))),
    "over_like_table": _over(Thing(light="table")),
    "over_like_walls": _over(Thing(light="walls")),
    "over_corner": _over(Thing(places=("corner",))),
    "over_hollow": _over(Thing(places=("hollow",)), wish=Wish("notches")),
    "over_hole": _over(Thing(places=("hole",)), wish=Wish("holes")),
    "over_inside": _over(Thing(places=("inside",), count=(1, 4))),
    "over_many": _over(Thing(count=(2, 5)), Thing(count=(1, 4), size=(0.8, 4))),
    "over_small": _over(Thing(size=(0.6, 2.2), count=(1, 6), forms=("polygon", "blob", "ellipse", "band", "tool"))),
}

_OPEN: dict[str, Plan] = {
    "table_brushed": Plan(Wish(table="brushed")),
    "table_wood": Plan(Wish(table="wood")),
    "table_channels": Plan(Wish(table="channels")),
    "table_grid": Plan(Wish(table="grid")),
    "table_perforated": Plan(Wish(table="perforated")),
    "table_comblike": Plan(Wish(table="comblike")),
    "table_printed": Plan(Wish(table="text")),
    "table_cloth": Plan(Wish(table="cloth")),
    "stains": Plan(Wish(stains=True)),
    "lines": Plan(Wish(lines=True, stains=True)),
    "beside_forms": Plan(beside=(Thing(count=(1, 6)),)),
    "beside_bands": Plan(beside=(Thing(("band", "curve", "bundle"), count=(1, 6)),)),
    "beside_small": Plan(beside=(Thing(size=(0.6, 3), count=(4, 14)),)),
    "own_shadow": Plan(Wish(hard=True)),
    "holes_black": Plan(Wish("holes", hole_light="black")),
    "holes_lit": Plan(Wish("holes", hole_light="lit")),
    "holes_shadow": Plan(Wish("holes", hole_light="lit", hard=True)),
    "slots": Plan(Wish("slots")),
    "notches": Plan(Wish("notches")),
    "teeth": Plan(Wish("teeth")),
    "filled_cells": Plan(Wish(filled=True)),
    "ink": Plan(Wish(ink=True)),
    "crushed": Plan(Wish(crushed=True)),
    "small_cells": Plan(Wish(pitch=(8, 14)), lens=Lens(blur=(0.3, 1.0))),
    "light_poor": Plan(lens=Lens((0.15, 0.4), (0.3, 1.4), (0.01, 0.04))),
    "light_over": Plan(lens=Lens((1.3, 2.2))),
    "blurred_noisy": Plan(lens=Lens((0.6, 1.2), (0.9, 2.4), (0.02, 0.06))),
}

PLANS: dict[str, Plan] = {**_OVER, **_OPEN}
