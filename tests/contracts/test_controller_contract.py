"""What every driver of the Controller role promises: by each way, against each server."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import replace

import numpy as np
import pytest

from drivers.controller import (
    Controller,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
    LinkBlock,
    MailboxError,
    Page,
    ServiceBlock,
)
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import ContourMessage, encode_pages, micrometres
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.controller_cells import PATIENT_S, SERVERS, WAYS, Cell, cell

LAYOUTS = {
    "default": MailboxLayout(),
    "little": MailboxLayout(word_order="little"),
    "elsewhere": MailboxLayout(link_address=9000, service_address=100, contour_address=1001, payload_capacity=602),
}
# Layouts and word orders are the codec's, the same by every way: all of them by one way, one of them by the others.
PAIRS = [
    *((way, server, "default") for way in WAYS for server in SERVERS),
    *(("modbus-tcp", "simulated", layout) for layout in ("little", "elsewhere")),
    ("modbus-rtu", "simulated", "elsewhere"),
]

Pair = tuple[Controller, SimulatedController]


@pytest.fixture(params=PAIRS, ids="-".join)
async def there(request: pytest.FixtureRequest) -> AsyncIterator[Cell]:
    """A server, and what makes drivers to it."""
    way, server, layout = request.param
    async with cell(way, server, LAYOUTS[layout]) as made:
        yield made


@pytest.fixture
def layout(request: pytest.FixtureRequest) -> MailboxLayout:
    names: tuple[str, str, str] = request.node.callspec.params["there"]
    return LAYOUTS[names[2]]


@pytest.fixture
async def controller(there: Cell, layout: MailboxLayout) -> AsyncIterator[Controller]:
    """A connected driver."""
    made = there.driver(layout)
    await made.connect()
    yield made
    await made.close()


@pytest.fixture
def pair(there: Cell, controller: Controller) -> Pair:
    """The driver and the simulated controller, where the server is one."""
    if there.simulated is None:
        pytest.skip("libmodbus holds registers; it plays no controller")
    return controller, there.simulated


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


async def test_the_service_block_is_read_back_as_it_was_written(there: Cell, controller: Controller) -> None:
    block = ServiceBlock(1, 5, 7, 65535, 3, 131, 2**32 - 1, session_ack=9, owner=77, settled_job=2**31)
    await controller.write_service(block)
    assert await controller.read_service() == block
    assert there.clean()


@pytest.mark.parametrize(
    ("rings", "pairs"),
    [(0, 0), (1, 0), (1, 22), (1, 23), (2, 22), (2, 53), (3, 120), (1, 149), (61, 30), (62, 53), (301, 0)],
)
async def test_a_page_is_read_back_as_it_was_written_and_no_value_is_split(
    there: Cell, controller: Controller, pairs: int, rings: int
) -> None:
    header = list(range(1000, 1031))
    header[0], header[3], header[5], header[6] = 1, 1, rings, 2 * rings + 4 * pairs
    page = Page(tuple(header), tuple(range(2000, 2000 + 2 * rings + 4 * pairs)))
    await controller.write_transfer(0)
    await controller.write_page(page)
    assert await controller.read_page(len(page.payload)) == page
    await controller.write_transfer(1)
    assert there.clean()


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


async def test_requests_of_several_tasks_each_get_their_own_reply(there: Cell, controller: Controller) -> None:
    async def write_and_read(number: int) -> None:
        for turn in range(20):
            await controller.write_service(ServiceBlock(job_id=number, service_heartbeat=turn))
            assert isinstance(await controller.read_link(), LinkBlock)

    async with asyncio.TaskGroup() as group:
        for number in range(8):
            group.create_task(write_and_read(number))
    assert there.clean()


async def test_a_driver_that_was_closed_says_so_and_connects_again(controller: Controller) -> None:
    await controller.close()
    assert not controller.connected
    with pytest.raises(ControllerUnavailable, match="no connection stands"):
        await controller.read_link()
    await controller.connect()
    assert controller.connected
    await controller.read_link()


async def test_a_page_lets_other_requests_between_its_own(there: Cell, controller: Controller) -> None:
    page = Page((1, 0, 1, 1, 1, 1, 0, *(0,) * 24), (5,) * 602)
    await controller.write_transfer(0)
    order: list[str] = []

    async def told(name: str, request: Awaitable[None]) -> None:
        await request
        order.append(name)

    async with asyncio.TaskGroup() as group:
        group.create_task(told("page", controller.write_page(page)))
        group.create_task(told("heartbeat", controller.write_service(ServiceBlock(service_heartbeat=1))))
    assert order == ["heartbeat", "page"]
    assert there.clean()


async def test_a_connection_that_breaks_is_noticed_while_nothing_is_asked(there: Cell, controller: Controller) -> None:
    await there.end()

    async def gone() -> bool:
        return not controller.connected

    await until(gone)
    with pytest.raises(ControllerUnavailable, match=r"closed the connection|the port has gone"):
        await controller.write_transfer(0)


async def test_a_line_that_breaks_fails_the_request_under_way_at_once(there: Cell, controller: Controller) -> None:
    if there.line is None:
        pytest.skip("shown over TCP with a server that misbehaves")
    there.line.towards_far = lambda data: b""
    asking = asyncio.create_task(controller.read_link())
    await asyncio.sleep(0.01)
    await there.end()
    with pytest.raises(ControllerUnavailable, match=r"closed the connection|the port has gone"):
        await asking


async def test_a_register_that_the_controller_does_not_have_is_refused_in_words(
    there: Cell, layout: MailboxLayout
) -> None:
    controller = there.driver(replace(layout, link_address=20000))
    await controller.connect()
    with pytest.raises(ControllerRefused, match=r"FC3 of registers 20000 to 20015 \(420001 to 420016\)") as refusal:
        await controller.read_link()
    assert refusal.value.code == 2
    assert "illegal data address" in str(refusal.value)
    assert controller.connected
    await controller.close()


async def test_nobody_answers_to_another_device_id(there: Cell) -> None:
    if there.way == "modbus-tcp":
        pytest.skip("over TCP a server may answer to any device id")
    controller = there.driver(device_id=2, timeout_s=0.2)
    with pytest.raises(ControllerTimeout, match=r"no reply to FC3 .* device_id"):
        await controller.connect()
    assert not controller.connected


@pytest.mark.parametrize("device_id", [256, -1])
def test_a_device_id_that_none_can_have_is_refused(device_id: int) -> None:
    with pytest.raises(MailboxError, match="expected 0 to 255"):
        ModbusTcpController("127.0.0.1", 502, device_id=device_id)
