"""Right, wrong or refused when things lie on the block: `python -m benchmarks.accuracy.shop_floor` (`--help`).

Pictures of `shop_floor_scenes`, measured as the service measures them, by a recipe that says nothing. An accepted
outline is wrong where a visible place of the true outline lies farther than half a cell from it, or a place of it
farther than half a cell from the true outline, hidden parts included. With `--taught` the empty table is taught first,
from four pictures, and the usual kinds are those in which it is no plain dark one.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from benchmarks.page_section import options_of_seeds, put_section, table
from contour.errors import PictureError
from contour.geometry.agreement import distances_to, places_along, rectified_edges
from contour.geometry.arrays import Bools, Float64s
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour
from contour.image.taught_table import teach
from contour.synthetic import Rendered, render, render_empty_table
from service.config.recipes import Recipe
from service.measuring.measure import Measurer
from service.measuring.table_file import TableRecord
from tests.support.scenes.shop_floor_scenes import GUARDS, KINDS, LATER, STRUCTURED, ShopFloorScene, shop_floor_scene
from tests.support.scenes.trials import calibration_for

FIRST = 500_000
WRONG_PITCHES = 0.5
SPACING_PX = 1.0
TAUGHT_FROM = 4
RECIPE = Recipe(number=1, name="default", min_area_mm2=0.0)
"""It says nothing: with it nothing hidden is bridged."""
TRUE, HIDDEN, FOUND = (80, 220, 60), (0, 200, 255), (60, 60, 255)

_SAID = """\
## When things lie on the block

Scenes of `tests/support/scenes/shop_floor_scenes.py`, seeds {first} to {last} of each kind, through the same code as \
the service's (`python -m benchmarks.accuracy.shop_floor --write`). Wrong: accepted, and off by more than half a cell \
somewhere. Hidden: part of the edge is covered, and the outline was accepted all the same. Refused: how many by which \
code. Bound broken: less than 95 % of the visible outline lie within the bound; its ratio to the true 95th percentile \
is the median."""
_SAID_OF_TAUGHT = """\
### On a table that was taught

Seeds {first} to {last} of the kinds in which the table is no plain dark one, taught before from pictures of it empty \
(`python -m benchmarks.accuracy.shop_floor --taught --write`)."""


@dataclass(frozen=True)
class Verdict:
    """What became of a picture. Lengths in pixels; those of an outline are None where there is none.

    `off_px` is how far the outline lies off at worst, `within` the share of the visible true outline that lies within
    the stated bound, `true_px` within how much 95 % of it lie.
    """

    kinds: tuple[str, ...]
    seed: int
    codes: tuple[int, ...]
    pitch_px: float
    hidden_px: float
    off_px: float | None = None
    bound_px: float | None = None
    true_px: float | None = None
    within: float | None = None

    def with_outline(self, found: Contour, bound_px: float, truth: Contour, visible: Float64s) -> Verdict:
        """The same of a picture in which an outline was found, with its bound; `visible` are places of the true one."""
        to_found, to_truth = distances_to(visible, found), distances_to(places_along(found, SPACING_PX), truth)
        return replace(
            self,
            off_px=max(float(to_found.max()), float(to_truth.max())),
            bound_px=bound_px,
            true_px=float(np.percentile(to_found, 95)),
            within=float(np.mean(to_found <= bound_px)),
        )

    @property
    def accepted(self) -> bool:
        """Whether the outline would be sent."""
        return not self.codes

    @property
    def wrong(self) -> bool:
        """Accepted, but off by more than half a cell somewhere."""
        return self.accepted and (self.off_px is None or self.off_px > WRONG_PITCHES * self.pitch_px)

    @property
    def broken(self) -> bool:
        """Accepted with a bound that does not hold 95 % of the outline."""
        return self.accepted and (self.within is None or self.within < 0.95)

    @property
    def row(self) -> str:
        """The row of the table it counts in."""
        if len(self.kinds) == 1:
            return self.kinds[0]
        return "two at once, edge hidden" if self.hidden_px > 0.0 else "two at once, edge seen"

    def line(self) -> str:
        """The verdict in one line."""
        said = "WRONG" if self.wrong else "right" if self.accepted else "refused"
        cells = "" if self.off_px is None else f"off {self.off_px / self.pitch_px:5.2f} cells"
        bound = "" if self.bound_px is None else f"bound {self.bound_px:5.2f} px, true {self.true_px:5.2f} px"
        parts = ["+".join(self.kinds), str(self.seed), said, ",".join(map(str, self.codes)) or "-"]
        broken = "BROKEN" if self.broken else ""
        hidden = f"hidden {self.hidden_px / self.pitch_px:4.1f} cells" if self.hidden_px > 0.0 else ""
        return " ".join([*parts, f"pitch {self.pitch_px:4.1f} px", cells, bound, broken, hidden]).strip()


