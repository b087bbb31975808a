"""Where the time of one picture goes: `python -m benchmarks.profile [--rounds N] [--write]`.

One block at 2, 12 and 48 MP, from the picture to the accepted polygon. Times are the processor's, of all threads, as
other load on the machine falls on the clock: medians of plain runs, each step's without those within it, and of their
ratios to cv2.medianBlur(frame, 5) of the same picture, turn by turn. What is written comes from one more run in which
arrays tell of themselves: every array that OpenCV or numpy makes counts as a call, and with its bytes; a pass is as
many bytes as the picture has. Values read, and what OpenCV holds inside of a call, are not seen. `--write` puts the
tables into docs/reports/engine-speed.md.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from types import BuiltinFunctionType
from typing import Any
from unittest import mock

import cv2
import numpy as np

from benchmarks.page_section import put_section, table
from contour.synthetic import Rendered, camera_above, render
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from tests.support.scenes.bench_scenes import LENS, measured_scenes
from tests.support.scenes.trials import calibration_for

PAGE = Path(__file__).parents[1] / "docs" / "reports" / "engine-speed.md"
SIZES = {2: (1600, 1200), 12: (4000, 3000), 48: (8000, 6000)}
WIDTH_MM, MIDDLE = 600.0, (300.0, 225.0)
REST = "all else"
STEPS = {
    "line noise": ("contour.tracing.tracing:without_line_noise", "service.measuring.measure:without_line_noise"),
    "cell scale": ("contour.tracing.solid:probe",),
    "wall mask": ("contour.walls.see_block:wall_mask", "contour.walls.see_block:without_specks"),
    "faint links, loose pieces": (
        "contour.walls.see_block:with_faint_links",
        "contour.walls.see_block:without_loose_pieces",
        "contour.walls.see_block:pieces_beside",
    ),
    "coarse block": ("contour.walls.see_block:coarse_block",),
    "witnesses": ("contour.walls.see_block:block_evidence",),
    "what lies on the table": ("contour.tracing.wall_tips:table_look",),
    "fit": ("contour.tracing.wall_tips:visible_rings",),
    "lines, seams": ("contour.tracing.wall_tips:wide_line", "contour.tracing.wall_tips:parted_by_seam"),
    "quality": ("contour.acceptance.trace_check:block_quality",),
    "disagreement": ("contour.acceptance.trace_check:disagreement",),
    "edge checks": (
        "contour.acceptance.trace_check:narrow_feature",
        "contour.acceptance.trace_check:alike_edge",
        "contour.acceptance.trace_check:comb_at_edge",
        "contour.acceptance.trace_check:border_beyond",
    ),
    "polygon, verdict": ("service.measuring.measure:cutting_polygon", "service.measuring.measure:judge"),
}

BESIDE = ("contour.acceptance.trace_check", "contour.material.closed_cells", "contour.walls.cell_scale")


@dataclass
class Step:
    """What a step takes: seconds without the steps within it; the number of its arrays, their bytes, the largest."""

    seconds: float = 0.0
    calls: int = 0
    total: int = 0
    largest: int = 0


@dataclass
class Steps:
    """What each step took since this began; the innermost under way stands last in `entered`."""

    took: dict[str, Step] = field(default_factory=lambda: {name: Step() for name in (*STEPS, REST)})
    entered: list[str] = field(default_factory=lambda: [REST])
    since: float = field(default_factory=time.process_time)

    def turn(self) -> None:
        """The time until now is that of the innermost step."""
        now = time.process_time()
        self.took[self.entered[-1]].seconds += now - self.since
        self.since = now

    def made(self, size: int) -> None:
        """The innermost step has made an array of so many bytes."""
        step = self.took[self.entered[-1]]
        step.calls, step.total, step.largest = step.calls + 1, step.total + size, max(step.largest, size)

    def within(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The call, counted as that step."""

        def counted(*values: Any, **named: Any) -> Any:
            self.turn()
            self.entered.append(name)
            try:
                return call(*values, **named)
            finally:
                self.turn()
                self.entered.pop()

        return counted


class Telling(np.ndarray[Any, Any]):
    """An array that tells of every array made from it that has memory of its own."""

    made: Callable[[int], None]

    def __array_finalize__(self, _of: object) -> None:
        if self.flags.owndata:
            Telling.made(self.nbytes)


