"""The simulated controller as a program on a real socket, spoken to in raw frames."""

from __future__ import annotations

import asyncio
import socket
import struct
from pathlib import Path

import pytest

from drivers.controller import ControllerError, ControllerUnavailable
from drivers.controller.mailbox.blocks import ServiceBlock, encode_service
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.raw_client import SESSION, Client, page, simulated

# --- its life ---------------------------------------------------------------------------------------------------------


async def test_a_stopped_controller_frees_its_port_at_once_even_with_clients_on_it() -> None:
    controller = simulated()
    await controller.start()
    port = controller.port
    async with Client(port) as client:
        await client.read(0, 16)
        await controller.stop()
        assert await client.reader.read() == b""
    again = simulated(port=port)
    await again.start()
    await again.stop()
    await again.stop()


async def test_it_starts_again_after_a_stop_and_not_twice_at_once() -> None:
    controller = simulated()
    async with controller:
        with pytest.raises(ControllerError, match="runs already"):
            await controller.start()
    with pytest.raises(ControllerError, match="does not listen"):
        _ = controller.port
    async with controller, Client(controller.port) as client:
        await client.until_started()


async def test_a_port_that_is_taken_is_an_error_that_names_it() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ControllerUnavailable, match=f"127.0.0.1:{port}"):
            await simulated(port=port).start()


async def test_a_restarted_program_begins_a_new_session_with_empty_registers() -> None:
    async with SimulatedController(scan_s=0.001) as controller, Client(controller.port) as client:
        await client.until_started()
        (session,) = await client.read(13, 1)
        await client.write_one(32, 0)
        await client.write(33, *page().header)
        controller.restart()
        await client.until_started()
        assert (await client.read(13, 1))[0] not in (0, session)
        assert set(await client.read(33, 31)) == {0}


async def test_registers_that_outlive_a_restart_hold_a_page_that_is_outdated() -> None:
    sessions = iter([SESSION, SESSION + 1])
    async with simulated(session_source=lambda: next(sessions)) as controller, Client(controller.port) as client:
        await client.until_started()
        await client.write_page(page(), 1)
        controller.restart(keep_registers=True, forget=True)
        await client.until_started(no_longer=SESSION)
        await client.until_answered(1)
        assert await client.read(7, 1) == (8,)


async def test_a_halted_program_beats_no_more_until_it_is_restarted() -> None:
    async with simulated() as controller, Client(controller.port) as client:
        await client.until_started()
        controller.halt()
        before = await client.read(1, 1)
        await asyncio.sleep(0.01)
        assert await client.read(1, 1) == before
        assert not controller.can_request
        controller.restart()
        await client.until_started()


# --- what it hands on -------------------------------------------------------------------------------------------------


async def test_an_accepted_contour_is_handed_on_once_and_counted() -> None:
    taken: list[AcceptedContour] = []
    async with simulated(on_accepted=taken.append) as controller, Client(controller.port) as client:
        await client.until_started()
        await client.write_page(page(), 1)
        await client.write_page(page(), 2)
    assert [contour.as_json() for contour in taken] == [
        {
            "job_id": 1,
            "recipe": 1,
            "flags": 5,
            "millimetres": {"exterior": [[0, 0], [100, 0], [100, 100], [0, 100]], "holes": []},
            "area_mm2": 10_000,
            "uncertainty_mm": None,
        }
    ]
    assert controller.verdict.clean, controller.verdict
    assert controller.verdict.as_json()["answers"] == {"1": 1, "6": 1}


async def test_a_controller_that_ended_before_it_handed_on_does_so_at_its_next_start(tmp_path: Path) -> None:
    def fail(contour: AcceptedContour) -> None:
        raise OSError("disk full")

    memory = tmp_path / "memory.json"
    controller = simulated(memory_path=memory, on_accepted=fail)
    await controller.start()
    async with Client(controller.port) as client:
        await client.until_started()
        await client.write_page(page(), 1)
        with pytest.raises(OSError, match="disk full"):
            await controller.wait()
    with pytest.raises(OSError, match="disk full"):
        await controller.stop()

    taken: list[AcceptedContour] = []
    async with (
        simulated(memory_path=memory, on_accepted=taken.append, session_source=None) as again,
        Client(again.port) as client,
    ):
        await client.until_started()
        assert await client.read(10, 3) == (0, 1, 1)
    assert [contour.job_id for contour in taken] == [1]
    async with simulated(memory_path=memory, on_accepted=taken.append):
        pass
    assert len(taken) == 1


async def test_a_judge_can_refuse_for_the_operator_and_be_exchanged_while_it_runs() -> None:
    async with simulated(judge=lambda contour: 7) as controller, Client(controller.port) as client:
        await client.until_started()
        await client.write_page(page(), 1)
        assert await client.read(7, 1) == (7,)
        controller.judge = lambda contour: 1
        await client.write_page(page(job_id=2), 2)
        assert await client.read(7, 1) == (1,)


async def test_a_request_for_a_measurement_stands_in_the_registers() -> None:
    async with simulated() as controller, Client(controller.port) as client:
        await client.until_started()
        await client.write(16, *encode_service(ServiceBlock(service_state=5), "big"))
        async with asyncio.timeout(60):
            while not controller.can_request:
                await asyncio.sleep(0.001)
        assert controller.request_measurement(recipe=3, thickness_um=70_000) == 1
        assert await client.read(2, 4) == (1, 3, 1, 4464)
        assert controller.trigger_open


# --- what it does not serve -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pdu", "code", "kind"),
    [
        (bytes([1, 0, 0, 0, 1]), 1, "function-code"),
        (bytes([4, 0, 0, 0, 1]), 1, "function-code"),
        (bytes([5, 0, 0, 0xFF, 0]), 1, "function-code"),
        (bytes([23, 0, 0, 0, 1, 0, 16, 0, 1, 2, 0, 0]), 1, "function-code"),
        (struct.pack(">BHHB", 16, 33, 124, 248) + bytes(248), 3, "request-too-long"),
        (struct.pack(">BHHBH", 16, 0, 1, 2, 0), 2, "outside-blocks"),
        (struct.pack(">BHH", 6, 5000, 0), 2, "outside-blocks"),
        (struct.pack(">BHHB2H", 16, 31, 2, 4, 0, 0), 2, "outside-blocks"),
        (struct.pack(">BHH", 3, 2040, 9), 2, None),
        (struct.pack(">BHH", 3, 65535, 1), 2, None),
    ],
)
async def test_what_the_protocol_does_not_use_is_answered_with_an_exception_and_noted(
    pdu: bytes, code: int, kind: str | None
) -> None:
    async with simulated() as controller, Client(controller.port) as client:
        assert await client.ask(pdu) == bytes([pdu[0] | 0x80, code])
        assert dict(controller.verdict.counts) == ({kind: 1} if kind else {})


async def test_another_device_id_is_answered_as_a_gateway_does() -> None:
    async with simulated() as controller, Client(controller.port) as client:
        assert await client.ask(struct.pack(">BHH", 3, 0, 16), unit=2) == bytes([0x83, 11])


async def test_stopping_while_a_connection_is_being_closed_is_no_error_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with SimulatedController() as controller:
        closing = await asyncio.open_connection("127.0.0.1", controller.port)
        open_still = await asyncio.open_connection("127.0.0.1", controller.port)
        await asyncio.sleep(0.02)
        closing[1].close()
        await asyncio.sleep(0)
    assert await open_still[0].read() == b""
    await asyncio.sleep(0.01)
    open_still[1].close()
    assert caplog.text == ""
