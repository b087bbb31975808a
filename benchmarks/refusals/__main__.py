"""What is refused and what is not: `make refusals`, or `python -m benchmarks.refusals` (`--help` for options).

Pictures without a whole block must be refused, each by a right name; traceable ones must not. Prints the tables; with
`--write` they take their place in docs/reports/accuracy.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from fnmatch import fnmatch

from benchmarks.page_section import PAGE, put_section, table
from benchmarks.refusals.checking_cost import ALLOWED, checking_cost
from benchmarks.refusals.refusal_scenes import refusal_scenes
from benchmarks.refusals.table_scenes import table_scenes
from contour.synthetic import render
from service.config.recipes import Recipe
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from tests.support.scenes.bench_scenes import BenchScene, measured_scenes, tuned_scenes
from tests.support.scenes.metrics import agreement
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.trials import measured

TITLE = "What is refused, and by what name"
# Another block lies beside these: they are what `pieces: largest` is for.
_LARGEST = {"glare-and-neighbour"}
RANDOM = (996_700, 80)


@dataclass(frozen=True)
class Verdict:
    """What became of a picture: the reasons by name, the first one's words, and whether that is right."""

    scene: str
    tuned: bool
    right: bool
    reasons: tuple[str, ...]
    text: str
    off_pitches: float = 0.0


def judged_refusal(name: str) -> Verdict:
    """The verdict on a picture without a whole block; without a calibration, limits in millimetres do not help."""
    scene = next(scene for scene in refusal_scenes() if scene.name == name)
    seen = Measurer(None).measure(scene.make(), Recipe(number=1, name="default"), 20.0)
    return _verdict(scene.name, scene.tuned, bool(seen.reasons) and seen.reasons[0].label in scene.right, seen)


def judged_traceable(scene: BenchScene) -> Verdict:
    """The verdict on a traceable picture, with the calibration of its camera."""
    rendered = render(scene.scene)
    recipe = Recipe(
        number=1, name="default", edge=scene.scene.edge, pieces="largest" if scene.name in _LARGEST else "one"
    )
    seen = measured(rendered, recipe)
    verdict = _verdict(scene.name, scene.tuned, not seen.findings, seen)
    if seen.pixels is None:
        return verdict
    return replace(verdict, off_pitches=agreement(seen.pixels, rendered.truth_px).hausdorff_px / rendered.pitch_px)


def _judged_random(seed: int) -> Verdict:
    return judged_traceable(random_scene(seed))


def _verdict(name: str, tuned: bool, right: bool, seen: Measurement) -> Verdict:
    labels = tuple(reason.label for reason in seen.reasons)
    return Verdict(name, tuned, right, labels, seen.texts[0] if seen.texts else "")


def report(refused: Sequence[Verdict], traceable: Sequence[Verdict]) -> str:
    """The tables as Markdown."""
    parts = [
        "Pictures without a whole block (`benchmarks/refusals/refusal_scenes.py`) and traceable ones (blocks on "
        "coloured, dark and structured tables from `benchmarks/refusals/table_scenes.py`, random ones, and the scenes "
        "above), through the same code as the service's. Fresh: nobody had seen picture or seed before this run. "
        "`tuned-…` were looked at while thresholds were chosen, and the scenes above while methods were built.\n",
        table(
            ["", "pictures", "as they should be", "refused by a wrong name", "wrongly accepted or refused"],
            [
                _summary("without a whole block, fresh", [v for v in refused if not v.tuned], traceable=False),
                _summary("without a whole block, tuned", [v for v in refused if v.tuned], traceable=False),
                _summary("traceable, fresh", [v for v in traceable if _fresh(v)], traceable=True),
                _summary(
                    "traceable, the scenes above",
                    [v for v in traceable if not v.tuned and not _fresh(v)],
                    traceable=True,
                ),
                _summary("traceable, tuned", [v for v in traceable if v.tuned], traceable=True),
            ],
        ),
    ]
    far = sorted((v for v in traceable if v.right), key=lambda verdict: -verdict.off_pitches)[:1]
    for worst in far:
        parts.append(
            f"\nOf those accepted, {sum(v.right and v.off_pitches > 1 for v in traceable)} lie more than a cell pitch "
            f"off somewhere; the worst is {worst.scene} with {worst.off_pitches:.2f} pitches (Hausdorff)."
        )
    if refused:
        parts.append("\n" + _plain_table(["picture", "refused by", "right", "in words"], map(_refused_row, refused)))
    wrong = [verdict for verdict in traceable if not verdict.right]
    if wrong:
        parts.append("\n" + _plain_table(["traceable, but refused", "by", "in words"], map(_wrong_row, wrong)))
    return "\n".join(parts)


