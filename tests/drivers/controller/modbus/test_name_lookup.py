"""Names of controllers: a name server that hangs holds up nothing but the connection that needs it."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from drivers.controller import ControllerUnavailable
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.modbus.name_lookup import addresses_of
from drivers.controller.simulated.controller import SimulatedController

NAME = "cutter.plant.example"
PATIENT_S = 30.0
ATTEMPTS = 40  # more than the event loop's shared pool has threads on any machine


class NameServer:
    """Knows `NAME`, and says so only once it is let go on."""

    def __init__(self) -> None:
        self.asked = 0
        self.goes_on = threading.Event()
        self._really = socket.getaddrinfo

    def getaddrinfo(self, host: str, port: int, **how: Any) -> Any:
        if host != NAME or how.get("flags"):
            return self._really(host, port, **how)
        self.asked += 1
        assert self.goes_on.wait(PATIENT_S)
        return self._really("127.0.0.1", port, **how)


@pytest.fixture
def name_server(monkeypatch: pytest.MonkeyPatch) -> Iterator[NameServer]:
    server = NameServer()
    monkeypatch.setattr(socket, "getaddrinfo", server.getaddrinfo)
    yield server
    server.goes_on.set()


async def test_a_name_server_that_hangs_takes_no_thread_from_anybody_else(name_server: NameServer) -> None:
    controller = ModbusTcpController(NAME, 502, timeout_s=0.01)
    for _ in range(ATTEMPTS):
        with pytest.raises(ControllerUnavailable, match=r"no connection in 0\.01 s"):
            await controller.connect()
    async with asyncio.timeout(PATIENT_S / 2):  # before the name server gives up by itself
        assert await asyncio.to_thread(lambda: "the journal") == "the journal"
    assert name_server.asked == 1


async def test_when_the_name_server_answers_again_the_next_attempt_connects(name_server: NameServer) -> None:
    async with SimulatedController() as simulated:
        controller = ModbusTcpController(NAME, simulated.port, timeout_s=0.05)
        with pytest.raises(ControllerUnavailable):
            await controller.connect()
        name_server.goes_on.set()
        patient = ModbusTcpController(NAME, simulated.port, timeout_s=PATIENT_S)
        await patient.connect()
        await patient.read_link()
        await patient.close()


async def test_an_address_in_numbers_needs_no_name_server(monkeypatch: pytest.MonkeyPatch) -> None:
    def start(_thread: threading.Thread) -> None:
        raise AssertionError("a thread for nothing")

    monkeypatch.setattr(threading.Thread, "start", start)
    (found,) = await addresses_of("127.0.0.1", 502)
    assert found[4] == ("127.0.0.1", 502)


async def test_a_name_without_an_address_is_told_and_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def unknown(host: str, port: int, **_how: Any) -> Any:
        asked.append(host)
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    controller = ModbusTcpController(NAME, 502, timeout_s=PATIENT_S)
    for _ in range(2):
        with pytest.raises(ControllerUnavailable, match="Name or service not known"):
            await controller.connect()
    assert len(asked) == 4, "each time first as a number"
