"""A slice of the campaign of a plant's cells, and what judges it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.soak.plant_run import run
from tests.support.interop.sparkplug_read import faults


def test_a_few_cells_and_a_broker_that_is_killed_tell_all_and_are_born_and_die_rightly(tmp_path: Path) -> None:
    toll = run(tmp_path, cells=4, kills=2, period_s=0.5, up_s=0.5, kill_cells_every=2)
    assert toll.wrong == []
    assert (toll.broker_kills, toll.cell_kills) == (2, 1)
    assert toll.jobs >= 4, "nothing was tried"


def line(kind: str, seq: int | None, count: int | None = None, **more: Any) -> dict[str, Any]:
    metrics = [] if count is None else [{"name": "bdSeq", "value": count}]
    qos = 1 if kind == "NDEATH" else 0
    return {"kind": kind, "node": "a", "seq": seq, "metrics": metrics, "qos": qos, "retain": 0, **more}


RIGHT = [line("NBIRTH", 0, 7), line("NDATA", 1), line("NBIRTH", 0, 7), line("NDATA", 1), line("NDEATH", None, 7)]


def test_births_data_and_deaths_in_order_are_right() -> None:
    assert faults(RIGHT) == []


@pytest.mark.parametrize(
    ("at", "instead", "expected"),
    [
        (0, line("NDATA", 0), "not born"),
        (0, line("NBIRTH", 3, 7), "number 3, expected 0"),
        (1, line("NDATA", 2), "number 2, expected 1"),
        (1, line("NDATA", 1, retain=1), "retained 1"),
        (3, line("NDATA", 1, qos=1), "QoS 1"),
        (4, line("NDEATH", None, 6), "death 6 after birth 7"),
        (2, line("NDEATH", None, 7), "not born"),
        (1, {**line("NDATA", 1), "error": "DecodeError"}, "cannot be read"),
    ],
)
def test_each_thing_that_is_wrong_is_found(at: int, instead: dict[str, Any], expected: str) -> None:
    told = faults([*RIGHT[:at], instead, *RIGHT[at + 1 :]])
    assert any(expected in text for text in told), told
