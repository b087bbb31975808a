"""The bench of closed and cut borders on one picture each: what it counts."""

from __future__ import annotations

from benchmarks.accuracy.edge_kinds import Verdict, judged, report
from tests.support.scenes.lattices import lattice

SEED = 977101


def test_a_closed_lattice_is_told_and_right() -> None:
    verdict = judged("hexagonal", "closed", SEED)
    assert (verdict.told, verdict.codes, verdict.wrong, verdict.broken) == (True, (), False, False)
    assert verdict.mean_px is not None
    assert verdict.mean_px < 0.7


def test_the_table_counts_each_verdict_once() -> None:
    right = Verdict("round", "cut", True, (), 0.1, wrong=False, broken=False)
    wrong = Verdict("round", "cut", False, (), 9.0, wrong=True, broken=True)
    refused = Verdict("round", "cut", True, (113,), None, wrong=False, broken=False)
    lines = report([right, wrong, refused], range(5, 8)).splitlines()
    assert "| all | 3 | 2 | 1 | 0.10 | 1 | 1 by 113 | 1 |" in lines
    assert "| cut, round | 3 | 2 | 1 | 0.10 | 1 | 1 by 113 | 1 |" in lines
    assert "seeds\n5 to 7" in report([right], range(5, 8))


def test_a_cut_that_opens_no_cell_leaves_a_border_closed() -> None:
    closed, opened = lattice(1222022, "round", "mixed"), lattice(1222017, "hexagonal", "mixed")
    assert (closed.edge, closed.opened) == ("cells", 0)
    assert (opened.edge, opened.opened) == ("mixed", 2)
