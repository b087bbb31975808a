"""Right, wrong or refused on blocks that another hand draws: `python -m benchmarks.other_hand` (`--help`).

Judged as `benchmarks.accuracy.shop_floor` judges those of our own, without a calibration.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.accuracy.shop_floor import RECIPE, SPACING_PX, Verdict, add_kinds, chosen, run, told
from benchmarks.other_hand.scene import KINDS, scene
from benchmarks.page_section import options_of_seeds
from contour.geometry.agreement import places_along
from contour.geometry.rings import Contour
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
    seen = Measurer(None).measure(drawn.picture, RECIPE, 0.0)
    places = places_along(truth, SPACING_PX)
    over = cv2.dilate(drawn.hidden.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    column, row = np.clip(np.rint(places).astype(int), 0, [over.shape[1] - 1, over.shape[0] - 1]).T
    clear = ~over[row, column]
    codes = tuple(int(reason) for reason in seen.reasons)
    verdict = Verdict((kind,), seed, codes, drawn.pitch_px, SPACING_PX * float(np.count_nonzero(~clear)))
    if seen.pixels is None or seen.uncertainty_px is None:
        return verdict
    return verdict.with_outline(seen.pixels, seen.uncertainty_px, truth, places[clear])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when no wrong outline was accepted, else 1."""
    parser = options_of_seeds("benchmarks.other_hand", __doc__, seeds=10, first=FIRST)
    add_kinds(parser, "all if not given")
    options = parser.parse_args(arguments)
    kinds = chosen(parser, options, KINDS, KINDS)
    seeds = range(options.first, options.first + options.seeds)
    return told(run(kinds, seeds, judged, workers=options.workers), seeds, options, ("other-hand", _SAID))


if __name__ == "__main__":
    sys.exit(main())
