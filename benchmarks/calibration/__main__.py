"""Stated against true error of calibrations from rendered boards, the whole chain, and bumps of the camera.

    python -m benchmarks.calibration --write

Prints the tables; with `--write` they become docs/reports/calibration-accuracy.md. About ten minutes on two cores.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.calibration.bumps import Bumps, measure_bumps
from benchmarks.calibration.page import page
from benchmarks.calibration.trials import ChainTrial, Trial, chain_trial, trial

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reports" / "calibration-accuracy.md"
FIRST_SEED = 5000
CHAIN_CAMERAS = 3


def main() -> None:
    """Measure, print, and write where asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cameras", type=int, default=20)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="first seed; others were never seen")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--write", action="store_true", help="write docs/reports/calibration-accuracy.md")
    args = parser.parse_args()
    seeds = range(args.first, args.first + args.cameras)
    campaigns: dict[str, list[Trial]] = {}
    with ProcessPoolExecutor(args.workers) as pool:
        running = {
            name: pool.map(trial, list(seeds)[:count], [tilt_deg] * count, [board] * count)
            for name, tilt_deg, board, count in (
                ("boards tilted to 8°", 8.0, "charuco", args.cameras),
                ("boards tilted to 20°", 20.0, "charuco", args.cameras // 4),
                ("chessboard, tilted to 20°", 20.0, "chessboard", args.cameras // 10),
            )
        }
        chains = pool.map(chain_trial, range(args.first, args.first + CHAIN_CAMERAS))
        for name, trials in running.items():
            campaigns[name] = list(trials)
            _note(name)
        chain: list[ChainTrial] = [one for some in chains for one in some]
        _note("whole chain")
        bumps: Bumps = measure_bumps(np.random.default_rng(args.first), pool)
    command = f"python -m benchmarks.calibration --cameras {args.cameras} --first {args.first} --write"
    text = page(campaigns, chain, bumps, command)
    print(text)
    if args.write:
        PAGE.write_text(text, encoding="utf-8")


def _note(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