def judged(kind: str, seed: int, *, alone: bool = False, taught: bool = False, save: Path | None = None) -> Verdict:
    """The verdict on one picture; an overlay goes to the folder `save` where it is wrong."""
    scene = shop_floor_scene(kind, seed, alone=alone)
    rendered = render(scene.scene)
    verdict, found = _measured(scene, rendered, _taught(scene) if taught else None)
    if save is not None and verdict.wrong:
        cv2.imwrite(str(save / f"{scene.name}.png"), overlay(rendered, found))
    return verdict


def _taught(scene: ShopFloorScene) -> TableRecord | None:
    """The scene's table as a user would teach it; None where that is refused, as of pictures hard compressed."""
    try:
        return TableRecord(teach(render_empty_table(scene.scene, TAUGHT_FROM)), "", TAUGHT_FROM, "")
    except PictureError:
        return None


def _measured(
    scene: ShopFloorScene, rendered: Rendered, empty: TableRecord | None = None
) -> tuple[Verdict, Contour | None]:
    calibration = calibration_for(rendered.camera)
    seen = Measurer(calibration, table=empty).measure(rendered.picture, RECIPE, rendered.thickness_mm)
    codes = tuple(int(reason) for reason in seen.reasons)
    places, clear = true_places(rendered)
    hidden_px = float(SPACING_PX * np.count_nonzero(~clear))
    verdict = Verdict(scene.kinds, scene.scene.seed, codes, rendered.pitch_px, hidden_px)
    if seen.pixels is None or seen.uncertainty_px is None:
        return verdict, seen.pixels
    outline = rectified_edges(seen.pixels, calibration.rectifier(rendered.thickness_mm))
    return verdict.with_outline(outline, seen.uncertainty_px, rendered.truth_px, places[clear]), outline


def true_places(rendered: Rendered) -> tuple[Float64s, Bools]:
    """Places along the true outline at equal spacing, pixels, shape (N, 2), and whether each is visible."""
    places, clear = [], []
    for ring, seen in zip(rendered.truth_px.rings, rendered.visible, strict=True):
        lengths = RingLengths.of(ring)
        at = np.arange(0.0, lengths.length, SPACING_PX)
        places.append(lengths.at(at))
        clear.append(np.interp(at, lengths.starts, seen, period=lengths.length) > 0.99)
    return np.concatenate(places), np.concatenate(clear)


def overlay(rendered: Rendered, found: Contour | None) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """The picture with the true outline (green, orange where hidden) and the found one (red)."""
    grey = rendered.picture.ndim == 2
    drawn = cv2.cvtColor(rendered.picture, cv2.COLOR_GRAY2BGR) if grey else rendered.picture.copy()
    places, clear = true_places(rendered)
    for (x, y), seen in zip(np.rint(places).astype(int).tolist(), clear.tolist(), strict=True):
        cv2.circle(drawn, (x, y), 1, TRUE if seen else HIDDEN, -1)
    for ring in found.rings if found is not None else ():
        cv2.polylines(drawn, [np.rint(ring * 16).astype(np.int32)], True, FOUND, 1, cv2.LINE_AA, 4)
    return np.asarray(drawn, dtype=np.uint8)


def report(verdicts: Sequence[Verdict], seeds: Sequence[int], said: str = _SAID) -> str:
    """The section of the accuracy page, `said` of the {first} and {last} seed, and a table with a row a kind."""
    head = ["", "pictures", "right", "of them hidden", "wrong, accepted", "refused", "bound broken", "bound over true"]
    rows = [_row(name, [v for v in verdicts if v.row == name]) for name in dict.fromkeys(v.row for v in verdicts)]
    return f"{said.format(first=seeds[0], last=seeds[-1])}\n\n{table(head, [*rows, _row('all', verdicts)])}"


