"""The machine's clock jumps, as when a time server is found at last: by libfaketime, for the wall clock alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.reasons import Reason
from tests.support.processes import forked, processes
from tests.support.processes.cell import Cell
from tests.support.processes.processes import combtrace, jobs, until
from tests.support.real_parts import missing


@pytest.fixture
def clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file that says what time it is for processes that are started now: `+0`, `+400d`."""
    library = next(iter(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1")), None)
    if library is None:
        missing("libfaketime is not here. Install it: apt-get install faketime")
    path = tmp_path / "clock"
    path.write_text("+0\n")
    settings = {
        "LD_PRELOAD": str(library),
        "FAKETIME_TIMESTAMP_FILE": str(path),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        "FAKETIME_DONT_RESET": "1",
    }
    monkeypatch.setattr(processes, "ENVIRONMENT", {**processes.ENVIRONMENT, **settings})
    monkeypatch.setattr(forked, "begun", False)  # a library is loaded before all else
    return path


def test_jobs_go_on_whichever_way_the_clock_jumps(tmp_path: Path, clock: Path) -> None:
    cell = Cell(
        tmp_path,
        trigger_every_s=0.2,
        link=", heartbeat_timeout_s: 30",
        more="archive: {path: archive, min_free_bytes: 0}\n",
    )
    try:
        cell.goes_on(1)
        for jump in ("+400d", "-9000d", "+0"):
            clock.write_text(f"{jump}\n")
            cell.goes_on(1)
        listed = combtrace("jobs", "--config", tmp_path / "config.yaml", "--limit", "100")
        assert listed.returncode == 0, listed.stderr
        cell.service.kill()
        clock.write_text("-9000d\n")  # started in the past: numbers still go up
        cell.service = cell.start_service()
        cell.goes_on(2)  # the first may be the one that the kill cut short, settled before signals are heard
        until(lambda: list(tmp_path.glob("archive/*/*.json")), what="evidence")
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    assert "Traceback" not in cell.service.text
    found = jobs(cell.journal)
    years = {str(job["taken_at"])[:4] for job in found}
    assert len(years) >= 3, f"the clock did not jump: {years}"
    if found[-1]["reason"] == Reason.ABORTED:  # the stop cut the last one short
        found.pop()
    others = {(job["outcome"], job["reason"]) for job in found if job["outcome"] not in ("accepted", None)}
    # What is in flight as the clock jumps is not sent again; what the kill cut short was sent by then, or not.
    assert others <= {("failed", Reason.EXPIRED), ("failed", Reason.SERVICE_RESTARTED)}, "no frame is stale"
