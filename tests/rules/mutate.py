"""Takes each rule out of a copy of the code and runs its test, which must then fail: `python -m tests.rules.mutate`."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.rules.table import ROOT, RULES, Rule, source_of

PARTS = ("contour", "drivers", "service", "tests", "pyproject.toml")
BOUND_S = 60  # a test that no longer ends has failed too


def main() -> int:
    """0 where every test that is named fails without its rule, and passes with it."""
    wanted = sys.argv[1:]
    rules = [rule for rule in RULES if not wanted or any(word in rule.said for word in wanted)]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        for part in PARTS:
            source = ROOT / part
            copying = shutil.copytree if source.is_dir() else shutil.copy2
            copying(source, copy / part)
        whole = _failed(copy, {rule.test for rule in rules})
        print(f"{'FAULT' if whole else 'ok   '} with every rule the tests pass", flush=True)
        unkept = [rule for rule in rules if not _fails_without(copy, rule)]
    print(f"{len(rules)} rules, {len(unkept)} whose test passes without them")
    return 1 if unkept or whole else 0


def _fails_without(copy: Path, rule: Rule) -> bool:
    file = copy / rule.code.partition("::")[0]
    text = file.read_text(encoding="utf-8")
    whole = source_of(rule.code)
    file.write_text(text.replace(whole, whole.replace(rule.there, rule.without, 1)), encoding="utf-8")
    try:
        failed = _failed(copy, {rule.test})
    finally:
        file.write_text(text, encoding="utf-8")
    print(f"{'ok   ' if failed else 'FAULT'} {rule.said}", flush=True)
    return failed


def _failed(copy: Path, tests: set[str]) -> bool:
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *sorted(tests)]
    try:
        bound_s = BOUND_S * (1 + len(tests) // 10)
        done = subprocess.run(command, cwd=copy, capture_output=True, timeout=bound_s, check=False)
    except subprocess.TimeoutExpired:
        return True
    if done.returncode not in (0, 1):
        raise RuntimeError(done.stdout.decode()[-2000:])
    return done.returncode == 1


if __name__ == "__main__":
    raise SystemExit(main())