def _row(name: str, some: Sequence[Verdict]) -> list[str]:
    taken = [v for v in some if v.accepted]
    wrong = sum(v.wrong for v in taken)
    codes = Counter(v.codes[0] for v in some if not v.accepted)
    refused = ", ".join(f"{count} by {code}" for code, count in sorted(codes.items())) or "0"
    ratios = [v.bound_px / max(v.true_px, 0.05) for v in taken if v.bound_px is not None and v.true_px is not None]
    ratio = f"{np.median(ratios):.2f}" if ratios else "–"
    hidden = sum(v.hidden_px > 0.0 and not v.wrong for v in taken)
    counts = [len(some), len(taken) - wrong, hidden, wrong]
    return [name, *map(str, counts), refused, str(sum(v.broken for v in taken)), ratio]


def run(
    kinds: Iterable[str], seeds: Sequence[int], judge: Callable[[str, int], Verdict], *, workers: int
) -> Iterator[Verdict]:
    """The verdicts on all kinds and seeds, in order."""
    jobs = [(kind, seed) for kind in kinds for seed in seeds]
    if workers == 1:
        cv2.setNumThreads(1)
        yield from (judge(*job) for job in jobs)
        return
    with ProcessPoolExecutor(workers, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        yield from pool.map(judge, *zip(*jobs, strict=True))


def add_kinds(parser: ArgumentParser, usual: str) -> None:
    """The options which kinds, and whether each picture is listed."""
    parser.add_argument("--kinds", help=f"comma-separated; {usual}")
    parser.add_argument("--list", action="store_true", help="a line for each picture as well")


def chosen(parser: ArgumentParser, options: Namespace, usual: Sequence[str], known: Collection[str]) -> Sequence[str]:
    """The kinds that were asked for, or the usual ones; an end with what is known where one is not."""
    kinds = options.kinds.split(",") if options.kinds else usual
    unknown = [kind for kind in kinds if kind not in known]
    if unknown:
        parser.error(f"unknown kinds {', '.join(unknown)}; expected some of {', '.join(known)}")
    return kinds


def told(judged: Iterable[Verdict], seeds: Sequence[int], options: Namespace, section: tuple[str, str]) -> int:
    """Print what became of pictures as they are judged, and the section by its name and what it says first, which is
    written where that was asked for; 0 when no wrong outline was accepted, else 1.
    """
    name, said = section
    verdicts = []
    for verdict in judged:
        verdicts.append(verdict)
        if options.list:
            print(verdict.line(), flush=True)
    text = report(verdicts, seeds, said)
    print(text)
    if options.write:
        put_section(name, text)
    return int(any(verdict.wrong for verdict in verdicts))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run; 0 when no wrong outline was accepted, else 1."""
    parser = options_of_seeds("benchmarks.accuracy.shop_floor", __doc__, seeds=20, first=FIRST)
    add_kinds(parser, "all but guards if not given (with --taught: tables not plain)")
    parser.add_argument("--alone", action="store_true", help="never two kinds at once")
    parser.add_argument("--taught", action="store_true", help="teach the empty table before each picture")
    parser.add_argument("--save", type=Path, metavar="DIR", help="overlays of wrong outlines go here")
    options = parser.parse_args(arguments)
    usual = STRUCTURED if options.taught else (*KINDS, *LATER)
    kinds = chosen(parser, options, usual, KINDS | LATER | GUARDS)
    if options.save is not None:
        options.save.mkdir(parents=True, exist_ok=True)
    seeds = range(options.first, options.first + options.seeds)
    judge = partial(judged, alone=options.alone, taught=options.taught, save=options.save)
    section = ("shop-floor-taught", _SAID_OF_TAUGHT) if options.taught else ("shop-floor", _SAID)
    return told(run(kinds, seeds, judge, workers=options.workers), seeds, options, section)


if __name__ == "__main__":
    sys.exit(main())
