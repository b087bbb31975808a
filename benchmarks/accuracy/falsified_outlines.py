"""How many false outlines the second account sees: `python -m benchmarks.accuracy.falsified_outlines` (`--help`).

Outlines of traceable random scenes are falsified in three ways and judged as the service judges them, by the limit of a
recipe that sets none. Prints the shares; with `--write` they take their place in docs/reports/accuracy.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from benchmarks.page_section import put_section, table
from contour.acceptance.acceptance import View, judge
from contour.acceptance.disagreement import disagreement
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import CheckedTrace
from contour.errors import ContourError
from contour.geometry.offset import offset_contour
from contour.geometry.rings import Contour, Ring, densified, oriented_contour, signed_area
from contour.polygon.polygon import cutting_polygon
from contour.synthetic import render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from service.config.recipes import Recipe
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.trials import calibration_for

SCENES = (996_500, 100)
_LONG_PITCHES = 4.0
# A lens bends straight edges; chords of five cells follow it.
_STEP_PITCHES = 5.0

Falsification = Callable[[Contour, float, np.random.Generator], Contour]


def with_spike(contour: Contour, pitch: float, rng: np.random.Generator) -> Contour:
    """The contour with a spike out of its exterior, four cells long and one wide, somewhere along an edge."""
    return replace(contour, exterior=_with_tip(contour.exterior, _LONG_PITCHES * pitch, pitch, rng))


def with_notch(contour: Contour, pitch: float, rng: np.random.Generator) -> Contour:
    """The contour with a notch into its exterior, four cells deep and one wide, somewhere along an edge."""
    return replace(contour, exterior=_with_tip(contour.exterior, -_LONG_PITCHES * pitch, pitch, rng))


def too_fat(contour: Contour, pitch: float, _: np.random.Generator) -> Contour:
    """The contour moved outwards by a cell everywhere."""
    return oriented_contour(offset_contour(contour, -pitch), counter_clockwise=False)


def as_traced(contour: Contour, _pitch: float, _: np.random.Generator) -> Contour:
    """The contour as it is."""
    return contour


WAYS: dict[str, Falsification] = {
    "a spike four cells long, one wide": with_spike,
    "a notch four cells deep, one wide": with_notch,
    "a cell too fat everywhere": too_fat,
    "none: as traced": as_traced,
}


def seen_in(seed: int) -> tuple[bool | None, ...]:
    """Whether each falsification of one scene's outline is refused as a disagreement; None where it cannot be made."""
    scene = random_scene(seed).scene
    rendered = render(scene)
    rectifier = calibration_for(rendered.camera).rectifier(rendered.thickness_mm)
    try:
        found = trace(rendered.picture, TraceSettings(edge=scene.edge), rectifier=rectifier)
    except ContourError:
        return (None,) * len(WAYS)
    assert found.pitch_px is not None
    pitch = found.pitch_px
    rings = [
        rectifier.unrectify(densified(rectifier.rectify(ring), _STEP_PITCHES * pitch)) for ring in found.contour.rings
    ]
    whole = Contour(rings[0], tuple(rings[1:]))
    polygon = cutting_polygon(found.contour, None, height_mm=0.0, tolerance_mm=0.1)
    limits = Limits(max_disagreement_pitches=Recipe(number=1, name="default").max_disagreement_pitches)
    view = View((rendered.picture.shape[1], rendered.picture.shape[0]))
    seen: list[bool | None] = []
    for way in WAYS.values():
        try:
            false = way(whole, pitch, np.random.default_rng(seed))
        except ContourError:
            seen.append(None)
            continue
        told = CheckedTrace(found, disagreement=disagreement(rendered.picture, false, pitch))
        findings = judge(polygon, view, limits, traced=told)
        seen.append(any(finding.refusal is Refusal.METHODS_DISAGREE for finding in findings))
    return tuple(seen)


def report(seen: Sequence[tuple[bool | None, ...]], seeds: Sequence[int]) -> str:
    """The shares as Markdown."""
    rows = []
    for number, way in enumerate(WAYS):
        judged = [one[number] for one in seen if one[number] is not None]
        rows.append([way, str(len(judged)), str(sum(map(bool, judged)))])
    return (
        "## False outlines seen by the second account of the block\n\n"
        f"Outlines traced in random-{seeds[0]} to random-{seeds[-1]}, falsified, and judged by the service's limits "
        "(`python -m benchmarks.accuracy.falsified_outlines --write`).\n\n"
        + table(["falsification", "outlines", "refused as methods_disagree"], rows)
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Falsify and judge; 0."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy.falsified_outlines", description=__doc__)
    parser.add_argument("--first", type=int, default=SCENES[0], metavar="SEED", help="seed of the first random scene")
    parser.add_argument("--count", type=int, default=SCENES[1], metavar="N", help="so many random scenes")
    parser.add_argument("--write", action="store_true", help="write the section of docs/reports/accuracy.md")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.count)
    with ProcessPoolExecutor(max_workers=2) as pool:
        text = report(list(pool.map(seen_in, seeds)), seeds)
    print(text)
    if options.write:
        put_section("falsified", text)
    return 0


def _with_tip(ring: Ring, out: float, wide: float, rng: np.random.Generator) -> Ring:
    """The ring with a triangle on one of its edges that are long enough, `out` high (inwards where negative)."""
    along = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(along[:, 0], along[:, 1])
    k = int(rng.choice(np.flatnonzero(length >= min(2.0 * wide, length.max()))))
    direction = along[k] / length[k]
    # Of a ring with positive area what is inside lies to the left, (-dy, dx).
    outward = np.array([direction[1], -direction[0]]) * (-1.0 if signed_area(ring) < 0 else 1.0)
    foot = ring[k] + rng.uniform(0.3, 0.7) * along[k]
    half = 0.5 * min(wide, 0.5 * float(length[k])) * direction
    triangle = np.array([foot - half, foot + out * outward, foot + half])
    return np.insert(ring, k + 1, triangle, axis=0)


if __name__ == "__main__":
    sys.exit(main())
