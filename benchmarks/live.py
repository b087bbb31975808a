"""Outlines a second, live: `python -m benchmarks.live [--looks N] [--write]`.

The profile's block at 1600 x 1200, sent by a simulated camera at 60 Hz and looked at as `combtrace live` does. By the
clock, and as many as this machine's cores could make of the processor's time that a look takes, as other load falls on
the clock. `--write` puts the row into docs/reports/engine-speed.md.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from benchmarks.page_section import put_section, table
from benchmarks.profile import PAGE, SIZES, rendered
from drivers.camera.simulated import SimulatedCamera
from service.config.plain_recipe import PlainRecipe
from service.jobs.live_view import LiveView, Sight
from service.measuring.measure import Measurer
from tests.support.scenes.trials import calibration_for

CAMERA_HZ = 60.0
FIRST = 12  # the processes start with these


def outlines(sight: Sight, picture: NDArray[np.uint8], looks: int) -> tuple[float, float]:
    """Outlines a second by the clock, and the processor's seconds of all processes; raise RuntimeError at a refusal."""

    def exposed(_sequence: int) -> NDArray[np.uint8]:
        time.sleep(-time.monotonic() % (1.0 / CAMERA_HZ))
        return picture

    camera = SimulatedCamera(exposed)
    camera.open()
    before, begun = _processor_s(), 0.0
    with LiveView(sight) as view:
        for number, look in enumerate(islice(view.looks(camera, 5.0, 1000.0), FIRST + looks), 1):
            if look.measurement.reasons:
                raise RuntimeError(f"a look was refused: {look.measurement.texts}; expected an accepted outline")
            if number == FIRST:
                begun = time.perf_counter()
    took_s = time.perf_counter() - begun
    return looks / took_s, _processor_s() - before


def _processor_s() -> float:
    own, ended = (resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime + ended.ru_utime + ended.ru_stime


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the row."""
    parser = argparse.ArgumentParser(prog="benchmarks.live", description=__doc__)
    parser.add_argument("--looks", type=int, default=100, metavar="N", help="that are counted; default 100")
    parser.add_argument("--write", action="store_true", help=f"put the row into docs/reports/{PAGE.name}")
    args = parser.parse_args(arguments)
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    scene = rendered(*SIZES[2])
    sight = Sight(Measurer(calibration_for(scene.camera)), PlainRecipe(), scene.thickness_mm)
    _, start_s = outlines(sight, scene.picture, 1)
    by_clock, all_s = outlines(sight, scene.picture, 1 + args.looks)
    a_look_s = (all_s - start_s) / args.looks
    head = ["live outline at 1600 x 1200, camera of 60 Hz", "outlines a second", "must", "aim"]
    rows = [
        [f"by the clock, load {load:.1f} before", f"{by_clock:.1f}", "≥ 20", "≥ 40"],
        [f"by the processor: {1e3 * a_look_s:.0f} ms a look on {cores} cores", f"{cores / a_look_s:.1f}", "", ""],
    ]
    text = f"{table(head, rows)}\n\n{datetime.now(UTC):%Y-%m-%d}, {args.looks} looks."
    print(text)
    if args.write:
        put_section("live", text, PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
