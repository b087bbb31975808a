"""The page of docs/reports/acceptance.md."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.acceptance.trials import (
    BLOCK_GOOD,
    BLOCK_HEIGHT,
    CAMERA,
    GOOD,
    HEIGHT,
    SQUARE,
    TABLE,
    UNMARKED,
    Outcome,
)

WANTED = 0.95
FAULTS = {
    SQUARE: "the calibration board's squares told wrong by 0.1 to 1 %",
    TABLE: "after calibrating, 1 mm off at the field's border against its middle, about any axis or as a bowl",
    CAMERA: "knocked by 0.3° about any axis, or pushed by 2 px; four fixed marks beside the table",
    HEIGHT: "the plate 1 to 5 mm higher or lower than told",
}
BLOCK_HEIGHT_TOLD = "the block 4 to 8 mm lower than told"

INTRODUCTION = """\
Cells are rendered: a camera of 1280 × 960 px at random, 0.9 to 1.5 m over a table 450 to 640 mm wide, tilted by up to
3°, with a lens and blocks of 6 to 60 mm thickness at random. Each is calibrated from 10 rendered views of a board.
Then it is tested as `combtrace accept` does: with a plate of two fifths of the field's width, as high as the blocks,
in six places, its lengths told as wrong as their stated uncertainty of 0.02 mm (k = 2) allows, its height by 0.05 mm,
its temperature unmeasured and up to 5 K off; or, in every fifth cell, with a rectangular honeycomb block in nine
places, traced. Limits are those that hold unless others are stated: 0.1 mm for the plate, 0.5 mm for the block.

Not rendered: a plate that is bent itself, a lens beyond the calibration's models, a camera that warms up."""


def page(outcomes: Sequence[Outcome], command: str) -> str:
    """The whole page."""
    by_arm = {
        arm: [one for one in outcomes if one.arm == arm] for arm in (GOOD, *FAULTS, UNMARKED, BLOCK_GOOD, BLOCK_HEIGHT)
    }
    good = by_arm[GOOD]
    passed = [one for one in good if one.decision == "passes"]
    held = [one for one in passed if one.true_mm <= one.limit_mm]
    rows = [
        f"| good cells pass | {len(passed)} of {len(good)} | {_met(len(passed), len(good))} |",
        f"| of those, no length anywhere in the field is off by more than the limit | {len(held)} of {len(passed)} | "
        f"{_met(len(held), len(passed))} |",
    ]
    for arm, what in FAULTS.items():
        found = _found(by_arm[arm])
        rows.append(f"| {arm}: {what} | {found} of {len(by_arm[arm])} found | {_met(found, len(by_arm[arm]))} |")
    return f"""# Acceptance tests: do certificates hold, are faults found?

This page is written by
`{command}`;
do not edit it by hand.

{INTRODUCTION}

## Goals, at least 95 of 100 each

| | measured | met |
|---|--:|---|
{chr(10).join(rows)}

*Found* means that the test does not pass; what is undecided does not.

## What was measured

Medians over cells, in brackets the largest (for faults the smallest). *Plane*: how far a corner of the plate was from
its mean height, of what is allowed.

| cell | tested | passes | undecided | fails | none | largest error, mm | form, mm | plane | test's own U, mm |
|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|
{chr(10).join(_row(arm, some) for arm, some in by_arm.items() if some)}

The true largest error of a good cell's lengths, over pairs of places anywhere in the picture: median
{_median([one.true_mm for one in good]):.3f} mm, worst {max(one.true_mm for one in good):.3f} mm. It is inf where a
calibration refuses a place at the picture's edge that its views did not reach.

## What it does not find

- A camera that was pushed along the table changes no length. Only fixed marks show it: without them
  {_found(by_arm[UNMARKED])} of {len(by_arm[UNMARKED])} moved cameras are found, of those that were turned. A
  certificate of a calibration without marks says so.
- The block is for the traced outline and its claim, not for the geometry: at 0.5 mm {_passed(by_arm[BLOCK_GOOD])} of
  {len(by_arm[BLOCK_GOOD])} good cells pass, and {_found(by_arm[BLOCK_HEIGHT])} of {len(by_arm[BLOCK_HEIGHT])} wrong
  heights are found, {BLOCK_HEIGHT_TOLD}.
"""


def _row(arm: str, some: Sequence[Outcome]) -> str:
    counts = [sum(one.decision == name for one in some) for name in ("passes", "undecided", "fails", "none")]
    edge = np.nanmax if arm in (GOOD, BLOCK_GOOD) else np.nanmin
    figures = []
    for name, digits in (("largest_mm", 3), ("form_mm", 3), ("plane_share", 2), ("uncertainty_mm", 3)):
        values = np.array([getattr(one, name) for one in some])
        known = values[np.isfinite(values)]
        figures.append(f"{np.median(known):.{digits}f} ({edge(known):.{digits}f})" if len(known) else "–")
    return f"| {arm} | {len(some)} | {' | '.join(str(count) for count in counts)} | {' | '.join(figures)} |"


def _found(some: Sequence[Outcome]) -> int:
    return sum(one.decision != "passes" for one in some)


def _passed(some: Sequence[Outcome]) -> int:
    return sum(one.decision == "passes" for one in some)


def _met(count: int, total: int) -> str:
    return "yes" if total and count >= WANTED * total else "no"


def _median(values: Sequence[float]) -> float:
    return float(np.median(values))
