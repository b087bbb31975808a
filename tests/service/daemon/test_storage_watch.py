"""A disk that is nearly full is a fault before it is full, and clears once there is room again."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.daemon.storage_watch import StorageLimits, StorageWatch
from service.jobs.health import Health
from service.reasons import Reason
from service.records.journal import Journal
from service.state import State, StateMachine


@pytest.fixture
def journal(tmp_path: Path):
    opened = Journal(tmp_path / "journal.sqlite")
    yield opened
    opened.close()


async def test_too_little_free_is_error_with_storage_full_until_a_tenth_more_is_free(
    tmp_path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    free = [200]
    monkeypatch.setattr("service.daemon.storage_watch.free_bytes", lambda _path: free[0])
    health = Health(StateMachine())
    health.start()
    watch = StorageWatch(journal, tmp_path / "journal.sqlite", health, None, StorageLimits(100))
    states = []
    for free[0] in (200, 99, 105, 111):
        await watch.look()
        states.append(health.state)
    assert states == [State.READY, State.ERROR, State.ERROR, State.READY]
    free[0] = 99
    await watch.look()
    fault = health.fault("storage")
    assert fault is not None
    assert fault.reason is Reason.STORAGE_FULL
    assert "Free space" in fault.text


async def test_a_disk_that_cannot_be_looked_at_is_a_fault(
    tmp_path: Path, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(_path: Path) -> int:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr("service.daemon.storage_watch.free_bytes", gone)
    health = Health(StateMachine())
    await StorageWatch(journal, tmp_path / "journal.sqlite", health, None, StorageLimits(100)).look()
    fault = health.fault("storage")
    assert fault is not None
    assert "Input/output error" in fault.text
