"""What each kind of picture asks for: a thing over the block, and what it does to block, table and light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from benchmarks.fifth_hand import hard_things, long_things, soft_things, tools
from benchmarks.fifth_hand.outlines import Wish
from benchmarks.fifth_hand.parts import Part
from benchmarks.other_hand.fields import Rng

Builder = Callable[[Rng, float], list[Part]]  # of a size, pixels
LitBuilder = Callable[[Rng, float, float], list[Part]]  # of a size and a light


@dataclass(frozen=True)
class Plan:
    """What a kind asks of its pictures: ranges that numbers are drawn from, chances and counts.

    Marks and things beside where there are none, and what is None of the table, are left to chance.
    """

    over: Builder | None = None
    like_table: LitBuilder | None = None  # a thing over the block that is as light as the table
    plug: Builder | None = None  # a thing in a hole, of the hole's radius
    wish: Wish = field(default_factory=Wish)
    table_light: tuple[float, float] | None = None
    markings: tuple[str, ...] = ()
    pitch: tuple[float, float] = (9.0, 45.0)
    doubled: tuple[float, float] = (1.0, 1.6)
    jitter: tuple[float, float] = (0.0, 0.06)
    stretch: tuple[float, float] = (0.92, 1.1)
    depth: tuple[float, float] = (0.01, 0.06)
    dark_walls: float = 0.15
    aramid: float = 0.2
    crushed: int = 0
    filled: float = 0.0  # the share of cells
    ink: bool = False
    swarf: bool = False
    chalk: int = 0
    near_things: int = 0
    sun_soft: tuple[float, float] = (0.02, 0.4)
    sun_strength: tuple[float, float] = (0.2, 0.75)
    sun_reach: tuple[float, float] = (0.2, 1.2)
    glare: float = 0.0
    noise: tuple[float, float] = (0.005, 0.035)
    eye_far: bool = False  # the camera stands aside, so that flanks are seen


_HOLED = Wish(holes=(1, 5))
_OVER: dict[str, Builder] = {
    "sleeve": long_things.sleeve,
    "label": soft_things.label,
    "clear_tape": soft_things.clear_tape,
    "masking_tape": soft_things.masking_tape,
    "foam": hard_things.foam_piece,
    "rag": soft_things.rag,
    "pen": tools.pen,
    "weight": hard_things.weight,
    "hose": long_things.hose,
    "vacuum_cup": long_things.vacuum_cup,
    "brush": tools.brush,
    "glove": soft_things.glove,
    "gauge": tools.gauge,
    "wood_offcut": hard_things.wood_offcut,
    "metal_offcut": soft_things.metal_offcut,
    "spring_clamp": hard_things.spring_clamp,
    "cable_loop": long_things.cable_loop,
    "film_sheet": soft_things.film_sheet,
    "magnet": hard_things.magnet,
    "string": long_things.string,
    "sticker": soft_things.sticker,
    "toggle_clamp": hard_things.toggle_clamp,
    "ruler": tools.ruler,
    "spanner": tools.spanner,
    "knife": tools.knife,
    "strap": soft_things.strap,
    "foil": soft_things.foil,
    "stop_block": hard_things.stop_block,
}
BUILDERS: tuple[Builder, ...] = (
    *_OVER.values(),
    long_things.zip_tie,
    soft_things.tag,
    soft_things.paper,
    soft_things.light_box,
)

PLANS: dict[str, Plan] = {
    **{f"over_{name}": Plan(builder) for name, builder in _OVER.items()},
    "over_dark_cloth_on_dark": Plan(like_table=soft_things.rag, table_light=(0.01, 0.14)),
    "over_light_box_as_table": Plan(like_table=soft_things.light_box, table_light=(0.3, 1.0)),
    "over_white_paper_on_white": Plan(like_table=soft_things.paper, table_light=(0.75, 1.0)),
    "over_hole_plug": Plan(plug=hard_things.hole_plug, wish=Wish((1, 4), ("round",), (0.08, 0.22))),
    "holes_deep": Plan(wish=Wish((2, 6)), table_light=(0.01, 0.08), depth=(0.05, 0.12), sun_strength=(0.6, 0.95)),
    "holes_lit": Plan(wish=Wish((2, 5), hole_size=(0.15, 0.4)), table_light=(0.5, 1.0), sun_strength=(0.05, 0.3)),
    "slots_narrow": Plan(wish=Wish((0, 4), ("gap",), form="slotted"), pitch=(9.0, 24.0)),
    "gaps_inside": Plan(wish=Wish((2, 7), ("gap",), (0.12, 0.3)), pitch=(9.0, 24.0)),
    "notches_toothed": Plan(wish=Wish((0, 2), form="toothed"), pitch=(9.0, 18.0)),
    "shadow_hard": Plan(
        wish=_HOLED, sun_soft=(0.0, 0.015), sun_strength=(0.6, 0.95), sun_reach=(0.8, 2.2), table_light=(0.3, 1.0)
    ),
    "shadow_soft": Plan(
        wish=_HOLED, sun_soft=(0.3, 0.7), sun_strength=(0.5, 0.9), sun_reach=(0.8, 1.8), table_light=(0.3, 1.0)
    ),
    "table_perforated": Plan(markings=("perforated",)),
    "table_bright": Plan(table_light=(0.8, 1.0), wish=_HOLED),
    "table_grid": Plan(markings=("grid",), wish=_HOLED),
    "table_slots": Plan(markings=("slots", "plate")),
    "table_old_cuts": Plan(markings=("cuts",)),
    "oil_stains": Plan(markings=("oil",), table_light=(0.15, 0.9)),
    "dust": Plan(markings=("dust",)),
    "swarf": Plan(swarf=True, markings=("dust",)),
    "chalk_lines": Plan(chalk=9, wish=_HOLED),
    "ink_on_block": Plan(ink=True),
    "cells_filled": Plan(filled=0.06),
    "rows_crushed": Plan(crushed=3),
    "walls_doubled": Plan(doubled=(1.8, 2.8), pitch=(14.0, 45.0)),
    "cells_tiny_noisy": Plan(pitch=(9.0, 12.0), noise=(0.04, 0.11)),
    "cells_irregular": Plan(jitter=(0.08, 0.14)),
    "cells_stretched": Plan(stretch=(0.72, 1.4)),
    "walls_dark": Plan(dark_walls=1.0, table_light=(0.3, 1.0)),
    "aramid_brown": Plan(aramid=1.0),
    "flanks_seen": Plan(depth=(0.06, 0.12), eye_far=True, wish=_HOLED),
    "glare": Plan(glare=1.6),
    "things_near": Plan(near_things=5),
}
