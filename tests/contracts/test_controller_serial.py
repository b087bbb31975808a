"""What a serial line asks of the driver: silence between frames, late replies waited out, ports that go and come."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.client import AsyncModbusSerialClient
from pymodbus.exceptions import ModbusIOException

from drivers.controller import (
    Controller,
    ControllerNonsense,
    ControllerTimeout,
    ControllerUnavailable,
    Page,
    ServiceBlock,
)
from drivers.controller.mailbox.blocks import BLOCK_REGISTERS
from drivers.controller.mailbox.page_spans import PAYLOAD_OFFSET, page_starts, spans
from drivers.controller.mailbox.pages import HEADER_REGISTERS
from drivers.controller.modbus.client import ModbusRtuController, ModbusRtuOverTcpController
from drivers.controller.modbus.late_replies import BARRIER_COUNTS, SILENCE_S
from drivers.controller.modbus.requests import LONGEST_READ
from drivers.controller.modbus.serial_line import Rs485, SerialLine
from tests.support.controller.controller_cells import PATIENT_S
from tests.support.controller.line_server import LineServer
from tests.support.controller.pty_line import PtyLine
from tests.support.controller.rtu_frames import frame
from tests.support.controller.serial_server import SerialServer

IMPATIENT_S = 0.3  # waited out; long enough for a busy machine to answer in


@pytest.fixture
async def line() -> AsyncIterator[PtyLine]:
    async with PtyLine() as made:
        yield made


@pytest.fixture
async def server(line: PtyLine) -> AsyncIterator[LineServer]:
    async with LineServer(line.far) as made:
        yield made


WAYS = ["modbus-rtu", "modbus-rtu-over-tcp"]


@contextlib.asynccontextmanager
async def connected(way: str, line: PtyLine, timeout_s: float) -> AsyncIterator[Controller]:
    async with contextlib.AsyncExitStack() as stack:
        made: Controller
        if way == "modbus-rtu":
            made = ModbusRtuController(SerialLine(line.near), timeout_s=timeout_s)
        else:
            gateway = await stack.enter_async_context(SerialServer(line.near))
            made = ModbusRtuOverTcpController("127.0.0.1", gateway.port, timeout_s=timeout_s, baudrate=115_200)
        await made.connect()
        yield made
        await made.close()


@pytest.fixture(params=WAYS)
async def controller(request: pytest.FixtureRequest, line: PtyLine, server: LineServer) -> AsyncIterator[Controller]:
    """A connected driver by either way."""
    async with connected(request.param, line, PATIENT_S) as made:
        yield made


@pytest.fixture(params=WAYS)
async def impatient(request: pytest.FixtureRequest, line: PtyLine, server: LineServer) -> AsyncIterator[Controller]:
    """The same, which waits for replies `IMPATIENT_S`."""
    async with connected(request.param, line, IMPATIENT_S) as made:
        yield made


# --- late replies -----------------------------------------------------------------------------------------------------

SESSION = 13  # register of the link block; the tests count in it


async def ask_the_library(client: AsyncModbusSerialClient) -> int | None:
    try:
        return (await client.read_holding_registers(0, count=16, device_id=1)).registers[SESSION]
    except ModbusIOException:
        return None


async def ask_the_driver(controller: Controller) -> int | None:
    try:
        if not controller.connected:
            await controller.connect()
        return (await controller.read_link()).session
    except ControllerUnavailable:
        return None


async def heard_of(
    server: LineServer, numbers: range, ask: Callable[[], Awaitable[int | None]]
) -> list[tuple[int, int | None]]:
    """What was true when each question was put, and what was heard."""
    heard = []
    for number in numbers:
        server.registers[SESSION] = number
        heard.append((number, await ask()))
    return heard


async def test_the_bare_library_is_one_reply_behind_for_ever_after_a_late_one(
    line: PtyLine, server: LineServer
) -> None:
    client = AsyncModbusSerialClient(line.near, baudrate=115_200, timeout=2 * IMPATIENT_S, retries=0)
    assert await client.connect()
    server.behind = 1  # from now on each reply comes when the next request is out
    heard = await heard_of(server, range(10), lambda: ask_the_library(client))
    client.close()
    assert heard == [(0, None), *((number, number - 1) for number in range(1, 10))]


async def test_the_driver_is_never_a_reply_behind(impatient: Controller, server: LineServer) -> None:
    server.behind = 1
    heard = await heard_of(server, range(1, 4), lambda: ask_the_driver(impatient))
    assert heard == [(1, None), (2, None), (3, None)]
    server.behind = 0
    heard = await heard_of(server, range(4, 8), lambda: ask_the_driver(impatient))
    assert all(answer in (None, true) for true, answer in heard)
    assert heard[-1] == (7, 7)


async def test_replies_that_a_killed_process_left_under_way_are_never_taken(line: PtyLine, server: LineServer) -> None:
    """Three reads of the link block are on their way when this driver opens the line; the true value is 9."""
    for number in (1, 2, 3):
        server.registers[SESSION] = number
        server.delays_s.append(2 * SILENCE_S)
        line.say_to_far(frame(bytes.fromhex("010300000010")))
    await asyncio.sleep(0.01)
    server.registers[SESSION] = 9
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S)
    await controller.connect()
    assert (await controller.read_link()).session == 9
    await controller.close()


async def test_a_late_answer_to_the_check_itself_is_not_taken_for_the_next_ones(
    line: PtyLine, server: LineServer
) -> None:
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=IMPATIENT_S)
    server.behind = 1
    with pytest.raises(ControllerTimeout):
        await controller.connect()
    with pytest.raises(ControllerUnavailable):
        await controller.connect()
    counts = [request[5] for request in server.requests]
    assert len(set(counts)) == len(counts) >= 3
    server.behind = 0
    while not controller.connected:
        with contextlib.suppress(ControllerUnavailable):
            await controller.connect()
    server.registers[SESSION] = 9
    assert (await controller.read_link()).session == 9
    await controller.close()


async def test_a_reply_that_comes_twice_ends_the_connection(controller: Controller, server: LineServer) -> None:
    server.reply = lambda request, right: right * 2
    with pytest.raises(ControllerNonsense, match="number of bytes is 74, expected 37"):
        await controller.read_link()
    assert not controller.connected


async def test_a_cancelled_requests_reply_is_never_taken(controller: Controller, server: LineServer) -> None:
    server.registers[SESSION] = 1
    server.delays_s = [IMPATIENT_S]
    asking = asyncio.create_task(controller.read_link())
    while len(server.requests) < 2:  # the first is the check's
        await asyncio.sleep(0.001)
    asking.cancel()
    with pytest.raises(asyncio.CancelledError):
        await asking
    assert not controller.connected
    server.registers[SESSION] = 2
    while not controller.connected:
        with contextlib.suppress(ControllerUnavailable):
            await controller.connect()
    assert (await controller.read_link()).session == 2


async def test_where_the_contour_block_cannot_be_read_late_replies_are_waited_out(
    line: PtyLine, server: LineServer
) -> None:
    def refuse_the_check(request: bytes, right: bytes) -> bytes:
        return right if request[3] != 32 else frame(bytes([1, 0x83, 2]))

    server.reply = refuse_the_check
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=8 * SILENCE_S)
    connecting = asyncio.create_task(controller.connect())
    while not server.requests:
        await asyncio.sleep(0.001)
    await asyncio.sleep(0.01)
    server.say(frame(bytes([1, 3, 32, *bytes(32)])))  # late, to a read of the link block
    await connecting
    server.registers[SESSION] = 5
    assert (await controller.read_link()).session == 5
    await controller.close()


@given(rings=st.integers(1, 300), pairs=st.integers(0, 490), page=st.integers(1, 2))
def test_the_check_reads_a_number_of_registers_that_nothing_else_reads(rings: int, pairs: int, page: int) -> None:
    header = [0] * 31
    header[3], header[5] = page, rings
    length = (2 * rings if page == 1 else 0) + 4 * pairs
    starts = [start for start in page_starts(header, length) if start >= PAYLOAD_OFFSET]
    read = {count for _, count in spans(starts, LONGEST_READ)} if starts[1:] else set()
    assert not (read | {BLOCK_REGISTERS, HEADER_REGISTERS}) & set(BARRIER_COUNTS)


# --- noise ------------------------------------------------------------------------------------------------------------


async def test_another_devices_reply_is_nonsense(controller: Controller, server: LineServer) -> None:
    server.reply = lambda request, right: frame(b"\2" + right[1:-2])
    with pytest.raises(ControllerNonsense, match="device id is 2, expected 1"):
        await controller.read_link()
    assert not controller.connected


async def test_a_reply_shorter_than_asked_for_is_nonsense_and_not_waited_with(
    line: PtyLine, server: LineServer
) -> None:
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S)
    await controller.connect()
    server.reply = lambda request, right: frame(bytes([1, 3, 30, *bytes(30)]))
    with pytest.raises(ControllerNonsense, match="byte count is 30, expected 32"):
        await controller.read_link()


async def test_a_garbled_reply_is_nonsense_and_the_next_connection_works(
    controller: Controller, server: LineServer, line: PtyLine
) -> None:
    line.towards_near = lambda data: data[:-3] + bytes([data[-3] ^ 0x10]) + data[-2:]
    with pytest.raises(ControllerNonsense, match=r"CRC is \w{4}, its bytes give \w{4}.*termination"):
        await controller.read_link()
    line.towards_near = lambda data: data
    await controller.connect()
    await controller.read_link()


async def test_noise_while_nothing_is_asked_ends_the_connection(controller: Controller, server: LineServer) -> None:
    server.say(b"\0")
    while controller.connected:
        await asyncio.sleep(0.001)
    with pytest.raises(ControllerNonsense, match="1 bytes came though no request was pending"):
        await controller.read_link()
    await controller.connect()
    await controller.read_link()


async def test_noise_while_the_line_is_opened_is_waited_out(line: PtyLine, server: LineServer) -> None:
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S)
    connecting = asyncio.create_task(controller.connect())
    for _ in range(5):
        await asyncio.sleep(SILENCE_S / 5)
        server.say(b"\xff\0noise")
    await connecting
    await controller.read_link()
    await controller.close()


async def test_a_line_that_is_never_silent_is_unavailable(line: PtyLine, server: LineServer) -> None:
    async def talk() -> None:
        while True:
            server.say(b"noise")
            await asyncio.sleep(SILENCE_S / 10)

    talking = asyncio.create_task(talk())
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=IMPATIENT_S)
    with pytest.raises(ControllerUnavailable, match=r"talks all the time, expected 0.05 s of silence within 0.35 s"):
        await controller.connect()
    talking.cancel()
    await asyncio.wait([talking])


# --- the line's pace --------------------------------------------------------------------------------------------------


async def test_a_request_goes_out_after_three_and_a_half_characters_of_silence(
    line: PtyLine, server: LineServer
) -> None:
    loop = asyncio.get_running_loop()
    settings = SerialLine(line.near, baudrate=1200, parity="E")
    heard: list[float] = []
    gaps: list[float] = []

    def reply_passes(data: bytes) -> bytes:
        heard.append(loop.time())
        return data

    def request_passes(data: bytes) -> bytes:
        gaps.extend(loop.time() - at for at in heard[-1:])
        return data

    line.towards_near, line.towards_far = reply_passes, request_passes
    controller = ModbusRtuController(settings, timeout_s=PATIENT_S)
    await controller.connect()
    await controller.write_transfer(0)
    await controller.write_page(Page((1, 0, 1, 1, 1, 1, 0, *(0,) * 24), (5,) * 402))
    await controller.close()
    assert len(gaps) > 5
    assert settings.silence_s == pytest.approx(3.5 * 11 / 1200)
    assert min(gaps) >= settings.silence_s


@pytest.mark.parametrize(
    ("settings", "silence_s"),
    [
        (SerialLine("", 9600, "N", 1), 3.5 * 10 / 9600),
        (SerialLine("", 9600, "E", 1), 3.5 * 11 / 9600),
        (SerialLine("", 19_200, "N", 2), 3.5 * 11 / 19_200),
        (SerialLine("", 38_400), 0.00175),
        (SerialLine("", 115_200), 0.00175),
    ],
)
def test_the_silence_is_the_standards(settings: SerialLine, silence_s: float) -> None:
    assert settings.silence_s == pytest.approx(silence_s)


async def test_the_time_a_frame_is_on_the_line_is_no_part_of_the_time_out(line: PtyLine, server: LineServer) -> None:
    """At 300 baud the first request of a page is on the line for more than two seconds."""
    controller = ModbusRtuController(SerialLine(line.near, baudrate=300), timeout_s=1.0)
    await controller.connect()
    server.delays_s = [1.8]
    await controller.write_page(Page((1, 0, 1, 1, 1, 1, 0, *(0,) * 24), (5,) * 82))
    await controller.close()


async def test_what_comes_back_of_our_own_is_taken_off_where_the_line_echoes(line: PtyLine, server: LineServer) -> None:
    def echo(data: bytes) -> bytes:
        line.say_to_near(data)
        return data

    line.towards_far = echo
    controller = ModbusRtuController(SerialLine(line.near, echo=True), timeout_s=PATIENT_S)
    await controller.connect()
    block = ServiceBlock(job_id=7)
    await controller.write_service(block)
    assert await controller.read_service() == block

    def collide(data: bytes) -> bytes:
        line.say_to_near(data[:3] + b"\0" + data[4:])
        return data

    line.towards_far = collide
    with pytest.raises(ControllerNonsense, match="two talked at once"):
        await controller.read_service()
    await controller.close()


async def test_a_line_that_echoes_unexpectedly_is_told_as_such(line: PtyLine, server: LineServer) -> None:
    def echo(data: bytes) -> bytes:
        line.say_to_near(data)
        return data

    line.towards_far = echo
    with pytest.raises(ControllerNonsense, match="It is what was sent: the line echoes it"):
        await ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S).connect()


async def test_noise_behind_the_reply_to_a_write_which_repeats_it_is_no_echo(line: PtyLine, server: LineServer) -> None:
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S)
    await controller.connect()
    line.towards_near = lambda data: data + b"\0"
    with pytest.raises(ControllerNonsense, match="Check baud rate, parity, termination"):
        await controller.write_transfer(5)
    await controller.close()


async def test_a_line_that_does_not_echo_as_it_was_said_to_is_told_as_such(line: PtyLine, server: LineServer) -> None:
    with pytest.raises(ControllerNonsense, match="the line does not echo: then take out echo"):
        await ModbusRtuController(SerialLine(line.near, echo=True), timeout_s=PATIENT_S).connect()


# --- ports ------------------------------------------------------------------------------------------------------------


async def test_a_port_that_is_none_is_unavailable_and_the_reason_is_told(tmp_path: Path) -> None:
    for port, reason in (
        ("/dev/no-such-port", "there is no such port"),
        ("/dev/null", "no serial port"),
        (str(tmp_path), "Is a directory"),
    ):
        controller = ModbusRtuController(SerialLine(port))
        with pytest.raises(ControllerUnavailable, match=f"{port}: cannot be opened at 115200 baud N 1 .*{reason}"):
            await controller.connect()
        assert not controller.connected


async def test_a_port_in_use_is_unavailable_until_it_is_let_go(line: PtyLine, server: LineServer) -> None:
    holder = ModbusRtuController(SerialLine(line.near))
    await holder.connect()
    controller = ModbusRtuController(SerialLine(line.near))
    with pytest.raises(ControllerUnavailable, match="in use by another program"):
        await controller.connect()
    await holder.close()
    await controller.connect()
    await controller.read_link()
    await controller.close()


async def test_a_port_that_vanishes_and_comes_back_is_one_connect_away(tmp_path: Path) -> None:
    port = tmp_path / "ttyUSB0"
    controller = ModbusRtuController(SerialLine(str(port)), timeout_s=PATIENT_S)
    for _ in range(2):
        async with PtyLine() as line, LineServer(line.far):
            port.symlink_to(line.near)
            await controller.connect()
            await controller.read_link()
            port.unlink()
            line.unplug_near()
            while controller.connected:
                await asyncio.sleep(0.001)
            with pytest.raises(
                ControllerUnavailable, match=r"the port has gone .*Check that the adapter is plugged in"
            ):
                await controller.read_link()
            with pytest.raises(ControllerUnavailable, match="there is no such port"):
                await controller.connect()
    await controller.close()


async def test_a_port_that_cannot_switch_rs485_says_so(line: PtyLine) -> None:
    controller = ModbusRtuController(SerialLine(line.near, rs485=Rs485()))
    with pytest.raises(ControllerUnavailable, match="Take out rs485 where the adapter switches by itself"):
        await controller.connect()


async def test_closing_while_the_line_is_checked_leaves_no_connection(line: PtyLine, server: LineServer) -> None:
    controller = ModbusRtuController(SerialLine(line.near), timeout_s=PATIENT_S)
    connecting = asyncio.create_task(controller.connect())
    await asyncio.sleep(SILENCE_S / 5)
    await controller.close()
    with pytest.raises(ControllerUnavailable, match="closed by this side"):
        await connecting
    assert not controller.connected
