"""Pictures of blocks that are cut, each of a kind that is hard in its way, with what is true of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.other_hand.camera import light_up, photograph
from benchmarks.other_hand.canvas import Canvas
from benchmarks.other_hand.core import Core, core, walls
from benchmarks.other_hand.layout import Layout, layout
from benchmarks.other_hand.marks import fill_cells, glue, lay_sheet, lay_swarf, mirror, strew_dust, write
from benchmarks.other_hand.relief import paint_flanks, paint_shade, paint_tops, view
from benchmarks.other_hand.tables import table
from benchmarks.other_hand.things import cable, clamp, hand, tape
from contour.geometry.arrays import Bools, Bytes, Float64s

KINDS: tuple[str, ...] = (
    "undisturbed", "tape", "clamp", "hand", "cable", "compound", "writing", "mirror", "splice", "swarf", "dust",
    "hot_pixels", "jpeg", "gamma", "row_noise", "motion", "defocus", "blown_out", "dim", "coloured", "glare", "shadow",
    "crushed", "wood", "brushed", "slots", "old_cuts", "light_table", "sheet", "pair", "offcut",
)  # fmt: skip
_OVER_ALL = {"tape": tape, "clamp": clamp, "cable": cable, "hand": hand, "writing": write, "dust": strew_dust}


@dataclass(frozen=True, eq=False)
class Scene:
    """A picture, (H, W) grey or (H, W, 3) BGR, 1000 to 2000 pixels wide, and what is true of it.

    `rings` are exteriors and holes of the block, or both of a pair, each (N, 2) in pixels, no offcut's; `pitch_px`
    is its cells'. The rest is (H, W): where a thing lies over the block and beside it (`hidden`), where walls' tops are
    seen, an offcut's too (`walls`), and what lies within each block and offcut, holes not (`pieces`).
    """

    picture: Bytes
    rings: tuple[Float64s, ...]
    pitch_px: float
    hidden: Bools
    walls: Bools
    pieces: tuple[Bools, ...]

    @property
    def comb(self) -> Bools:
        """What lies within any block or offcut, (H, W)."""
        return np.asarray(np.logical_or.reduce(self.pieces))


def scene(kind: str, seed: int, on: str | None = None) -> Scene:
    """A scene of one of `KINDS`, on the table of another one if it is named (`on`), the same for the same seed;
    ValueError for a kind that is none.
    """
    if on is not None and on not in KINDS:
        raise ValueError(f"{on!r} is no kind: expected one of {', '.join(KINDS)}")
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    where = layout(rng, kind)
    of = core(rng, where.pitch)
    light, colour = table(rng, on or kind, where.shape, of.light)
    canvas = Canvas(rng, light, colour, coloured=kind == "coloured" or rng.random() < 0.18)
    over = int(kind == "sheet" and rng.random() < 0.4)
    for _ in range(rng.integers(1, 3) - over if kind == "sheet" else 0):
        lay_sheet(canvas, where, over=False)
    _paint_block(canvas, where, of, kind)
    for _ in range(over):
        lay_sheet(canvas, where, over=True)
    if kind in _OVER_ALL:
        _OVER_ALL[kind](canvas, where)
    light_up(canvas, where, kind)
    picture = photograph(rng, canvas.picture.squeeze(), kind, where.pitch, of.light)
    seen = (canvas.tops > 0.38 * min(1.0, of.wall)) & ~canvas.hidden
    pieces = tuple(piece > 0 for piece in where.pieces)
    return Scene(picture, where.rings, where.pitch, canvas.hidden, seen, pieces)


def _paint_block(canvas: Canvas, where: Layout, of: Core, kind: str) -> None:
    """The block, and what is on it or beside it."""
    rng = canvas.rng
    drawn, seen = walls(rng, where, of), view(rng, where, of, kind)
    turned_over = kind == "mirror" and rng.random() < 0.67
    deepest = rng.uniform(1.5, 2.0) if kind == "mirror" and (not turned_over or rng.random() < 0.5) else 1.0
    if kind == "swarf":
        lay_swarf(canvas, where)
    paint_shade(canvas, where, of, seen, kind)
    paint_flanks(canvas, where, of, drawn, seen, deepest)
    paint_tops(canvas, where, of, drawn)
    if kind == "compound":
        fill_cells(canvas, where, of, drawn.cells)
    if where.seam is not None:
        glue(canvas, where, of, where.seam)
    if turned_over:
        mirror(canvas, where)
