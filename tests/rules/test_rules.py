"""The table of rules names code and tests that exist, and docs/reports/reliability.md shows it as it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.rules.mutate import FAILED, PASSED, told
from tests.rules.page import PAGE, fresh
from tests.rules.rule import Rule, source_of
from tests.rules.table import RULES


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.said)
def test_code_and_test_of_a_rule_exist(rule: Rule) -> None:
    assert rule.there in source_of(rule.code)
    assert source_of(rule.test)


def test_the_page_shows_the_table_as_it_is() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert fresh(page) == page, "write it by: python -m tests.rules.page"


def test_what_is_left_without_a_rule_is_a_program_whose_names_exist(tmp_path: Path) -> None:
    """Else its test would fail for the wrong reason."""
    for number, rule in enumerate(RULES):
        (tmp_path / f"rule_{number}.py").write_text(rule.taken_out(), encoding="utf-8")
    looked = subprocess.run(
        [Path(sys.executable).with_name("ruff"), "check", "--isolated", "--select", "E9,F821", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert looked.returncode == 0, looked.stdout


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("def test_it(): assert True", PASSED),
        ("def test_it(): assert False", FAILED),
        ("def test_it(): raise ValueError(1)", FAILED),
        ("import nowhere\ndef test_it(): assert False", "never tried: collection failure"),
        ("def test_it(nobody): assert False", 'never tried: failed on setup with "'),
        ("def test_it(): nobody()", "never tried: NameError: name 'nobody' is not defined"),
        ("", "never tried: pytest ended with 5"),
    ],
)
def test_only_what_was_tried_and_failed_counts(tmp_path: Path, text: str, seen: str) -> None:
    (tmp_path / "test_one.py").write_text(text)
    report = tmp_path / "report.xml"
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", f"--rootdir={tmp_path}", f"--junitxml={report}"]
    done = subprocess.run([*command, tmp_path], capture_output=True, check=False)
    assert told(done.returncode, report).startswith(seen)
