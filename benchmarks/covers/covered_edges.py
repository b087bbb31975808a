"""Where covers are told to lie, and bridges held against the truth: `python -m benchmarks.covers.covered_edges`.

Pictures of `shop_floor_scenes` with a tape, a clamp, a hand or a cable over the edge, measured as the service measures
them: once by a recipe that bridges nothing, and once by one that bridges whatever can be.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import cv2
import numpy as np

from benchmarks.accuracy.shop_floor import WRONG_PITCHES, true_places
from benchmarks.page_section import options_of_seeds, put_section, table
from contour.geometry.agreement import distances_to, places_along, rectified_edges
from contour.geometry.arrays import Bools, Float64s
from contour.geometry.ring_lengths import RingLengths
from contour.synthetic import Rendered, render, signed_distance
from contour.synthetic.shop_floor.covers import cover_areas
from service.config.recipes import Recipe
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Reason
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import calibration_for

FIRST = 983_000
COVERS = ("tape", "clamp", "hand_or_cable")
PLACE_PITCHES = 1.0
BRIDGING = {"max_bridged_mm": 1000.0, "bridge": "arcs"}

_SAID = """\
### Where covers lie, and bridges

Those of seeds {first} to {last} of {kinds} in which they hide some of the edge \
(`python -m benchmarks.covers.covered_edges --write`). Place right: the middle of the longest stretch told as \
hidden, which the words name, lies on a cover or within {place:g} cell of one. Told: how much of the truly hidden edge \
is told as hidden, the median. Bridged: accepted by a recipe that bridges whatever can be; of these, how many have \
95 % of the hidden edge within the stated bound, and how many are off by more than half a cell somewhere, hidden or \
not."""


@dataclass(frozen=True)
class CoveredEdge:
    """What became of one picture: its first code (0 = accepted) without bridging; where 117, how far from the nearest
    cover it was told, pitches, and the share of the hidden edge told; and with bridging, None where that is
    refused, whether the hidden edge is within the bound, and whether the outline is wrong.
    """

    kind: str
    seed: int
    code: int
    place_pitches: float | None = None
    told_share: float | None = None
    held: bool | None = None
    wrong: bool = False

    @property
    def place_right(self) -> bool:
        """Refused for what covers the edge, by the right place."""
        return self.place_pitches is not None and self.place_pitches <= PLACE_PITCHES


def covered_edge(kind: str, seed: int) -> CoveredEdge | None:
    """What becomes of the picture of this kind and seed; None where all of its edge is seen."""
    scene = shop_floor_scene(kind, seed).scene
    rendered = render(scene)
    places, clear = true_places(rendered)
    if clear.all():
        return None
    measurer = Measurer(calibration_for(rendered.camera))
    refused, bridged = (
        measurer.measure(rendered.picture, Recipe(number=1, name="default", min_area_mm2=0.0, **more), thickness_mm)
        for thickness_mm in [rendered.thickness_mm]
        for more in ({}, BRIDGING)
    )
    code = int(refused.reasons[0]) if refused.reasons else 0
    place, share = None, None
    if Reason.EDGE_COVERED in refused.reasons:
        middle, share = _told(refused, places[~clear])
        place = max(0.0, -max(float(signed_distance(area, middle)[0]) for area in cover_areas(scene)))
        place /= rendered.pitch_px
    held, wrong = (None, False) if bridged.reasons else _bridged(bridged, rendered, places, clear)
    return CoveredEdge(kind, seed, code, place, share, held, wrong)


def _told(seen: Measurement, hidden: Float64s) -> tuple[Float64s, float]:
    """The middle of the longest stretch told as hidden, (1, 2), pixels, and the share of the truly hidden edge, (N, 2),
    for which the nearest place of the outline is told as hidden.
    """
    assert seen.pixels is not None
    assert seen.evidence is not None
    rings = [RingLengths.of(ring) for ring in seen.pixels.rings]
    longest = max(
        (one for one in seen.evidence if one.state != "seen"),
        key=lambda one: one.length_px,
    )
    middle = rings[longest.ring].at(np.array([0.5 * (longest.from_px + longest.to_px)]))
    feet = np.stack([ring.feet(hidden) for ring in rings])
    away = np.stack([np.hypot(*(ring.at(at) - hidden).T) for ring, at in zip(rings, feet, strict=True)])
    nearest = away.argmin(axis=0)
    told = np.zeros(len(hidden), np.bool_)
    for one in seen.evidence:
        if one.state != "seen":
            at = feet[one.ring]
            told |= (nearest == one.ring) & (at >= one.from_px) & (at <= one.to_px)
    return middle, float(told.mean())


def _bridged(seen: Measurement, rendered: Rendered, places: Float64s, clear: Bools) -> tuple[bool, bool]:
    """Whether 95 % of the hidden edge lie within the bound, and whether the outline is off by half a cell somewhere."""
    assert seen.pixels is not None
    assert seen.uncertainty_px is not None
    outline = rectified_edges(seen.pixels, calibration_for(rendered.camera).rectifier(rendered.thickness_mm))
    to_found = distances_to(places, outline)
    to_truth = distances_to(places_along(outline, 1.0), rendered.truth_px)
    off = max(float(to_found.max()), float(to_truth.max()))
    return bool(np.mean(to_found[~clear] <= seen.uncertainty_px) >= 0.95), off > WRONG_PITCHES * rendered.pitch_px


def report(found: Sequence[CoveredEdge], seeds: Sequence[int]) -> str:
    """The section of the accuracy page."""
    head = ["", "edge hidden", "refused", "by 117", "place right", "told", "bridged", "within the bound", "wrong"]
    kinds = list(dict.fromkeys(one.kind for one in found))
    rows = [_row(kind, [one for one in found if one.kind == kind]) for kind in kinds]
    said = _SAID.format(first=seeds[0], last=seeds[-1], kinds=", ".join(kinds), place=PLACE_PITCHES)
    return f"{said}\n\n{table(head, [*rows, _row('all', found)])}"


def _row(name: str, some: Sequence[CoveredEdge]) -> list[str]:
    by_117 = [one for one in some if one.place_pitches is not None]
    told = f"{100 * np.median([one.told_share for one in by_117 if one.told_share is not None]):.0f} %"
    bridged = [one for one in some if one.held is not None]
    counts = [len(some), sum(one.code > 0 for one in some), len(by_117), sum(one.place_right for one in by_117)]
    after = [len(bridged), sum(one.held is True for one in bridged), sum(one.wrong for one in bridged)]
    return [name, *map(str, counts), told if by_117 else "–", *map(str, after)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when every cover is refused and no bridged outline is wrong, else 1."""
    parser = options_of_seeds("benchmarks.covers.covered_edges", __doc__, seeds=20, first=FIRST)
    parser.add_argument("--list", action="store_true", help="a line for each picture as well")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.seeds)
    jobs = [(kind, seed) for kind in COVERS for seed in seeds]
    # Not forked: where OpenCV's threads have run before, a forked process waits for them for ever.
    fresh = get_context("forkserver")
    with ProcessPoolExecutor(options.workers, fresh, cv2.setNumThreads, (1,)) as pool:
        found = [one for one in pool.map(covered_edge, *zip(*jobs, strict=True)) if one is not None]
    for one in found if options.list else ():
        print(one)
    text = report(found, seeds)
    print(text)
    if options.write:
        put_section("covered-edges", text)
    return int(any(one.code == 0 or one.wrong for one in found))


if __name__ == "__main__":
    sys.exit(main())
