"""Right, wrong or refused on blocks that another hand draws: `python -m benchmarks.other_hand` (`--help`).

Judged as `benchmarks.accuracy.shop_floor` judges those of our own, without a calibration.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.accuracy.shop_floor import SPACING_PX, Verdict, report, run
from benchmarks.other_hand.scene import KINDS, scene
from benchmarks.page_section import options_of_seeds, put_section
from contour.geometry.agreement import distances_to, places_along
from contour.geometry.rings import Contour
from service.config.recipes import Recipe
from service.measuring.measure import Measurer

FIRST = 700_000
_SAID = """\
## Blocks as another hand draws them

Scenes of `benchmarks/other_hand/`, seeds {first} to {last} of each kind, told as above but without a calibration \
(`python -m benchmarks.other_hand --write`). Who drew them knew nothing of our own scenes. The network is taught with \
others of their kind."""


def judged(kind: str, seed: int) -> Verdict:
    """The verdict on one picture."""
    drawn = scene(kind, seed)
    truth = Contour(drawn.rings[0], drawn.rings[1:])
    seen = Measurer(None).measure(drawn.picture, Recipe(number=1, name="default", min_area_mm2=0.0), 0.0)
    places = places_along(truth, SPACING_PX)
    over = cv2.dilate(drawn.hidden.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    column, row = np.clip(np.rint(places).astype(int), 0, [over.shape[1] - 1, over.shape[0] - 1]).T
    clear = ~over[row, column]
    codes, hidden_px = tuple(int(reason) for reason in seen.reasons), SPACING_PX * float(np.count_nonzero(~clear))
    if seen.pixels is None or seen.uncertainty_px is None:
        return Verdict((kind,), seed, codes, drawn.pitch_px, hidden_px)
    to_found = distances_to(places[clear], seen.pixels)
    to_truth = distances_to(places_along(seen.pixels, SPACING_PX), truth)
    return Verdict(
        (kind,),
        seed,
        codes,
        drawn.pitch_px,
        hidden_px,
        max(float(to_found.max()), float(to_truth.max())),
        seen.uncertainty_px,
        float(np.percentile(to_found, 95)),
        float(np.mean(to_found <= seen.uncertainty_px)),
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when no wrong outline was accepted, else 1."""
    parser = options_of_seeds("benchmarks.other_hand", __doc__, seeds=10, first=FIRST)
    parser.add_argument("--kinds", help="comma-separated; all if not given")
    parser.add_argument("--list", action="store_true", help="a line for each picture as well")
    options = parser.parse_args(arguments)
    kinds = options.kinds.split(",") if options.kinds else KINDS
    if unknown := set(kinds) - set(KINDS):
        parser.error(f"unknown kinds {', '.join(sorted(unknown))}; expected some of {', '.join(KINDS)}")
    seeds = range(options.first, options.first + options.seeds)
    verdicts = []
    for verdict in run(kinds, seeds, judged, workers=options.workers):
        verdicts.append(verdict)
        if options.list:
            print(verdict.line(), flush=True)
    text = report(verdicts, seeds, _SAID)
    print(text)
    if options.write:
        put_section("other-hand", text)
    return int(any(verdict.wrong for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
