"""What every driver of the Controller role promises, against a controller that keeps the protocol."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable

import numpy as np
import pytest

from drivers.controller import (
    Controller,
    ControllerRefused,
    ControllerUnavailable,
    LinkBlock,
    MailboxError,
    Page,
    ServiceBlock,
)
from drivers.controller.mailbox import ContourMessage, MailboxLayout, encode_pages, micrometres
from drivers.controller.modbus import ModbusTcpController
from drivers.controller.simulated import SimulatedController

PATIENT_S = 60.0  # longer than any test: what fails then did not fail by its time-out
LAYOUTS = {
    "default": MailboxLayout(),
    "little": MailboxLayout(word_order="little"),
    "elsewhere": MailboxLayout(link_address=9000, service_address=100, contour_address=1001, payload_capacity=602),
}

Pair = tuple[Controller, SimulatedController]


@pytest.fixture(autouse=True)
async def no_task_is_left() -> AsyncIterator[None]:
    before = asyncio.all_tasks()
    yield
    await asyncio.sleep(0.01)
    assert asyncio.all_tasks() - before - {asyncio.current_task()} == set()


@pytest.fixture(params=LAYOUTS)
def layout(request: pytest.FixtureRequest) -> MailboxLayout:
    return LAYOUTS[request.param]


@pytest.fixture(params=["modbus-tcp"])
async def pair(request: pytest.FixtureRequest, layout: MailboxLayout) -> AsyncIterator[Pair]:
    """A connected driver and the simulated controller that it talks to."""
    async with SimulatedController(layout=layout, scan_s=0.001) as simulated:
        controller = ModbusTcpController("127.0.0.1", simulated.port, layout=layout, timeout_s=PATIENT_S)
        await controller.connect()
        yield controller, simulated
        await controller.close()


def contour_page(layout: MailboxLayout, session: int, vertices: int = 4) -> Page:
    angles = np.linspace(0, 2 * np.pi, vertices, endpoint=False)
    ring = micrometres(np.stack([100 * np.cos(angles), 100 * np.sin(angles)], axis=1))
    area = round(vertices / 2 * 100**2 * np.sin(2 * np.pi / vertices))
    message = ContourMessage(1, (ring,), area, 200, 0, 1, False, False, 0, session)
    (page,) = encode_pages(message, layout.payload_capacity, layout.word_order)
    return page


async def until(condition: Callable[[], Awaitable[bool]]) -> None:
    """Return when `condition` holds; what never comes fails the test rather than hang it."""
    async with asyncio.timeout(PATIENT_S / 4):
        while not await condition():
            await asyncio.sleep(0.001)


async def test_the_link_block_is_read_as_the_controller_wrote_it(pair: Pair) -> None:
    controller, simulated = pair
    await controller.write_service(ServiceBlock())

    async def echoed() -> bool:
        link = await controller.read_link()
        return link.session != 0 and link.test_echo == 0x01020305

    await until(echoed)
    assert (await controller.read_link()).controller_state == 1
    assert simulated.verdict.clean


async def test_the_service_block_is_read_back_as_it_was_written(pair: Pair) -> None:
    controller, simulated = pair
    block = ServiceBlock(1, 5, 7, 65535, 3, 131, 2**32 - 1, session_ack=9, owner=77, settled_job=2**31)
    await controller.write_service(block)
    assert await controller.read_service() == block
    assert simulated.verdict.clean


@pytest.mark.parametrize(
    ("rings", "pairs"),
    [(0, 0), (1, 0), (1, 22), (1, 23), (2, 22), (2, 53), (3, 120), (1, 149), (61, 30), (62, 53), (301, 0)],
)
async def test_a_page_is_read_back_as_it_was_written_and_no_value_is_split(pair: Pair, pairs: int, rings: int) -> None:
    controller, simulated = pair
    header = list(range(1000, 1031))
    header[0], header[3], header[5], header[6] = 1, 1, rings, 2 * rings + 4 * pairs
    page = Page(tuple(header), tuple(range(2000, 2000 + 2 * rings + 4 * pairs)))
    await controller.write_transfer(0)
    await controller.write_page(page)
    assert await controller.read_page(len(page.payload)) == page
    await controller.write_transfer(1)
    assert simulated.verdict.clean, simulated.verdict


async def test_a_whole_page_arrives_by_the_steps_of_a_transfer(pair: Pair, layout: MailboxLayout) -> None:
    controller, simulated = pair

    async def started() -> bool:
        return (await controller.read_link()).session != 0

    await until(started)
    vertices = (layout.payload_capacity - 2) // 4
    await controller.write_service(ServiceBlock(service_state=5))
    await controller.write_transfer(0)
    await controller.write_page(contour_page(layout, (await controller.read_link()).session, vertices))
    await controller.write_transfer(1)

    async def answered() -> bool:
        return (await controller.read_link()).ack_transfer == 1

    await until(answered)
    link = await controller.read_link()
    assert (link.ack_result, link.last_job, link.last_result) == (1, 1, 1)
    assert simulated.verdict.accepted == 1
    assert simulated.verdict.clean, simulated.verdict


async def test_requests_of_several_tasks_each_get_their_own_reply(pair: Pair) -> None:
    controller, simulated = pair

    async def write_and_read(number: int) -> None:
        for turn in range(20):
            await controller.write_service(ServiceBlock(job_id=number, service_heartbeat=turn))
            assert isinstance(await controller.read_link(), LinkBlock)

    async with asyncio.TaskGroup() as group:
        for number in range(8):
            group.create_task(write_and_read(number))
    assert simulated.verdict.clean, simulated.verdict


async def test_a_driver_that_was_closed_says_so_and_connects_again(pair: Pair) -> None:
    controller, _ = pair
    await controller.close()
    assert not controller.connected
    with pytest.raises(ControllerUnavailable, match="not connected"):
        await controller.read_link()
    await controller.connect()
    assert controller.connected
    await controller.read_link()


async def test_a_controller_that_goes_away_is_noticed_while_nothing_is_asked(pair: Pair) -> None:
    controller, simulated = pair
    await simulated.stop()

    async def gone() -> bool:
        return not controller.connected

    await until(gone)
    with pytest.raises(ControllerUnavailable, match="closed the connection"):
        await controller.write_transfer(0)


async def test_a_register_that_the_controller_does_not_have_is_refused_in_words(
    pair: Pair, layout: MailboxLayout
) -> None:
    _, simulated = pair
    other = MailboxLayout(link_address=20000)
    controller = ModbusTcpController("127.0.0.1", simulated.port, layout=other, timeout_s=PATIENT_S)
    await controller.connect()
    with pytest.raises(ControllerRefused, match=r"FC3 of registers 20000 to 20015 \(420001 to 420016\)") as refusal:
        await controller.read_link()
    assert refusal.value.code == 2
    assert "illegal data address" in str(refusal.value)
    assert controller.connected
    await controller.close()


@pytest.mark.parametrize("device_id", [0, 256, -1])
def test_a_device_id_that_none_can_have_is_refused(device_id: int) -> None:
    with pytest.raises(MailboxError, match="expected 1 to 255"):
        ModbusTcpController("127.0.0.1", 502, device_id=device_id)
