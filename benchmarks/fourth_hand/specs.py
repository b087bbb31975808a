"""What each kind of picture with nothing over the block asks for."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.fourth_hand.tables import TABLES


@dataclass(frozen=True)
class Spec:
    """What a kind asks of its pictures; what is None, and marks and things beside where there are none, is left to
    chance.
    """

    holes: tuple[int, int] = (0, 3)
    cuts: str | None = None  # slot, notch or ragged
    table: tuple[str, ...] = TABLES
    marks: tuple[str, ...] = ()  # what is drawn or spilt on the table
    shadow: str | None = None  # hard, soft or foreign
    floor: str | None = None  # dark or lit: the table against the walls
    beside: tuple[str, ...] = ()
    comb: str | None = None  # ink, crushed, glare or dust on the block itself
    flank: float = 1.0


INNOCENT: dict[str, Spec] = {
    "bare": Spec(),
    "holes_dark": Spec((1, 3), floor="dark"),
    "holes_lit": Spec((1, 3), floor="lit"),
    "holes_many": Spec((4, 9)),
    "slots_narrow": Spec((0, 1), "slot"),
    "notches": Spec((0, 1), "notch"),
    "edge_ragged": Spec((0, 2), "ragged"),
    "shadow_hard": Spec((1, 3), "slot", shadow="hard"),
    "shadow_soft": Spec((0, 3), shadow="soft"),
    "shadow_foreign": Spec(shadow="foreign"),
    "stains": Spec(marks=("stain", "oil")),
    "table_lines": Spec(marks=("chalk", "cuts")),
    "swarf": Spec(marks=("swarf",)),
    "mat_grid": Spec((1, 3), table=("mat",)),
    "pierced_table": Spec(table=("tslot", "perforated")),
    "tools_beside": Spec(beside=("over_spanner", "over_knife", "over_pen", "over_ruler")),
    "cloth_beside": Spec(beside=("over_cloth", "over_rag_printed", "over_glove")),
    "cord_beside": Spec(beside=("over_cord_thin", "over_cord_thick", "over_cord_string", "over_hose", "over_zip_tie")),
    "sheet_beside": Spec(
        beside=("over_paper", "over_film_clear", "over_tape_printed", "over_foil", "over_tape_masking")
    ),
    "offcuts_beside": Spec(beside=("over_batten", "over_plate", "over_foam", "over_board", "over_weight")),
    "ink_on_comb": Spec(comb="ink"),
    "crushed_cells": Spec(comb="crushed"),
    "glare": Spec(comb="glare"),
    "dust_on_comb": Spec(comb="dust"),
    "flank_wide": Spec((0, 3), flank=2.4),
}
