"""Probing a controller: what is seen of it, what is to be changed, and what is left as it was."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from drivers.controller import ControllerUnavailable, ServiceBlock
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.modbus.client import ModbusController, ModbusRtuController, ModbusTcpController
from drivers.controller.modbus.requests import read_registers, registers_of, stream_of, write_register, write_registers
from drivers.controller.modbus.serial_line import SerialLine
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.faults import FaultPlan, LineFault, Target
from drivers.controller.simulated.program import Pace
from drivers.controller.simulated.window import ServerLimits
from service.check_result import CheckResult
from service.daemon.restart_watch import RestartWatch
from service.probing.probe import Probe
from service.probing.probed import LOOK_PERIOD_S
from tests.support.controller.misbehaving_server import MisbehavingServer, exception_reply, right_reply
from tests.support.controller.pty_line import PtyLine
from tests.support.interop.programs import libmodbus_tcp
from tests.support.interop.shifted_program import program

FASTER = 8


async def probed(port: int, layout: MailboxLayout | None = None, *, write: bool = True) -> tuple[dict[str, Any], Probe]:
    """What the probe said, by part, and the probe; its waits are `FASTER` times shorter."""
    return await probed_by(ModbusTcpController("127.0.0.1", port, layout=layout, timeout_s=5), write=write)


async def probed_by(controller: ModbusController, *, write: bool) -> tuple[dict[str, Any], Probe]:
    probe = Probe(
        controller, 5, sleep=lambda pause_s: asyncio.sleep(pause_s / FASTER), now=lambda: FASTER * time.monotonic()
    )
    findings: dict[str, CheckResult] = {}
    try:
        async for finding in probe.results(write=write):
            findings[finding.part] = finding
    finally:
        await controller.close()
    return findings, probe


@pytest.fixture
async def client() -> AsyncIterator[ModbusTcpController]:
    """A second client of a libmodbus server with all registers of the default layout and more."""
    with libmodbus_tcp() as (_, port):
        made = ModbusTcpController("127.0.0.1", port, timeout_s=30)
        await made.connect()
        yield made
        await made.close()


def port_of(client: ModbusTcpController) -> int:
    return int(str(client).split(":")[1].split()[0])


async def held(client: ModbusTcpController, address: int, count: int) -> list[int]:
    registers: list[int] = []
    while len(registers) < count:
        (reply,) = await client.run([read_registers(address + len(registers), min(125, count - len(registers)))])
        registers += registers_of(reply)
    return registers


async def put(client: ModbusTcpController, address: int, registers: list[int]) -> None:
    for start in range(0, len(registers), 123):
        await client.run([write_registers(address + start, stream_of(registers[start : start + 123]))])


async def test_the_simulated_controller_is_as_it_should_be() -> None:
    async with SimulatedController(scan_s=0.001) as simulated:
        findings, probe = await probed(simulated.port)
    assert {part: finding.text for part, finding in findings.items() if not finding.well} == {}
    assert probe.changes == {}
    assert {"round trip", "longest read", "longest write", "writable", "test_echo", "heartbeat"} <= set(findings)
    restored = "service-block-content"  # all zero, as it was before
    assert set(simulated.verdict.counts) <= {"heartbeat-stalled", restored}, simulated.verdict


async def test_over_a_serial_line_it_is_the_same() -> None:
    async with PtyLine() as line, SimulatedController.on_serial(line.far, scan_s=0.001):
        findings, probe = await probed_by(ModbusRtuController(SerialLine(line.near), timeout_s=5), write=True)
    assert {part: finding.text for part, finding in findings.items() if not finding.well} == {}
    assert probe.changes == {}
    assert {"longest write", "writable", "test_echo"} <= set(findings)


@pytest.mark.parametrize("shift", [0, 1, -1])
@pytest.mark.parametrize("order", ["big", "little"])
@pytest.mark.parametrize("write", [True, False])
async def test_another_numbering_and_another_order_of_words_are_told(
    client: ModbusTcpController, shift: int, order: str, write: bool
) -> None:
    """The mailbox is configured at 100; the program counts otherwise."""
    layout = MailboxLayout(100, 116, 132)
    async with program(port_of(client), 100 + shift, order):
        findings, probe = await probed(port_of(client), layout, write=write)
    changes = {"link_address": 100 + shift, "service_address": 116 + shift, "contour_address": 132 + shift}
    expected: dict[str, object] = dict(changes) if shift else {}
    if order == "little":
        expected["word_order"] = "little"
    assert probe.changes == expected
    parts = ("heartbeat", "test_echo") if write and not shift else ("heartbeat",)
    assert [findings[part].well for part in parts] == [not expected] * len(parts)
    if shift:
        assert "test_echo" not in findings
        assert write == ("writing" in findings)


async def test_a_part_block_is_read_and_numbered_along(client: ModbusTcpController) -> None:
    layout = MailboxLayout(100, 116, 132, part_address=3000, part_capacity=24)
    async with program(port_of(client), 101):
        findings, probe = await probed(port_of(client), layout, write=False)
    assert findings["part block"].well
    assert probe.changes["part_block"] == {"address": 3001, "capacity": 24}


async def test_a_part_block_that_is_not_there_is_told() -> None:
    with libmodbus_tcp(2100) as (_, port):
        findings, _ = await probed(port, MailboxLayout(part_address=2048, part_capacity=100), write=False)
    assert "Set part_block.address" in findings["part block"].text


async def test_a_numbering_below_0_is_told_in_words(client: ModbusTcpController) -> None:
    async with program(port_of(client), 0):
        findings, probe = await probed(port_of(client), MailboxLayout(1, 17, 33), write=False)
    assert probe.changes == {"link_address": 0, "service_address": 16, "contour_address": 32}
    assert "one register lower than configured: the controller counts registers from 0" in findings["heartbeat"].text


async def test_registers_that_are_missing_shorten_the_payload() -> None:
    with libmodbus_tcp(1001) as (_, port):
        findings, probe = await probed(port)
    assert probe.changes == {"payload_capacity": 1001 - 64 - 1}
    assert "up to register 1000 (401001), not all of it" in findings["readable"].text
    assert not findings["writable"].well


async def test_a_contour_block_that_is_not_there_is_told() -> None:
    with libmodbus_tcp(40) as (_, port):
        findings, probe = await probed(port)
    assert "Set contour_address" in findings["readable"].text
    assert "not tried" in findings["writing"].text
    assert "payload_capacity" not in probe.changes


@pytest.mark.parametrize("shift", [0, 1, -1])
@pytest.mark.parametrize("order", ["big", "little"])
async def test_a_program_whose_heartbeat_stands_still_is_told_by_test_echo(
    client: ModbusTcpController, shift: int, order: str
) -> None:
    layout = MailboxLayout(100, 116, 132)
    async with program(port_of(client), 100 + shift, order, alive=False):
        findings, probe = await probed(port_of(client), layout)
    assert not findings["heartbeat"].well
    assert findings["test_echo"].well == (shift == 0 and order == "big")
    assert probe.changes.get("link_address", 100) == 100 + shift
    assert probe.changes.get("word_order", "big") == order
    assert ("writable" in findings) == (shift == 0)


async def test_what_stood_there_is_put_back_and_nothing_else_is_touched(client: ModbusTcpController) -> None:
    layout = MailboxLayout(3000, 100, 500, payload_capacity=600)
    before = [(address * 7 + 1) & 0xFFFF for address in range(4000)]
    before[3013] = 0  # no session: no page can be under way
    before[111] = 0  # no owner
    await put(client, 0, before)
    await probed(port_of(client), layout)
    before[500] = 0  # transfer
    before[114:116] = [before[114], before[115]]
    assert await held(client, 0, 4000) == before


async def test_nothing_is_written_without_being_told_to(client: ModbusTcpController) -> None:
    before = [(address * 7 + 1) & 0xFFFF for address in range(2048)]
    await put(client, 0, before)
    findings, _ = await probed(port_of(client), write=False)
    assert await held(client, 0, 2048) == before
    assert "writable" not in findings


async def test_nothing_is_written_while_another_service_is_alive(client: ModbusTcpController) -> None:
    async def beat() -> None:
        for number in range(10_000):
            await client.write_service(ServiceBlock(owner=77, service_heartbeat=number))
            await asyncio.sleep(0.02)

    beating = asyncio.create_task(beat())
    findings, _ = await probed(port_of(client))
    beating.cancel()
    await asyncio.wait([beating])
    assert findings["writing"].text == "not tried: a service (owner 77) is alive on this controller. Stop it first"
    await client.connect()
    assert await held(client, 32, 100) == [0] * 100


async def test_nothing_is_written_while_a_page_waits_for_its_answer(client: ModbusTcpController) -> None:
    await put(client, 0, [1, 1, 0, 0, 0, 0, 4, 1, 0, 0, 0, 0, 0, 9, 0, 0])
    await client.run([write_register(32, 5)])
    findings, _ = await probed(port_of(client))
    assert "page 5 is committed and not answered yet" in findings["writing"].text
    assert await held(client, 32, 1) == [5]


async def test_a_dead_services_block_does_not_hinder(client: ModbusTcpController) -> None:
    await client.write_service(ServiceBlock(owner=77, service_heartbeat=5))
    findings, _ = await probed(port_of(client))
    assert findings["writable"].well


@pytest.mark.parametrize("longest", [100, 40, 20, 16])
async def test_shorter_requests_than_the_standards_are_found(longest: int) -> None:
    async with MisbehavingServer() as server:
        right = server.behave

        async def short(request: bytes, writer: asyncio.StreamWriter) -> None:
            count = int.from_bytes(request[10:12], "big")
            if request[7] in (3, 16) and count > longest:
                writer.write(exception_reply(request, 3))
            else:
                await right(request, writer)

        server.behave = short
        findings, probe = await probed(server.port, write=False)
    assert probe.changes == {"longest_read": longest}
    assert f"{longest} registers in one request, the standard's limit is 125" in findings["longest read"].text


@pytest.mark.parametrize(
    ("reply", "said"),
    [
        (lambda _request: b"SSH-2.0-OpenSSH_9.2\r\n", "the reply's protocol identifier is"),
        (lambda request: exception_reply(request, 1), "must know function codes 3, 6 and 16"),
        (lambda request: exception_reply(request, 3), "limit of registers in one request, which must be 16 or more"),
        (lambda request: exception_reply(request, 6), "server device busy"),
    ],
)
async def test_one_that_answers_nothing_rightly_is_told_what_it_answers_and_no_address_is_blamed(
    reply: Callable[[bytes], bytes], said: str
) -> None:
    findings: list[CheckResult] = []

    async def look(probe: Probe) -> None:
        async for finding in probe.results(write=True):
            findings.append(finding)

    async with MisbehavingServer() as server:
        server.reply_with(reply)
        probe = Probe(ModbusTcpController("127.0.0.1", server.port, timeout_s=5), 5)
        with pytest.raises(ControllerUnavailable, match="answers nothing as it should"):
            await look(probe)
        await probe.controller.close()
        assert len(server.requests) == 2
    assert [finding.part for finding in findings] == ["connection", "link block", "service block"]
    assert all(said in finding.text for finding in findings[1:])
    assert not any(wrong in finding.text for finding in findings for wrong in ("_address", "echo"))


@pytest.mark.parametrize(
    ("block", "said"), [("service", "the service block cannot"), ("clear", "the contour block cannot")]
)
async def test_a_block_that_cannot_be_written_is_told_with_the_controllers_word(block: Target, said: str) -> None:
    faults = FaultPlan([LineFault("exception", block, every=1)])
    async with SimulatedController(scan_s=0.001, faults=faults) as simulated:
        findings, probe = await probed(simulated.port)
    assert findings["writing"].text.startswith(f"{said} be written: ")
    assert "exception 4" in findings["writing"].text
    assert "put back" not in findings
    assert probe.changes == {}


async def test_writes_that_are_confirmed_and_not_done_are_told() -> None:
    async with MisbehavingServer() as server:
        findings, _ = await probed(server.port)
    assert "test_value reads back as 0x00000000, written was 0x01020304" in findings["test_echo"].text
    assert "Nothing written reads back" in findings["writable"].text


async def test_a_heartbeat_of_one_bit_in_step_with_the_looks_is_seen_to_move() -> None:
    def in_step(request: bytes) -> bytes | None:
        if request[7] != 3:
            return None
        first, count = int.from_bytes(request[8:10], "big"), int.from_bytes(request[10:12], "big")
        scans = int(2 * FASTER * time.monotonic() / LOOK_PERIOD_S)
        registers = [scans % 2 if address == 1 else 0 for address in range(first, first + count)]
        return (
            request[:4] + (3 + 2 * count).to_bytes(2, "big") + bytes((request[6], 3, 2 * count)) + stream_of(registers)
        )

    async with MisbehavingServer() as server:
        server.reply_with(lambda request: in_step(request) or right_reply(request))
        findings, _ = await probed(server.port, write=False)
    assert findings["heartbeat"].well, findings["heartbeat"].text


@pytest.mark.parametrize(("shift", "order"), [(100, "big"), (-90, "little"), (4096, "little")])
async def test_a_mailbox_far_from_where_it_should_be_is_found(
    client: ModbusTcpController, shift: int, order: str
) -> None:
    layout = MailboxLayout(100, 116, 132)
    async with program(port_of(client), 100 + shift, order):
        findings, probe = await probed(port_of(client), layout)
    moved = {"link_address": 100 + shift, "service_address": 116 + shift, "contour_address": 132 + shift}
    assert probe.changes == moved | ({"word_order": "little"} if order == "little" else {})
    assert f"{abs(shift)} registers {'higher' if shift > 0 else 'lower'} than" in findings["heartbeat"].text
    assert "probe again" in findings["all else"].text


async def test_a_mailbox_elsewhere_is_found_where_most_registers_are_not_there() -> None:
    """And where a request beyond the blocks is refused, as a PLC's is that maps no more than they need."""
    layout = MailboxLayout(3_001, 3_017, 3_033, 100)
    async with SimulatedController(scan_s=0.001, layout=layout) as simulated:
        _, probe = await probed(simulated.port)
    assert probe.changes == {"link_address": 3_001, "service_address": 3_017, "contour_address": 3_033}


