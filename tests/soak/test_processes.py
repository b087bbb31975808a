"""A slice of each campaign of `make soak` in which service and controller are processes, killed, stopped or starved."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tests.soak.cells.disk_cell import DiskCell
from tests.soak.cells.killed_cell import KilledCell, Killing
from tests.soak.cells.stopped_cell import StoppedCell
from tests.soak.cells.told_cell import ToldCell
from tests.support.processes.small_disk import CannotMount
from tests.support.real_parts import missing


async def test_what_always_holds_holds_though_the_service_is_killed(tmp_path: Path) -> None:
    toll = await KilledCell(tmp_path, Killing(seed=904, kills=3, victim="service")).kill_service()
    assert toll.findings.counts == Counter(), toll.findings.texts
    assert toll.kills.total() == 3
    assert toll.accepted >= 2


async def test_what_always_holds_holds_though_the_controller_is_killed(tmp_path: Path) -> None:
    killing = Killing(seed=905, kills=3, victim="controller", word_order="little")
    toll = await KilledCell(tmp_path, killing).kill_controller()
    assert toll.findings.counts == Counter(), toll.findings.texts
    assert toll.kills.total() == 3
    assert toll.accepted >= 3


@pytest.mark.parametrize(
    ("cell", "killing"),
    [
        (StoppedCell, Killing(seed=917, kills=1, victim="service")),
        (DiskCell, Killing(seed=919, kills=1, victim="service")),
        (ToldCell, Killing(seed=920, kills=1, victim="service")),
    ],
    ids=["stopped", "disk", "serial line"],
)
async def test_what_always_holds_holds_for_processes(tmp_path: Path, cell: type[KilledCell], killing: Killing) -> None:
    running = cell(tmp_path, killing)
    try:
        toll = await running.kill_service()
    except CannotMount as why:
        missing(str(why))
    assert toll.findings.counts == Counter(), toll.findings.texts
    assert toll.kills.total() == killing.kills
    assert toll.acknowledged >= 2