def _fresh(verdict: Verdict) -> bool:
    return not verdict.tuned and verdict.scene.startswith(("random-", "table-"))


def _summary(what: str, verdicts: Sequence[Verdict], *, traceable: bool) -> list[str]:
    wrong = [verdict for verdict in verdicts if not verdict.right]
    misnamed = 0 if traceable else sum(bool(verdict.reasons) for verdict in wrong)
    return [what, str(len(verdicts)), str(len(verdicts) - len(wrong)), str(misnamed), str(len(wrong) - misnamed)]


def _plain_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def _refused_row(verdict: Verdict) -> list[str]:
    by = ", ".join(verdict.reasons) or "**accepted**"
    return [verdict.scene, by, "yes" if verdict.right else "**no**", _short(verdict.text)]


def _wrong_row(verdict: Verdict) -> list[str]:
    return [verdict.scene, ", ".join(verdict.reasons), _short(verdict.text)]


def _short(text: str) -> str:
    """The first sentence: what was measured and the limit."""
    return text.split(". ", maxsplit=1)[0].replace("|", "/").rstrip(".")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run all pictures; 0 when all are judged rightly, 1 when not."""
    options = _options(arguments)
    names = [scene.name for scene in refusal_scenes() if fnmatch(scene.name, options.scenes)]
    scenes = (*measured_scenes(), *tuned_scenes(), *table_scenes())
    chosen = [scene for scene in scenes if fnmatch(scene.name, options.scenes) and not options.only_refusals]
    seeds = [] if options.only_refusals else range(options.first, options.first + options.random)
    with ProcessPoolExecutor(max_workers=2) as pool:
        refused = _told(pool.map(judged_refusal, names), len(names))
        traceable = _told(pool.map(judged_traceable, chosen), len(chosen))
        traceable += _told(pool.map(_judged_random, seeds), len(seeds))
    cost = checking_cost()
    text = f"{report(refused, traceable)}\n\n{cost}"
    print(text)
    if options.write:
        put_section("refusals", f"## {TITLE}\n\n{text}")
        print(f"\nwritten: {PAGE}")
    return 0 if all(verdict.right for verdict in (*refused, *traceable)) and cost.share <= ALLOWED else 1


def _told(verdicts: Iterable[Verdict], count: int) -> list[Verdict]:
    found = []
    for number, verdict in enumerate(verdicts, 1):
        found.append(verdict)
        if not verdict.right:
            print(f"wrong: {verdict.scene}: {verdict.reasons or 'accepted'} {verdict.text}", file=sys.stderr)
        if number % 25 == 0:
            print(f"{number}/{count}", file=sys.stderr)
    return found


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.refusals", description=__doc__)
    parser.add_argument("--scenes", default="*", help="only scenes whose name matches this pattern, e.g. 'tuned-*'")
    parser.add_argument("--random", type=int, default=RANDOM[1], metavar="N", help="so many random traceable scenes")
    parser.add_argument("--first", type=int, default=RANDOM[0], metavar="SEED", help="seed of the first random scene")
    parser.add_argument("--only-refusals", action="store_true", help="leave the traceable scenes out")
    parser.add_argument("--write", action="store_true", help="write the section of docs/reports/accuracy.md")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
