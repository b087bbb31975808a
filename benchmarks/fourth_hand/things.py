"""All things that lie over a block or beside it, by name, and where they are laid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import cv2
import numpy as np

from benchmarks.fourth_hand.bodies import Body
from benchmarks.fourth_hand.cords import cord, strap, zip_tie
from benchmarks.fourth_hand.drawings import Place
from benchmarks.fourth_hand.hard_things import board, clamp, lump, stick
from benchmarks.fourth_hand.soft_things import cloth, glove, sheet, tape
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float32s, Float64s

Builder = Callable[[Place], list[Body]]
Styled = Callable[[Place, str], list[Body]]


def edge_place(rng: Rng, rings: list[Float64s], shape: Shape, pitch: float, *, apart: bool = False) -> Place:
    """A place of the edge, at a corner or, of a thing that does not lie apart, at a hole too; rings and pitch in
    pixels.
    """
    pick = int(rng.integers(1, len(rings))) if len(rings) > 1 and rng.random() < 0.3 and not apart else 0
    ring = rings[pick]
    steps = np.linalg.norm(np.roll(ring, -1, 0) - ring, axis=1)
    k = int(rng.choice(len(ring), p=steps / steps.sum()))
    a, b = ring[k], ring[(k + 1) % len(ring)]
    at = a + (b - a) * (rng.random() if rng.random() < 0.7 else 0.0)
    area = cv2.contourArea(ring.astype(np.float32), True)
    inward = np.array([a[1] - b[1], b[0] - a[0]]) * (1 if area > 0 else -1)
    inward = inward / (np.linalg.norm(inward) + 1e-9) * (1 if pick == 0 else -1)
    unit = float(np.sqrt(abs(cv2.contourArea(rings[0].astype(np.float32)))))
    return Place(rng, shape, at, inward, unit, pitch, apart)


def across(make: Builder, rng: Rng, rings: list[Float64s], pitch: float, comb: Float32s) -> list[Body]:
    """A thing over an edge of the block, tried anew until it hides enough of both the block and what lies beside it.
    comb: how much of each pixel is block, (H, W) float32.
    """
    for _ in range(6):
        bodies = make(edge_place(rng, rings, (comb.shape[0], comb.shape[1]), pitch))
        over = sum(float((b.alpha * comb).sum()) for b in bodies)
        off = sum(float((b.alpha * (1 - comb)).sum()) for b in bodies)
        if over > 0.002 * comb.sum() and off > 40:
            break
    return bodies


def beside(rng: Rng, name: str, rings: list[Float64s], pitch: float, far: Float32s) -> list[Body]:
    """A thing on the table apart from the block, none if there was no room in some trials. far: how far each pixel lies
    from the block, (H, W) float32, pixels.
    """
    for trial in range(4):
        near = edge_place(rng, rings, (far.shape[0], far.shape[1]), pitch, apart=True)
        out = near.at - near.inward * near.unit * rng.uniform(0.03, 0.1 + 0.08 * trial)
        bodies = OVER[name](replace(near, at=out, unit=near.unit * (0.85 - 0.15 * trial)))
        if all(float((b.alpha * (far < 5)).max()) < 0.02 for b in bodies):
            return bodies
    return []


def _any_of(p: Place, make: Styled, styles: tuple[str, ...]) -> list[Body]:
    """A thing of one of several styles."""
    return make(p, str(p.rng.choice(styles)))


_STYLES: dict[str, tuple[Styled, tuple[str, ...]]] = {
    **{f"over_tape_{s}": (tape, (s,)) for s in ("opaque", "clear", "printed", "masking", "foil")},
    **{f"over_cord_{s}": (cord, (s,)) for s in ("thin", "string", "wires")},
    "over_cord_thick": (cord, ("thick", "thick", "twisted", "spiral")),
    "over_hose": (cord, ("ribbed",)),
    "over_cloth": (cloth, ("plain",)),
    "over_rag_printed": (cloth, ("printed",)),
    **{f"over_{s}": (sheet, (s,)) for s in ("paper", "label", "foil")},
    "over_film_clear": (sheet, ("film",)),
    **{f"over_film_{s}": (sheet, (s,)) for s in ("tinted", "bubble")},
    "over_plate": (board, ("plate", "rubber")),
    "over_board": (board, ("wood",)),
    "over_batten": (board, ("batten",)),
    "over_foam": (board, ("foam",)),
    "over_stop_block": (board, ("stop",)),
    **{f"over_{s}": (stick, (s,)) for s in ("ruler", "spanner", "knife")},
    "over_pen": (stick, ("pen", "driver")),
    "over_weight": (lump, ("weight", "magnet")),
    "over_cup": (lump, ("cup",)),
    **{f"over_{s}_clamp": (clamp, (s,)) for s in ("strap", "toggle")},
}
OVER: dict[str, Builder] = {
    **{name: partial(_any_of, make=make, styles=styles) for name, (make, styles) in _STYLES.items()},
    "over_zip_tie": zip_tie,
    "over_strap": strap,
    "over_glove": partial(glove, arm_length=2.5),
    "over_sleeve": partial(glove, arm_length=14.0),
}
