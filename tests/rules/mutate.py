"""Takes each rule out of a copy of the code and runs its test, which must then fail: `python -m tests.rules.mutate`.

It must fail twice, by an assertion or an error of its own: what fails for load fails once, and what cannot be imported
or set up was never tried.
"""

from __future__ import annotations

import argparse
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from xml.etree import ElementTree

from tests.rules.rule import ROOT, Rule
from tests.rules.table import RULES

PARTS = ("contour", "drivers", "service", "tests", "pyproject.toml")
BOUND_S = 60  # a test that no longer ends has failed too
PASSED, FAILED, NO_LONGER_ENDS = "passed", "failed", "no longer ends"
FAILURES = (FAILED, NO_LONGER_ENDS)
NEVER_TRIED = ("ImportError", "ModuleNotFoundError", "NameError", "SyntaxError", "IndentationError")


class Copy:
    """A copy of the code, from which one rule at a time is taken out. bytecode: where it is kept, for all copies."""

    def __init__(self, folder: Path, bytecode: Path) -> None:
        self._folder = folder
        self._bytecode = bytecode
        self._seconds = itertools.count(1)
        folder.mkdir()
        for part in PARTS:
            source = ROOT / part
            copying = shutil.copytree if source.is_dir() else shutil.copy2
            copying(source, folder / part)

    def without(self, rule: Rule) -> str:
        """What the rule's test comes to without it, twice the same; "passed" where it passes once."""
        file = self._folder / rule.code.partition("::")[0]
        text, found = file.read_text(encoding="utf-8"), file.stat()
        file.write_text(rule.taken_out(), encoding="utf-8")
        # Bytecode is told apart by whole seconds and length, which two mutations may share.
        changed_at = int(found.st_mtime) + next(self._seconds)
        os.utime(file, (changed_at, changed_at))
        try:
            first = self.come_to([rule.test])
            return self.come_to([rule.test]) if first in FAILURES else first
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, ns=(found.st_atime_ns, found.st_mtime_ns))

    def come_to(self, tests: Iterable[str]) -> str:
        """What the tests come to: "passed", "failed", "no longer ends", or why they were never tried."""
        report = self._folder / "report.xml"
        report.unlink(missing_ok=True)
        names = sorted(set(tests))
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", f"--junitxml={report}", *names]
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        environment["PYTHONPYCACHEPREFIX"] = str(self._bytecode)
        bound_s = BOUND_S * (1 + len(names) // 10)
        try:
            done = subprocess.run(
                command, cwd=self._folder, capture_output=True, timeout=bound_s, check=False, env=environment
            )
        except subprocess.TimeoutExpired:
            return NO_LONGER_ENDS
        return told(done.returncode, report)


def told(status: int, report: Path) -> str:
    """What pytest's exit status and its report in JUnit's format say together."""
    if status == 0:
        return PASSED
    with suppress(OSError, ElementTree.ParseError):
        failures = [found.get("message", "") for found in ElementTree.parse(report).iter("failure")]
        if status == 1 and failures:
            never = [text for text in failures if text.startswith(NEVER_TRIED)]
            return f"never tried: {never[0]}" if never else FAILED
        for found in ElementTree.parse(report).iter("error"):
            return f"never tried: {found.get('message')}"
    return f"never tried: pytest ended with {status}"


def main() -> int:
    """0 where every test that is named fails without its rule, and passes with it."""
    parser = argparse.ArgumentParser(prog="make rules", description=__doc__)
    parser.add_argument("words", nargs="*", help="only rules that have one of these words")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="how many at a time")
    args = parser.parse_args()
    rules = [rule for rule in RULES if not args.words or any(word in rule.said for word in args.words)]
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="combtrace-rules-") as folder:
        copies: SimpleQueue[Copy] = SimpleQueue()
        for number in range(args.workers):
            copies.put(Copy(Path(folder) / str(number), Path(folder) / "bytecode"))

        def without(rule: Rule) -> str:
            copy = copies.get()
            try:
                return copy.without(rule)
            finally:
                copies.put(copy)

        copy = copies.get()
        whole = copy.come_to(rule.test for rule in rules)
        copies.put(copy)
        print(f"{'ok   ' if whole == PASSED else 'FAULT'} with every rule: {whole}", flush=True)
        unkept = 0
        with ThreadPoolExecutor(args.workers) as pool:
            for rule, seen in zip(rules, pool.map(without, rules), strict=True):
                unkept += seen not in FAILURES
                print(f"{'ok   ' if seen in FAILURES else 'FAULT'} {rule.said}: {seen}", flush=True)
    print(f"{len(rules)} rules, {unkept} whose test does not fail without them; {time.monotonic() - began:.0f} s")
    return 1 if unkept or whole != PASSED else 0


if __name__ == "__main__":
    raise SystemExit(main())
