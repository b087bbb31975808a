"""The whole daemon against controllers that take little, answer as another unit, and write 32 bits in two scans."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.processes.cell import ON_SAMPLES, Cell


@pytest.mark.parametrize(
    ("machine", "link"),
    [
        ("max_registers: 16, write_single: false", "longest_write: 16, longest_read: 16, single_write: fc16"),
        ("max_registers: 20, answer_as: 255", "longest_write: 20, longest_read: 20, device_id: 0"),
        ("torn: true, scan_ms: 50, clock_start_ms: 60000", ""),
    ],
)
def test_jobs_are_accepted_by_a_controller_that_is_not_as_most_are(tmp_path: Path, machine: str, link: str) -> None:
    cell = Cell(
        tmp_path,
        camera=ON_SAMPLES,
        trigger_every_s=0.2,
        scenario=f"machine: {{{machine}}}\n",
        link=f", {link}" if link else "",
    )
    try:
        cell.goes_on(3)
    finally:
        cell.stop()
    assert {job["outcome"] for job in cell.settled()} == {"accepted"}
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert verdict["clean"], verdict["violations"]
