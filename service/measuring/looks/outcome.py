"""What looks at a picture find, and which of it counts."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, TypeGuard

import numpy as np
from numpy.typing import NDArray

from contour.errors import EdgeContradicted, NoBlockFound, NoCellsFound
from contour.geometry.agreement import agreement
from contour.tracing.edge_kind import FINE_PITCH_PX
from contour.tracing.trace import OnStage
from contour.walls.cell_scale import probe
from contour.walls.lightness import wall_light
from service.measuring.looks.look import LIES_THERE, Look
from service.measuring.measurement import Measurement
from service.reasons import Reason

if TYPE_CHECKING:
    from service.config.recipes import AnyRecipe

Outcome = Measurement | NoBlockFound | EdgeContradicted

# Fine cells are looked at enlarged in pictures of so many pixels at most, and outlines seen so may lie so many pitches
# apart.
_MOST_PX, _APART = 4_000_000, 0.35
# What may speak against an outline that was seen well: no other look changes it.
_OF_ITS_SIZE_AND_PLACE = {Reason.AREA_OUT_OF_LIMITS, Reason.OUTSIDE_WORK_AREA, Reason.TOO_MANY_POINTS}


def tried(outlined: Callable[[Look], Measurement], look: Look) -> Outcome:
    """What a look finds, or why it finds nothing."""
    try:
        return outlined(look)
    except (NoBlockFound, EdgeContradicted) as error:
        return error


def best(first: Outcome, looks: Iterator[Look], outlined: Callable[[Look], Measurement], on_stage: OnStage) -> Outcome:
    """What a first look found, or the first of others that nothing speaks against, if something does against that."""
    if isinstance(first, EdgeContradicted) or accepted(first) or _does_not_fit(first):
        return first
    reasons = {*first.reasons} if isinstance(first, Measurement) else set[Reason]()
    covered = False
    for look in looks:
        on_stage("table")
        # What lies over an edge that a network drew would be drawn away by all looks but one that knows more things.
        if covered and look.by != "networks":
            continue
        if not look.may_show_more(reasons, nowhere=isinstance(first, NoCellsFound)):
            continue
        again = tried(outlined, look)
        if accepted(again):
            return again
        if look.network and _closes_cells(again):
            break
        covered = covered or (look.network and isinstance(again, Measurement) and Reason.EDGE_COVERED in again.reasons)
        if isinstance(again, Measurement):
            reasons |= {Reason.SEVERAL_BLOCKS} & {*again.reasons}
    on_stage("table")
    return first


def _closes_cells(found: Outcome) -> bool:
    """Whether walls that a network drew close border cells: it knows cut blocks alone, and other looks may take the
    teeth of such a border for ends of walls.
    """
    return found.edge in ("cells", "mixed") if isinstance(found, Measurement) else isinstance(found, EdgeContradicted)


def accepted(found: Outcome) -> TypeGuard[Measurement]:
    """Whether a look found an outline that nothing speaks against."""
    return isinstance(found, Measurement) and not found.findings


def _does_not_fit(found: Measurement | NoBlockFound) -> bool:
    """Whether its size and place, and nothing else, speak against an outline."""
    return isinstance(found, Measurement) and bool(found.reasons) and {*found.reasons} <= _OF_ITS_SIZE_AND_PLACE


def fine(picture: NDArray[np.uint8], found: Outcome, recipe: AnyRecipe) -> bool:
    """Whether cells are fine, in a picture that is not too large to be looked at enlarged, and in which nothing was
    seen to lie there that might not be at another size.
    """
    if picture.shape[0] * picture.shape[1] > _MOST_PX or isinstance(found, NoCellsFound):
        return False
    if isinstance(found, Measurement) and found.pitch_px is not None:
        return found.pitch_px < FINE_PITCH_PX and not _does_not_fit(found) and not {*found.reasons} & LIES_THERE
    with contextlib.suppress(NoBlockFound):
        return probe(wall_light(picture), recipe.polarity).pitch_px < FINE_PITCH_PX
    return False


def agreed(plain: Outcome, finer: Outcome) -> Outcome:
    """What was found in a picture, and in the same enlarged: the one that is accepted. Where both are, one must run
    where the other does; where neither is, what was traced says more than what kind of border it seems to have.
    """
    if not accepted(plain):
        said = isinstance(plain, EdgeContradicted) and isinstance(finer, Measurement)
        return finer if said or accepted(finer) else plain
    if not accepted(finer):
        return plain
    assert plain.pixels is not None
    assert finer.pixels is not None
    assert finer.pitch_px is not None
    apart = agreement(finer.pixels, plain.pixels).hausdorff_px / finer.pitch_px
    if apart > _APART:
        return EdgeContradicted(
            f"looked at twice as large, the border runs elsewhere, by {apart:.1f} cells: cells of "
            f"{finer.pitch_px:.0f} px are too small to tell a cut border from a closed one here. Give edge: cut or "
            "edge: cells, or more pixels a cell",
            "cut",
        )
    return finer
