"""Whether certificates hold, and whether faults of a cell are found, on rendered cells that nobody has seen.

    python -m benchmarks.acceptance --first 1050100 --cells 100 --results acceptance.jsonl --write

A line a cell goes into the results; cells that are there already are not tested again, so that a run that was broken
off goes on. With `--write` the page becomes docs/reports/acceptance.md. A quarter of an hour on one core.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

from benchmarks.acceptance.page import page
from benchmarks.acceptance.trials import Outcome, cell_trial

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reports" / "acceptance.md"
BLOCK_EVERY = 5


def main() -> None:
    """Test, print, and write where asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=100)
    parser.add_argument("--first", type=int, required=True, help="first seed; take one that was never seen")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--results", type=Path, required=True, help="file of what was tested so far, JSON Lines")
    parser.add_argument("--write", action="store_true", help="write docs/reports/acceptance.md")
    args = parser.parse_args()
    seeds = range(args.first, args.first + args.cells)
    done = read_results(args.results)
    left = [seed for seed in seeds if seed not in done]
    with ProcessPoolExecutor(args.workers) as pool, args.results.open("a", encoding="utf-8") as file:
        for seed, outcomes in zip(left, pool.map(cell_trial, left, [s % BLOCK_EVERY == 0 for s in left]), strict=True):
            file.write(json.dumps({"seed": seed, "outcomes": [asdict(one) for one in outcomes]}) + "\n")
            file.flush()
            done[seed] = outcomes
            print(f"  cell {seed}", file=sys.stderr, flush=True)
    command = f"python -m benchmarks.acceptance --first {args.first} --cells {args.cells} --results FILE --write"
    text = page([one for seed in seeds for one in done[seed]], command)
    print(text)
    if args.write:
        PAGE.write_text(text, encoding="utf-8")


def read_results(path: Path) -> dict[int, list[Outcome]]:
    """What was tested before; a line that was broken off is tested again."""
    done: dict[int, list[Outcome]] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            told = json.loads(line)
        except ValueError:
            continue
        done[told["seed"]] = [Outcome(**one) for one in told["outcomes"]]
    return done


if __name__ == "__main__":
    main()