@pytest.mark.parametrize("device_id", [255, 0, 1])
async def test_a_unit_that_answers_as_another_is_asked_by_that_and_probed_on(device_id: int) -> None:
    limits = ServerLimits(answer_as=device_id)
    async with SimulatedController(scan_s=0.001, limits=limits) as simulated:
        findings, probe = await probed_by(
            ModbusTcpController("127.0.0.1", simulated.port, device_id=9, timeout_s=5), write=True
        )
    assert probe.changes == {"device_id": device_id}
    assert not findings["device id"].well
    assert findings["test_echo"].well


async def test_a_unit_that_only_another_number_reaches_is_found() -> None:
    async with SimulatedController(scan_s=0.001, device_id=255) as simulated:
        findings, probe = await probed(simulated.port)
    assert probe.changes == {"device_id": 255}
    assert findings["writable"].well


async def test_a_controller_of_short_requests_and_without_fc6_is_told_by_keys_that_suit_it() -> None:
    limits = ServerLimits(16, write_single=False)
    async with SimulatedController(scan_s=0.001, limits=limits) as simulated:
        findings, probe = await probed(simulated.port)
    assert probe.changes == {"longest_read": 16, "single_write": "fc16", "longest_write": 16}
    assert findings["writable"].well
    assert "put back" not in findings


