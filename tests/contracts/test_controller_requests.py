"""What a driver's requests over TCP carry: lengths, transaction numbers and unit numbers."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from drivers.controller import ControllerNonsense, MailboxError, Page
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.modbus.requests import RequestLimits
from tests.support.controller.controller_cells import PATIENT_S
from tests.support.controller.misbehaving_server import MisbehavingServer, right_reply


@pytest.fixture
async def server() -> AsyncIterator[MisbehavingServer]:
    async with MisbehavingServer() as misbehaving:
        yield misbehaving


async def test_no_request_is_longer_than_the_controller_takes(server: MisbehavingServer) -> None:
    limits = RequestLimits(write=50, read=33)
    controller = ModbusTcpController("127.0.0.1", server.port, timeout_s=PATIENT_S, limits=limits)
    await controller.connect()
    await controller.write_page(Page((1, 0, 1, 1, 1, 1, 0, *(0,) * 24), (5,) * 402))
    await controller.read_page(402)
    await controller.close()
    counts = [(request[7], int.from_bytes(request[10:12], "big")) for request in server.requests]
    assert sum(count for function_code, count in counts if function_code == 16) == 31 + 402
    assert sum(count for function_code, count in counts if function_code == 3) == 32 + 402, "transfer is read too"
    assert all(count <= {16: 50, 3: 33}[function_code] for function_code, count in counts)


@pytest.mark.parametrize("limits", [{"write": 15}, {"read": 15}, {"write": 124}, {"read": 126}])
def test_limits_that_no_controller_can_have_are_refused(limits: dict[str, int]) -> None:
    with pytest.raises(MailboxError, match="expected 16 to 12"):
        RequestLimits(**limits)


async def test_each_connection_begins_with_another_transaction(server: MisbehavingServer) -> None:
    controller = ModbusTcpController("127.0.0.1", server.port, timeout_s=PATIENT_S)
    for _ in range(8):
        await controller.connect()
        await controller.read_link()
    await controller.close()
    assert len({request[:2] for request in server.requests}) >= 7, "of 65,535 numbers eight drawn at random"


@pytest.mark.parametrize(("asked", "answers"), [(0, 255), (255, 0), (0, 0), (255, 255)])
async def test_the_device_itself_may_answer_as_0_or_255(server: MisbehavingServer, asked: int, answers: int) -> None:
    server.reply_with(lambda request: right_reply(request[:6] + bytes([answers]) + request[7:]))
    controller = ModbusTcpController("127.0.0.1", server.port, device_id=asked, timeout_s=PATIENT_S)
    await controller.connect()
    assert (await controller.read_link()).session == 0
    await controller.close()
    assert {request[6] for request in server.requests} == {asked}


@pytest.mark.parametrize(("asked", "answers"), [(1, 255), (1, 0), (0, 1), (255, 7)])
async def test_a_unit_that_answers_as_another_is_told_with_what_to_set(
    server: MisbehavingServer, asked: int, answers: int
) -> None:
    server.reply_with(lambda request: right_reply(request[:6] + bytes([answers]) + request[7:]))
    controller = ModbusTcpController("127.0.0.1", server.port, device_id=asked, timeout_s=PATIENT_S)
    await controller.connect()
    with pytest.raises(ControllerNonsense, match=f"set device_id: {answers}") as fault:
        await controller.read_link()
    await controller.close()
    assert fault.value.answered_as == answers
