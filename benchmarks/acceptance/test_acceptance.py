"""The page counts what was tested, and a run that was broken off goes on."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from benchmarks.acceptance.__main__ import read_results
from benchmarks.acceptance.page import page
from benchmarks.acceptance.trials import BLOCK_GOOD, BLOCK_HEIGHT, GOOD, TABLE, UNMARKED, Outcome


def outcome(arm: str, decision: str, true_mm: float = 0.01) -> Outcome:
    return Outcome(arm, decision, decision, 0.04, 0.03, 0.5, 0.02, 0.1, true_mm, "")


def test_goals_are_met_by_what_was_found_and_by_limits_that_hold() -> None:
    good = [outcome(GOOD, "passes")] * 19 + [outcome(GOOD, "undecided", 0.3)]
    found = [outcome(TABLE, "fails")] * 18 + [outcome(TABLE, "passes")] * 2
    rest = [outcome(arm, "fails") for arm in (UNMARKED, BLOCK_GOOD, BLOCK_HEIGHT)]
    text = page([*good, *found, *rest], "bench")
    assert "| good cells pass | 19 of 20 | yes |" in text
    assert "| 19 of 19 | yes |" in text
    assert "| 18 of 20 found | no |" in text
    assert "worst 0.300 mm" in text


def test_cells_that_were_tested_are_read_again_and_a_torn_line_is_not(tmp_path: Path) -> None:
    results = tmp_path / "results.jsonl"
    assert read_results(results) == {}
    whole = json.dumps({"seed": 7, "outcomes": [asdict(outcome(GOOD, "passes"))]})
    results.write_text(f"{whole}\n{whole[:-9]}\n")
    assert read_results(results) == {7: [outcome(GOOD, "passes")]}
