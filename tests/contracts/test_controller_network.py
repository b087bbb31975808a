"""Driver and simulated controller with a network between them that loses, cuts and delays."""

from __future__ import annotations

import asyncio
import contextlib
import random

import numpy as np
import pytest

from drivers.controller import ControllerError, ControllerUnavailable, LinkBlock, Page
from drivers.controller.mailbox.pages import ContourMessage, encode_pages
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.fault_proxy import Fate, FaultProxy

TIMEOUT_S = 0.03
SESSION = 9
FAULTS = [fate for fate in Fate if fate is not Fate.PASS]


def square_mm(job_id: int) -> list[tuple[float, float]]:
    return [(0, 0), (job_id, 0), (job_id, job_id), (0, job_id)]


def page_of(job_id: int) -> Page:
    ring = 1000 * np.array(square_mm(job_id))
    message = ContourMessage(job_id, (ring,), job_id**2, None, 0, 1, True, False, 0, SESSION)
    return encode_pages(message, 1984, "big")[0]


class Sender:
    """The steps of a transfer, again and again until the controller has settled the job; no more policy than that."""

    def __init__(self, controller: ModbusTcpController) -> None:
        self._controller = controller
        self._transfer = 0

    async def settle(self, job_id: int) -> int:
        """The controller's final answer to the job."""
        page = page_of(job_id)
        while True:
            try:
                if not self._controller.connected:
                    await self._controller.connect()
                link = await self._look(job_id)
                if link.last_job != job_id:
                    link = await self._attempt(page, job_id, link)
            except ControllerUnavailable:
                continue
            if link.last_job == job_id:
                return link.last_result

    async def _look(self, job_id: int) -> LinkBlock:
        link = await self._controller.read_link()
        assert link.last_job <= job_id
        return link

    async def _attempt(self, page: Page, job_id: int, link: LinkBlock) -> LinkBlock:
        await self._controller.write_transfer(0)
        await self._controller.write_page(page)
        self._transfer = next(
            value
            for value in ((self._transfer + step) & 0xFFFF for step in (1, 2, 3))
            if value not in (0, link.ack_transfer)
        )
        with contextlib.suppress(ControllerUnavailable):
            await self._controller.write_transfer(self._transfer)
        for _ in range(20):
            if not self._controller.connected:
                await self._controller.connect()
            link = await self._look(job_id)
            if link.ack_transfer == self._transfer or link.last_job == job_id:
                break
            await asyncio.sleep(0.002)
        return link


@pytest.mark.parametrize("seed", range(3))
async def test_whatever_the_network_does_each_job_is_accepted_once_and_as_it_was_sent(seed: int) -> None:
    chance = random.Random(seed)
    taken: list[AcceptedContour] = []
    jobs = range(1, 41)

    def fate(request: bytes) -> Fate:
        return chance.choice(FAULTS) if chance.random() < 0.15 else Fate.PASS

    async with (
        SimulatedController(session_source=lambda: SESSION, scan_s=0.001, on_accepted=taken.append) as simulated,
        FaultProxy(simulated.port, fate, lateness_s=2 * TIMEOUT_S) as proxy,
    ):
        while simulated.registers(13, 1) != (SESSION,):
            await asyncio.sleep(0.001)
        controller = ModbusTcpController("127.0.0.1", proxy.port, timeout_s=TIMEOUT_S)
        sender = Sender(controller)
        answers = [await sender.settle(job_id) for job_id in jobs]
        await controller.close()
    assert answers == [1] * len(jobs)
    assert [(contour.job_id, list(contour.rings[0])) for contour in taken] == [(job, square_mm(job)) for job in jobs]
    assert set(proxy.fates) >= {Fate.PASS, Fate.LATE, Fate.CUT_AFTER}


@pytest.mark.parametrize("fate", FAULTS)
async def test_a_request_without_its_reply_is_unavailable_and_the_next_connection_works(fate: Fate) -> None:
    fates = iter([fate])
    async with (
        SimulatedController(scan_s=0.001) as simulated,
        FaultProxy(simulated.port, lambda request: next(fates, Fate.PASS), lateness_s=0) as proxy,
    ):
        controller = ModbusTcpController("127.0.0.1", proxy.port, timeout_s=1.0)
        await controller.connect()
        with pytest.raises(ControllerError) as lost:
            await controller.write_transfer(5)
        assert isinstance(lost.value, ControllerUnavailable)
        assert not controller.connected
        done = fate in (Fate.LOSE_REPLY, Fate.CUT_AFTER, Fate.LATE)
        assert simulated.registers(32, 1) == ((5,) if done else (0,))
        await controller.connect()
        await controller.write_transfer(0)
        await controller.close()
    assert simulated.registers(32, 1) == (0,)
