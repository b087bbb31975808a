"""What each kind of picture with nothing over the block asks for."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.third_hand.things import THINGS


@dataclass(frozen=True)
class Plan:
    """What a kind asks of its pictures: ranges that numbers are drawn from, and names that are chosen of.

    What is None, and marks and things beside where there are none, is left to chance.
    """

    holes: tuple[int, int] = (0, 2)
    forms: tuple[str, ...] = ("round", "round", "slot", "rect", "narrow")
    hole_light: tuple[float, float] = (0.35, 1.0)
    depth: tuple[float, float] = (12.0, 75.0)  # of the block, thousandths of the picture's width
    tone: tuple[float, float] | None = None  # of the table, to 255
    cuts: tuple[int, int] = (0, 2)
    cut_forms: tuple[str, ...] = ("vee", "step", "arc", "slot")
    light: str | None = None  # hard, two or soft
    marks: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    count: tuple[int, int] = (1, 3)  # of things beside, the last not reached
    on_block: str | None = None  # ink or crush
    stuff: str | None = None  # bright, dark or aramid
    wander: tuple[float, float] = (0.0, 0.05)
    stretch: tuple[float, float] = (0.97, 1.07)
    glare: bool = False
    parallax: tuple[float, float] = (0.0, 0.22)


OPEN_KINDS: dict[str, Plan] = {
    "plain": Plan(),
    "dark_deep_holes": Plan(holes=(2, 6), hole_light=(0.08, 0.35), depth=(50, 110)),
    "lit_holes": Plan(holes=(2, 6), hole_light=(1.0, 1.0), depth=(10, 40), tone=(110, 210)),
    "narrow_slots": Plan(holes=(2, 6), forms=("narrow",)),
    "open_slots": Plan(cuts=(1, 5), cut_forms=("slot",)),
    "notches": Plan(cuts=(2, 6), cut_forms=("vee", "step", "arc")),
    "hard_shadow_beside": Plan(light="hard", depth=(40, 110), tone=(110, 220)),
    "hard_shadow_holes": Plan(light="hard", depth=(30, 90), holes=(2, 5), tone=(110, 210)),
    "hard_shadow_notches": Plan(light="hard", depth=(30, 90), cuts=(2, 5), tone=(100, 210)),
    "two_lamp_shadows": Plan(light="two", depth=(30, 90), tone=(110, 220), holes=(0, 3), cuts=(0, 3)),
    "table_like_walls": Plan(tone=(150, 235)),
    "stains_to_edge": Plan(marks=("stain", "oil"), tone=(90, 220)),
    "lines_to_edge": Plan(marks=("chalk", "cut", "chalk", "cut"), tone=(50, 220)),
    "swarf_dust": Plan(marks=("swarf", "dust", "swarf")),
    "things_beside": Plan(beside=tuple(THINGS), count=(2, 5)),
    "sheets_beside": Plan(beside=("paper", "label", "foil", "film", "tape", "masking_tape"), count=(2, 5)),
    "cables_beside": Plan(beside=("cable", "hose", "wire", "strap", "zip_tie"), count=(2, 4)),
    "blocks_beside": Plan(beside=("stop_block", "weight", "clamp", "batten", "foam"), count=(2, 4), light="hard"),
    "ink_on_block": Plan(on_block="ink"),
    "crushed_cells": Plan(on_block="crush"),
    "aramid": Plan(stuff="aramid"),
    "dark_walls": Plan(stuff="dark", tone=(70, 210)),
    "irregular_cells": Plan(wander=(0.08, 0.2)),
    "stretched_cells": Plan(stretch=(1.12, 1.35)),
    "glare": Plan(glare=True),
    "flanks_seen": Plan(parallax=(0.2, 0.42), depth=(30, 80), holes=(1, 4), cuts=(0, 3)),
}