async def test_the_same_is_told_of_a_server_that_others_wrote(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("MOST_REGISTERS", "20"), ("WITHOUT_FC6", "1"), ("ANSWER_AS", "255")):
        monkeypatch.setenv(name, value)
    with libmodbus_tcp() as (_, port):
        serving = ModbusTcpController("127.0.0.1", port, 255, timeout_s=30)
        async with program(port, through=serving):
            _, probe = await probed(port)
    assert probe.changes == {"device_id": 255, "longest_read": 20, "single_write": "fc16", "longest_write": 20}


@pytest.mark.parametrize("torn", [True, False])
async def test_values_that_stand_half_written_are_seen(torn: bool) -> None:
    async with SimulatedController(scan_s=0.02, pace=Pace(torn=torn)) as simulated:
        findings, probe = await probed(simulated.port)
    said = "they stand half written for up to" if torn else "none was seen half written"
    assert said in findings["32-bit values"].text
    assert findings["32-bit values"].well, "its heartbeat waits for them"
    assert probe.changes == {}


@pytest.mark.parametrize("changes", [True, False])
async def test_a_session_that_a_restart_does_not_change_is_told(changes: bool) -> None:
    sessions = iter([7, 8] if changes else [7, 7])
    async with SimulatedController(scan_s=0.005, session_source=lambda: next(sessions)) as simulated:
        controller = ModbusTcpController("127.0.0.1", simulated.port, timeout_s=5)
        watch = RestartWatch(controller)
        async with asyncio.timeout(60):
            while not simulated.registers(13, 1)[0]:
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.3)
            assert await watch.begin() == 7
            ending = asyncio.create_task(watch.end())
            await asyncio.sleep(0.2)
            assert not ending.done()
            await simulated.switch_off()
            await asyncio.sleep(0.2)
            await simulated.switch_on()
            well, text = await ending
        await controller.close()
    assert well == changes
    assert ("8 after the restart, 7 before" if changes else "still 7 after the restart") in text