def telling(call: Callable[..., Any]) -> Callable[..., Any]:
    """An OpenCV function that tells of the arrays it makes, which tell of those made from them."""

    def told(one: Any) -> Any:
        if isinstance(one, tuple):
            return tuple(told(part) for part in one)
        if type(one) is not np.ndarray:
            return one
        Telling.made(one.nbytes)
        return one.view(Telling)

    return lambda *values, **named: told(call(*values, **named))


def run(work: Callable[[Any], object], picture: Any, *, told: bool) -> Steps:
    """What each step of the work on a picture takes; with `told`, what it writes as well, and then no times."""
    with ExitStack() as patches:
        steps = Steps()
        for name, places in STEPS.items():
            for place in places:
                module = importlib.import_module(place.split(":")[0])
                call = getattr(module, place.split(":")[1])
                patches.enter_context(mock.patch.object(module, call.__name__, steps.within(name, call)))
        for place in BESIDE:  # a step at a time, or nobody could tell whose time it is
            module = importlib.import_module(place)
            patches.enter_context(mock.patch.object(module, "side_by_side", lambda one, other: (one(), other())))
        if told:
            Telling.made, picture = steps.made, picture.view(Telling)
            for name in ("asarray", "ascontiguousarray"):  # either would make an array forget what it is
                patches.enter_context(mock.patch.object(np, name, np.asanyarray))
            for name, call in vars(cv2).items():
                if isinstance(call, BuiltinFunctionType):
                    patches.enter_context(mock.patch.object(cv2, name, telling(call)))
        work(picture)
        steps.turn()
        return steps


def rendered(width: int, height: int) -> Rendered:
    """The block of the bench's scene of 12 MP, seen by a camera of that many pixels."""
    scene = next(one.scene for one in measured_scenes() if one.name == "12mp")
    how = {"target_mm": MIDDLE, "tilt_deg": (1.0, -0.6), "distance_mm": 1300.0}
    camera = camera_above(width, height, WIDTH_MM / width, distortion=LENS, **how)
    return render(replace(scene, camera=camera))


def measured(megapixels: int, rounds: int) -> tuple[list[str], str]:
    """The row of the ratios, and the table of the steps, Markdown."""
    scene = rendered(*SIZES[megapixels])
    picture, measurer = scene.picture, Measurer(calibration_for(scene.camera))

    def work(seen: Any) -> None:
        found = measurer.measure(seen, PlainRecipe(), scene.thickness_mm)
        if found.reasons:
            raise RuntimeError(f"{megapixels} MP were refused: {found.reasons}; expected an accepted polygon")

    work(picture)
    filters, plain = [], []
    for _ in range(rounds):
        begun = time.process_time()
        cv2.medianBlur(picture, 5)
        filters.append(time.process_time() - begun)
        plain.append(run(work, picture, told=False))
    whole = [sum(step.seconds for step in steps.took.values()) for steps in plain]
    ratio = median(one / other for one, other in zip(whole, filters, strict=True))
    row = [f"{megapixels} MP", f"{1e3 * median(whole):.1f}", f"{1e3 * median(filters):.2f}", f"{ratio:.1f} ×"]
    told, lines = run(work, picture, told=True).took, []
    idle = [name for name, step in told.items() if not step.calls]
    if idle:
        raise RuntimeError(f"{idle} made no array; expected steps of each trace: name in STEPS where they are called")
    for name, step in told.items():
        passes, largest = (size / picture.nbytes for size in (step.total, step.largest))
        took_ms = 1e3 * median(steps.took[name].seconds for steps in plain)
        lines.append([name, f"{took_ms:.1f}", f"{passes:.1f}", str(step.calls), f"{largest:.2f}"])
    return row, table([f"{megapixels} MP", "ms", "passes", "arrays", "largest, pictures"], lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="benchmarks.profile", description=__doc__)
    parser.add_argument("--rounds", type=int, default=9, metavar="N", help="of each size; default 9")
    parser.add_argument("--write", action="store_true", help=f"put the tables into docs/reports/{PAGE.name}")
    args = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    rows, tables = zip(*(measured(size, args.rounds) for size in SIZES), strict=True)
    said = f"{datetime.now(UTC):%Y-%m-%d}, {args.rounds} rounds, {os.cpu_count()} cores, load {load:.1f} before."
    text = "\n\n".join([table(["", "ms", "medianBlur, ms", "ratio"], rows), said, *tables])
    print(text)
    if args.write:
        put_section("now", text, PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
