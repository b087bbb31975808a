"""The trial of covered edges runs as its command does, and tells place and bridge by the truth alone."""

from __future__ import annotations

import pytest

from benchmarks.covers import covered_edges
from benchmarks.covers.covered_edges import CoveredEdge, covered_edge, main, report


def test_a_clamp_is_refused_by_its_place_and_bridged_within_the_bound() -> None:
    one = covered_edge("clamp", 982_000)
    assert one is not None
    assert (one.code, one.place_right, one.wrong) == (117, True, False)
    assert one.told_share is not None
    assert one.told_share > 0.5


def test_a_picture_in_which_all_of_the_edge_is_seen_does_not_count() -> None:
    assert covered_edge("undisturbed", 7) is None


def test_a_row_a_kind_counts_places_and_bridges() -> None:
    found = [
        CoveredEdge("tape", 1, 117, 0.2, 0.9, True),
        CoveredEdge("tape", 2, 117, 3.0, 0.5, False, True),
        CoveredEdge("tape", 3, 0, held=True),
    ]
    assert "| tape | 3 | 2 | 2 | 1 | 70 % | 3 | 2 | 1 |" in report(found, range(1, 4))


def test_the_command_ends_with_1_where_a_cover_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(covered_edges, "COVERS", ("undisturbed",))
    monkeypatch.setattr(covered_edges, "report", lambda found, seeds: f"{len(found)} of {len(seeds)}")
    assert main(["--seeds", "1", "--first", "7"]) == 0
