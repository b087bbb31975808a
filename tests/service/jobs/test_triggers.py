"""Serving a serial line that comes and goes, with a port that fails as it is told to."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from drivers.trigger import TriggerUnavailable
from service.jobs.health import Health
from service.jobs.kept_port import KeptPort
from service.jobs.triggers import SerialTrigger
from service.records.journal import Journal
from service.state import StateMachine


class HalfDeadPort:
    """A port that can be opened and not read."""

    def __init__(self) -> None:
        self.opened = 0

    def open(self) -> None:
        self.opened += 1

    def read_line(self, timeout_s: float) -> bytes | None:
        raise TriggerUnavailable("ttyX: was lost (Input/output error)")

    def write_line(self, text: str) -> None:
        raise TriggerUnavailable("ttyX: was lost (Input/output error)")

    def close(self) -> None:
        pass


async def test_a_port_that_opens_and_cannot_be_read_is_not_back_and_is_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    port, health = HalfDeadPort(), Health(StateMachine())
    journal = Journal(tmp_path / "journal.sqlite")
    with ThreadPoolExecutor(1) as pool:
        trigger = SerialTrigger(port, KeptPort(port, "ttyX", health, pool), None, journal, str)  # type: ignore[arg-type]
        task = asyncio.ensure_future(trigger.run())
        while port.opened < 3:
            await asyncio.sleep(0.01)
            assert port.opened < 2 or health.fault("serial ttyX") is not None
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    journal.close()
    assert [record.levelname for record in caplog.records if "ttyX" in record.message] == ["WARNING"]
