"""Whether what was taken for a comb can be one: boards, prints and codes have patches side by side, too."""

from __future__ import annotations

from dataclasses import dataclass

# Walls of fine cells look wide; from this pitch on they look as wide as they are.
_FINE_PITCH_PX = 15.0
# Blur makes walls look wider by about this.
_BLUR_PX = 1.5
# Of 183 scenes with cells of more than 15 px only foam has walls wider than 0.28 of their pitch; of prints and boards
# the narrowest are 0.34.
_WIDEST_WALL = 0.31
_REGULAR = 0.5
_FEW_CELLS = 18
_POOR_SCORE = 0.23


@dataclass(frozen=True)
class Comb:
    """Cells as they were seen: pitch and wall width in pixels, whether walls are bright, the cells counted in the part
    that was looked at, how good a comb they make (0 to 1), and the share that is regular and fills its place (0 to 1).
    """

    pitch_px: float
    wall_px: float
    bright: bool
    count: int
    score: float
    regular: float


def unlike_comb(comb: Comb) -> str | None:
    """Why this is no cut honeycomb, as a sentence with what was measured and what to do; None where it may be one."""
    share = (comb.wall_px - _BLUR_PX) / comb.pitch_px
    # Foam has wide bright walls, and cells of all sizes between them.
    solid = not comb.bright or comb.regular > _REGULAR
    if comb.pitch_px > _FINE_PITCH_PX and share > _WIDEST_WALL and solid:
        return (
            f"what lies between patches {comb.pitch_px:.0f} px apart is {100 * share:.0f} % as wide as that, cell "
            f"walls are {100 * _WIDEST_WALL:g} % at most: a board, a print, or a perforated plate. Check that a block "
            "lies in view, and set edge: cells for a perforated plate"
        )
    if comb.count < _FEW_CELLS and comb.score < _POOR_SCORE:
        return (
            f"{comb.count} patches that make {100 * comb.score:.0f} % of a comb are no block, at least {_FEW_CELLS} "
            f"patches or {100 * _POOR_SCORE:g} % are expected. Check that a block lies in view, "
            "and remove prints and codes"
        )
    return None
