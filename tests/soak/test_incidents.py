"""A slice of each campaign of `make soak` that does more to both sides than lose requests."""

from __future__ import annotations

import logging
import random
from collections import Counter
from pathlib import Path

import pytest

from tests.soak.cells.faulted_cell import FaultedCell, Terms
from tests.soak.cells.other_services import ForeignCell, TwinCell
from tests.soak.cells.restored_cell import RestoredCell
from tests.soak.cells.swapped_cell import SettingsCell, SpareCell
from tests.soak.cells.torn_cell import TearingController, TornCell

# What must have happened in each, by the names that the report gives it.
SLICES: list[tuple[type[FaultedCell], Terms, set[str]]] = [
    (RestoredCell, Terms(seed=910, jobs=12, risk=0.0, incidents=3), {"journal put back"}),
    (ForeignCell, Terms(seed=912, jobs=4, risk=0.0, incidents=1), {"foreign owner after the commit"}),
    (SpareCell, Terms(seed=914, jobs=8, risk=0.0, incidents=1), set()),
    (SettingsCell, Terms(seed=915, jobs=8, risk=0.0, incidents=1), set()),
    (TornCell, Terms(seed=916, jobs=12, risk=0.0, incidents=1), {"last_job half written", "clock half written"}),
]


@pytest.mark.parametrize(("cell", "terms", "happened"), SLICES, ids=lambda value: getattr(value, "__name__", ""))
async def test_what_always_holds_holds(
    tmp_path: Path, cell: type[FaultedCell], terms: Terms, happened: set[str], caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "pymodbus")
    came_to = await cell(tmp_path, terms).run(60)
    assert came_to.findings.counts == Counter(), came_to.findings.texts
    assert came_to.accepted >= 1
    assert came_to.restarts.total() >= terms.incidents
    assert happened <= came_to.restarts.keys()


async def test_what_always_holds_holds_for_two_services_with_copies_of_one_journal(tmp_path: Path) -> None:
    came_to = await TwinCell(tmp_path, Terms(seed=913, jobs=1, risk=0.0)).run(60)
    assert came_to.findings.counts == Counter(), came_to.findings.texts
    assert came_to.restarts.total() == 1


def test_a_controller_that_tears_shows_half_of_a_value_whose_halves_both_change_and_no_beat() -> None:
    torn: Counter[str] = Counter()
    clock = iter((0.0, 0.001, 0.002, 0.003, 0.020, 0.021))
    clocks, beats = [], []
    controller = TearingController(chance=random.Random(1), torn=torn, clock_start_ms=65_530, now=lambda: next(clock))
    for _ in range(6):
        controller._scan()
        registers = controller.registers(0, 16)
        clocks.append(registers[14] << 16 | registers[15])
        beats.append(registers[1])
    assert clocks[3:] in ([65_533, 131_069, 65_551], [65_533, 14, 65_551])
    assert torn == {"clock half written": 1}
    assert beats[4] == beats[3]
    assert beats[5] != beats[4]
