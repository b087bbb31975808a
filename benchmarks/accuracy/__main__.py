"""Accuracy and speed of every method in one run: `python -m benchmarks.accuracy` (`--help` for options).

Prints the tables; with `--write` they go to docs/reports/accuracy.md, with pictures of the scenes beside it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from fnmatch import fnmatch

import cv2

from benchmarks.accuracy import report
from benchmarks.accuracy.goals import goals
from benchmarks.accuracy.page import write_page
from benchmarks.accuracy.pictures import Gallery
from benchmarks.accuracy.speed import SpeedRow, speed_rows
from contour.synthetic import render
from tests.support.scenes.bench_scenes import BenchScene, measured_scenes, tuned_scenes
from tests.support.scenes.photographs import PhotographTrial, cell_pitch_px, photographs, run_photograph
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.rivals import RIVALS
from tests.support.scenes.trials import Trial, available_methods, run_trial

SPEED_SCENE = "12mp"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the bench; 0 when it ran, 2 when nothing was chosen."""
    options = _options(arguments)
    methods, missing = available_methods(tuple(options.method))
    for name in missing:
        print(f"skipped: {name} is not in this version", file=sys.stderr)
    scenes = [scene for scene in (*measured_scenes(), *tuned_scenes()) if fnmatch(scene.name, options.scenes)]
    if not methods or not (scenes or options.random):
        print(f"nothing to run: methods {methods}, scenes matching {options.scenes!r}", file=sys.stderr)
        return 2
    chosen = _chosen_method(methods, options.detail)
    gallery = Gallery(chosen) if options.write else None
    trials, speed = _run_scenes(scenes, methods, gallery)
    photo_trials = [] if options.no_photographs else _run_photographs(methods)
    random_trials, dim = _run_random(options.first, options.random, chosen)
    blocks = _blocks(scenes, trials, speed, photo_trials, random_trials, dim, chosen)
    for title, text in blocks:
        print(f"\n## {title}\n\n{text}")
    if gallery is not None:
        left_out = [name for name in available_methods()[0] if name not in methods]
        print("\nwritten: " + ", ".join(write_page(blocks, gallery, left_out)))
    return 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("--method", action="append", default=[], help="only this method (repeatable)")
    parser.add_argument("--scenes", default="*", help="only scenes whose name matches this pattern, e.g. 'tuned-*'")
    parser.add_argument("--detail", default="wall-tips", help="the method told scene by scene, and run at random")
    parser.add_argument("--random", type=int, default=0, metavar="N", help="also N scenes with random parameters")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first random scene")
    parser.add_argument("--no-photographs", action="store_true", help="leave the photographs out")
    parser.add_argument("--write", action="store_true", help="write docs/reports/accuracy.md and its pictures")
    return parser.parse_args(arguments)


def _chosen_method(methods: list[str], wanted: str) -> str:
    if wanted in methods:
        return wanted
    return next((name for name in methods if name not in RIVALS), methods[0])


def _run_scenes(
    scenes: Sequence[BenchScene], methods: list[str], gallery: Gallery | None
) -> tuple[list[Trial], list[SpeedRow]]:
    trials: list[Trial] = []
    speed: list[SpeedRow] = []
    for number, scene in enumerate(scenes, 1):
        print(f"{number}/{len(scenes)} {scene.name}", file=sys.stderr)
        rendered = render(scene.scene)
        cv2.medianBlur(rendered.picture, 5)  # first calls load code and threads: not any method's time
        own = [run_trial(scene, rendered, method) for method in methods]
        trials += own
        if gallery is not None:
            gallery.add(scene, rendered, own)
        if scene.name == SPEED_SCENE:
            speed = speed_rows(scene, rendered, [name for name in methods if name not in RIVALS])
    return trials, speed


def _run_photographs(methods: list[str]) -> list[PhotographTrial]:
    found, folder = photographs()
    if not found:
        print(f"skipped: no photographs in {folder} (COMBTRACE_PHOTOS names another folder)", file=sys.stderr)
    return [
        run_photograph(photograph, method, pitch)
        for photograph in found
        for pitch in [cell_pitch_px(photograph)]
        for method in methods
    ]


def _run_random(first: int, count: int, method: str) -> tuple[list[Trial], set[str]]:
    """Trials of random scenes, two at a time, and the names of those labelled dim."""
    if count == 0:
        return [], set()
    trials, dim = [], set()
    with ProcessPoolExecutor(max_workers=2) as pool:
        for number, (trial, is_dim) in enumerate(_in_order(pool, first, count, method), 1):
            trials.append(trial)
            if is_dim:
                dim.add(trial.scene)
            if number % 25 == 0:
                print(f"random {number}/{count}", file=sys.stderr)
    return trials, dim


def _in_order(pool: ProcessPoolExecutor, first: int, count: int, method: str) -> Iterator[tuple[Trial, bool]]:
    return pool.map(random_trial, range(first, first + count), [method] * count)


def random_trial(seed: int, method: str) -> tuple[Trial, bool]:
    """One random scene by one method, and whether it is labelled dim."""
    scene = random_scene(seed)
    return run_trial(scene, render(scene.scene), method), scene.dim


def _blocks(
    scenes: Sequence[BenchScene],
    trials: Sequence[Trial],
    speed: Sequence[SpeedRow],
    photo_trials: Sequence[PhotographTrial],
    random_trials: Sequence[Trial],
    dim: set[str],
    chosen: str,
) -> list[tuple[str, str]]:
    """Titles and texts of all tables that have rows."""
    measured = [scene for scene in scenes if not scene.tuned]
    tuned = [scene for scene in scenes if scene.tuned]
    blocks = []
    reached = goals(chosen, scenes, trials, speed, photo_trials, random_trials)
    if reached:
        blocks.append((f"What {chosen} is to reach, and does", report.goal_table(reached)))
    if measured:
        blocks.append((f"{len(measured)} scenes for measuring", report.summary(trials, measured)))
    if tuned:
        blocks.append((f"{len(tuned)} scenes for building (tuned)", report.summary(trials, tuned)))
    if speed:
        blocks.append(("Speed on the 12 MP scene", report.speed(speed)))
    if photo_trials:
        blocks.append(("Photographs", report.photos(photo_trials)))
    if random_trials:
        first, last = random_trials[0].scene, random_trials[-1].scene
        blocks.append((f"Random scenes {first} to {last}, {chosen}", report.random_summary(random_trials, dim)))
    if scenes:
        blocks.append((f"Scene by scene, {chosen}", report.details(trials, chosen)))
    return blocks


if __name__ == "__main__":
    sys.exit(main())
