"""`make soak`: every campaign, in pieces, several at a time; the report goes to docs/reports/reliability.md.

A run that was broken off is resumed: pieces whose result is in --state are not run again. `--fresh` begins anew.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from tests.soak.pieces import Amounts, all_pieces, run_piece
from tests.soak.report import write_report

ROOT = Path(__file__).parents[2]
REPORT = ROOT / "docs" / "reports" / "reliability.md"
NICE = 10


def main() -> int:
    """0 where no promise was broken, 1 where one was, or a piece did not come to its end."""
    args = _arguments()
    if args.piece:
        result = asdict(run_piece(args.piece, args.folder))
        print(json.dumps(result))
        return 0
    if args.fresh and args.state.exists():
        shutil.rmtree(args.state)
    args.state.mkdir(parents=True, exist_ok=True)
    amounts = Amounts(**{field.name: getattr(args, field.name) for field in fields(Amounts)})
    names = [name for name in all_pieces(amounts) if not args.only or name.split(":")[0] in args.only]
    broken = _run(names, args.state, args.workers)
    results = [json.loads(_file(args.state, name).read_text()) for name in names if _file(args.state, name).exists()]
    if not args.no_report:
        write_report(args.report, results)
        print(f"report: {args.report}")
    broken += sum(sum(result["findings"].values()) for result in results)
    print(f"{len(results)} of {len(names)} pieces, {broken} violations")
    return 1 if broken or len(results) < len(names) else 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make soak", description=__doc__)
    for field in fields(Amounts):
        option = "--" + field.name.replace("_", "-")
        parser.add_argument(option, type=int, default=field.default, metavar="N", help=f"default {field.default}")
    parser.add_argument("--only", nargs="+", metavar="CAMPAIGN", help="only these campaigns")
    parser.add_argument("--workers", type=int, default=2 * (os.cpu_count() or 1), help="pieces at a time")
    parser.add_argument("--state", type=Path, default=ROOT / "build" / "soak", help="where results are kept")
    parser.add_argument("--report", type=Path, default=REPORT, help="the page that gets the report")
    parser.add_argument("--no-report", action="store_true", help="write none")
    parser.add_argument("--fresh", action="store_true", help="forget the results that are there")
    parser.add_argument("--piece", help="run this one piece here, and print its result: campaign:seed:amount")
    parser.add_argument("--folder", type=Path, help="with --piece: where its journals and logs are kept")
    return parser.parse_args()


def _run(names: list[str], state: Path, workers: int) -> int:
    """Run what has no result yet; the number of pieces that broke down."""
    missing = [name for name in names if not _file(state, name).exists()]
    broken = 0
    with ThreadPoolExecutor(workers) as pool:
        running = {pool.submit(_run_one, name, state): name for name in missing}
        for number, done in enumerate(as_completed(running), start=1):
            name, result = running[done], done.result()
            broken += result is None
            told = "BROKE DOWN, see its log" if result is None else _told(result)
            print(f"[{number}/{len(missing)}] {name}: {told}", flush=True)
    return broken


def _run_one(name: str, state: Path) -> dict[str, Any] | None:
    """The piece's result, kept in a file; None where it broke down. What it left is kept where it found anything."""
    folder = state / name.replace(":", "-")
    shutil.rmtree(folder, ignore_errors=True)
    command = [sys.executable, "-m", "tests.soak", "--piece", name, "--folder", str(folder)]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False, preexec_fn=lambda: os.nice(NICE)
    )
    if done.returncode != 0:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "error.txt").write_text(done.stdout + done.stderr)
        return None
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    if not result["findings"]:
        shutil.rmtree(folder, ignore_errors=True)
    _file(state, name).write_text(json.dumps(result))
    return result


def _told(result: dict[str, Any]) -> str:
    found = result["findings"]
    text = f"{result['done']} done, {result['accepted']} accepted, {result['seconds']:.0f} s, "
    return text + ("no violation" if not found else f"VIOLATIONS {found}: {result['texts'][:3]}")


def _file(state: Path, name: str) -> Path:
    return state / f"{name.replace(':', '-')}.json"


if __name__ == "__main__":
    sys.exit(main())
