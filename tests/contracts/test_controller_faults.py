"""What every driver of the Controller role promises where there is no controller, or a bad one."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest

from drivers.controller import (
    ControllerError,
    ControllerNonsense,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
    MailboxError,
    Page,
    ServiceBlock,
)
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.modbus.request_queue import RequestQueue
from tests.support.controller.misbehaving_server import MisbehavingServer, exception_reply, right_reply

PATIENT_S = 60.0  # longer than any test: what fails then did not fail by its time-out
IMPATIENT_S = 1.0  # waited out by the tests of time-outs; long enough for a busy machine to connect


@pytest.fixture
async def server() -> AsyncIterator[MisbehavingServer]:
    async with MisbehavingServer() as misbehaving:
        yield misbehaving


@pytest.fixture
async def connect(server: MisbehavingServer) -> AsyncIterator[Callable[..., Awaitable[ModbusTcpController]]]:
    """Makes connected drivers to the misbehaving server, and closes them."""
    made: list[ModbusTcpController] = []

    async def make(timeout_s: float = PATIENT_S) -> ModbusTcpController:
        made.append(ModbusTcpController("127.0.0.1", server.port, timeout_s=timeout_s))
        await made[-1].connect()
        return made[-1]

    yield make
    for controller in made:
        await controller.close()


async def until(condition: Callable[[], Awaitable[bool]]) -> None:
    """Return when `condition` holds; what never comes fails the test rather than hang it."""
    async with asyncio.timeout(PATIENT_S / 4):
        while not await condition():
            await asyncio.sleep(0.001)


# --- values that must not reach the wire ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "request_of",
    [
        lambda controller: controller.write_transfer(65536),
        lambda controller: controller.write_transfer(-1),
        lambda controller: controller.write_page(Page((0,) * 32, ())),
        lambda controller: controller.write_page(Page((0,) * 31, (0,) * 1986)),
        lambda controller: controller.write_page(Page((0,) * 31, (0, 65536))),
        lambda controller: controller.read_page(1985),
        lambda controller: controller.read_page(-1),
        lambda controller: controller.write_service(ServiceBlock(owner=-1)),
    ],
)
async def test_a_value_out_of_range_is_an_error_before_anything_is_sent(
    connect: Callable, server: MisbehavingServer, request_of: Callable
) -> None:
    controller = await connect()
    with pytest.raises(MailboxError):
        await request_of(controller)
    assert server.requests == []
    assert controller.connected


# --- connections ------------------------------------------------------------------------------------------------------


async def test_before_connecting_a_request_says_that_there_is_no_connection() -> None:
    controller = ModbusTcpController("127.0.0.1", 1)
    assert not controller.connected
    # Log and journal tell it as it is: it must not ask people for what only a program can do.
    with pytest.raises(ControllerUnavailable, match=r"no connection stands\. Check that the controller is on"):
        await controller.read_link()
    await controller.close()


async def test_an_absent_controller_is_unavailable_and_the_reason_is_told() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound, but nobody listens
        controller = ModbusTcpController("127.0.0.1", taken.getsockname()[1])
        with pytest.raises(ControllerUnavailable, match=r"no connection: .*Check that the controller is on"):
            await controller.connect()
    assert not controller.connected


async def test_a_host_that_does_not_accept_is_given_up_after_the_time_out() -> None:
    with contextlib.ExitStack() as sockets:
        deaf = sockets.enter_context(socket.socket())
        deaf.bind(("127.0.0.1", 0))
        deaf.listen(0)
        for _ in range(3):  # fill the backlog, so that the next one gets no answer
            filler = sockets.enter_context(socket.socket())
            filler.setblocking(False)
            filler.connect_ex(deaf.getsockname())
        controller = ModbusTcpController("127.0.0.1", deaf.getsockname()[1], timeout_s=IMPATIENT_S)
        with pytest.raises(ControllerUnavailable, match=r"no connection in 1 s"):
            await controller.connect()


@pytest.mark.parametrize("host", ["a..b", "no-such-host.invalid"])
async def test_a_host_name_that_is_none_is_unavailable(host: str) -> None:
    controller = ModbusTcpController(host, 502, timeout_s=5)
    with pytest.raises(ControllerUnavailable, match="no connection"):
        await controller.connect()


async def test_several_connects_at_once_leave_one_connection(connect: Callable, server: MisbehavingServer) -> None:
    controller = await connect()
    await asyncio.gather(*(controller.connect() for _ in range(5)))
    await controller.read_link()

    async def only_one() -> bool:
        return server.open_connections == 1

    await until(only_one)


async def test_closing_while_connecting_leaves_no_connection(server: MisbehavingServer) -> None:
    controller = ModbusTcpController("127.0.0.1", server.port)
    connecting = asyncio.create_task(controller.connect())
    await asyncio.sleep(0)
    await controller.close()
    with pytest.raises(ControllerUnavailable, match="closed while connecting"):
        await connecting
    assert not controller.connected

    async def none_is_open() -> bool:
        return server.open_connections == 0

    await until(none_is_open)


async def test_closing_fails_the_pending_request_at_once(connect: Callable, server: MisbehavingServer) -> None:
    server.behave = server.be_silent
    controller = await connect()
    request = asyncio.create_task(controller.read_link())
    await until(server.asked)
    await controller.close()
    with pytest.raises(ControllerUnavailable, match="closed by this side"):
        await request


async def test_a_request_that_began_on_one_connection_never_goes_on_on_another(
    connect: Callable, server: MisbehavingServer
) -> None:
    controller = await connect()

    async def reconnect_after_first_chunk(request: bytes, writer: asyncio.StreamWriter) -> None:
        server.behave = server.behave_well
        reconnecting.append(asyncio.create_task(controller.connect()))
        await asyncio.sleep(0)
        writer.write(right_reply(request))

    reconnecting: list[asyncio.Task[None]] = []
    server.behave = reconnect_after_first_chunk
    with pytest.raises(ControllerUnavailable, match="replaced by a new connection"):
        await controller.write_page(Page((0,) * 31, (0,) * 400))
    await reconnecting[0]
    assert len(server.requests) == 1
    assert controller.connected


# --- replies that do not match ----------------------------------------------------------------------------------------


def changed(position: int, value: int) -> Callable[[bytes], bytes]:
    """The right reply with one byte changed."""

    def reply(request: bytes) -> bytes:
        right = bytearray(right_reply(request))
        right[position] = value
        return bytes(right)

    return reply


def fc3_of(count: int) -> Callable[[bytes], bytes]:
    """A well-formed FC3 reply of another length than was asked for."""
    return lambda request: (
        request[:4] + struct.pack(">H", 3 + 2 * count) + request[6:7] + bytes([3, 2 * count]) + bytes(2 * count)
    )


READ = "read"
WRITE = "write"
COMMIT = "commit"
REQUESTS = {
    READ: lambda controller: controller.read_link(),
    WRITE: lambda controller: controller.write_service(ServiceBlock()),
    COMMIT: lambda controller: controller.write_transfer(5),
}
NONSENSE = {
    "another transaction": (
        READ,
        lambda request: bytes([request[0], request[1] ^ 0x55]) + right_reply(request)[2:],
        "transaction is [0-9]+, expected [0-9]+",
    ),
    "another protocol": (READ, changed(3, 1), "protocol identifier is 1, expected 0"),
    "another unit": (READ, changed(6, 2), "device id is 2, expected 1"),
    "another function": (READ, changed(7, 4), "function code is 4, expected 3"),
    "an exception of another function": (READ, changed(7, 0x90), "function code is 144"),
    "too few registers": (READ, fc3_of(15), "length is 33, expected 35"),
    "too many registers": (READ, fc3_of(17), "length is 37, expected 35"),
    "a byte count that contradicts the length": (READ, changed(8, 30), "byte count is 30, expected 32"),
    "a frame length that is none": (READ, changed(4, 0xFF), "length is 65315"),
    "the request's echo": (READ, lambda request: request, "length is 6, expected 35"),
    "long garbage": (COMMIT, lambda request: bytes(1000), "transaction is 0, expected [0-9]+"),
    "text": (READ, lambda request: b"HTTP/1.1 400 Bad Request\r\n\r\n", "protocol identifier"),
    "a second reply in one go": (READ, lambda request: right_reply(request) * 2, "number of bytes is 82, expected 41"),
    "another address written": (WRITE, changed(9, 17), "address is 17, expected 16"),
    "another count written": (WRITE, changed(11, 15), "register count is 15, expected 16"),
    "an FC6 reply to FC16": (WRITE, changed(7, 6), "function code is 6, expected 16"),
    "another register committed": (COMMIT, changed(9, 33), "address is 33, expected 32"),
    "another value committed": (COMMIT, changed(11, 6), "value is 6, expected 5"),
    "an FC16 reply to FC6": (COMMIT, changed(7, 16), "function code is 16, expected 6"),
}


@pytest.mark.parametrize(("kind", "reply", "seen"), NONSENSE.values(), ids=NONSENSE)
async def test_a_reply_that_does_not_match_is_nonsense_and_ends_the_connection(
    connect: Callable, server: MisbehavingServer, kind: str, reply: Callable, seen: str
) -> None:
    controller = await connect()
    server.reply_with(reply)
    with pytest.raises(ControllerNonsense, match=seen):
        await REQUESTS[kind](controller)
    assert not controller.connected
    server.behave = server.behave_well
    await controller.connect()
    await REQUESTS[kind](controller)


@pytest.mark.parametrize("code", [1, 2, 3, 4, 6, 8, 10, 99])
@pytest.mark.parametrize("kind", [READ, WRITE, COMMIT])
async def test_an_exception_response_is_raised_with_its_code_and_the_connection_stays(
    connect: Callable, server: MisbehavingServer, kind: str, code: int
) -> None:
    controller = await connect()
    server.reply_with(lambda request: exception_reply(request, code))
    with pytest.raises(ControllerRefused, match=f"exception {code} \\(") as refusal:
        await REQUESTS[kind](controller)
    assert refusal.value.code == code
    server.behave = server.behave_well
    await REQUESTS[kind](controller)
    assert server.connections == 1


@pytest.mark.parametrize("code", [5, 11])
async def test_an_exception_that_says_it_may_still_be_done_counts_as_no_reply(
    connect: Callable, server: MisbehavingServer, code: int
) -> None:
    controller = await connect()
    server.reply_with(lambda request: exception_reply(request, code))
    with pytest.raises(ControllerTimeout, match=f"exception {code} "):
        await controller.write_transfer(5)
    assert not controller.connected


async def test_a_reply_that_comes_in_single_bytes_is_taken(connect: Callable, server: MisbehavingServer) -> None:
    async def dribble(request: bytes, writer: asyncio.StreamWriter) -> None:
        for byte in right_reply(request, 7):
            writer.write(bytes([byte]))
            await asyncio.sleep(0)

    controller = await connect()
    server.behave = dribble
    assert (await controller.read_link()).session == 7


async def _silence(request: bytes, writer: asyncio.StreamWriter) -> None:
    """No reply at all."""


async def _half(request: bytes, writer: asyncio.StreamWriter) -> None:
    writer.write(right_reply(request)[:11])


async def _reset_in_reply(request: bytes, writer: asyncio.StreamWriter) -> None:
    writer.write(right_reply(request)[:11])
    await asyncio.sleep(0.01)
    linger = struct.pack("ii", 1, 0)
    writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
    writer.transport.abort()


async def _close_in_reply(request: bytes, writer: asyncio.StreamWriter) -> None:
    writer.write(right_reply(request)[:11])
    writer.close()


@pytest.mark.parametrize(
    ("kind", "behave"),
    [(READ, _silence), (WRITE, _silence), (COMMIT, _silence), (READ, _half)],
)
async def test_a_controller_that_does_not_answer_in_time_is_a_time_out_and_the_connection_ends(
    connect: Callable, server: MisbehavingServer, kind: str, behave: Callable
) -> None:
    controller = await connect(timeout_s=IMPATIENT_S)
    server.behave = behave
    with pytest.raises(ControllerTimeout, match=r"no reply to FC(3|6|16) of register.* in 1 s"):
        await REQUESTS[kind](controller)
    assert not controller.connected
    with pytest.raises(ControllerTimeout):
        await controller.read_link()
    await until(server.asked)
    assert len(server.requests) == 1


@pytest.mark.parametrize("behave", [_reset_in_reply, _close_in_reply])
async def test_a_connection_that_ends_in_a_reply_fails_the_request_without_waiting(
    connect: Callable, server: MisbehavingServer, behave: Callable
) -> None:
    controller = await connect()
    server.behave = behave
    async with asyncio.timeout(PATIENT_S / 4):
        with pytest.raises(ControllerUnavailable, match="closed the connection"):
            await controller.write_transfer(5)
    assert not controller.connected


async def test_a_late_reply_is_never_taken_for_the_next_requests(connect: Callable, server: MisbehavingServer) -> None:
    release = asyncio.Event()

    async def late(request: bytes, writer: asyncio.StreamWriter) -> None:
        server.behave = server.behave_well
        await release.wait()
        writer.write(right_reply(request, 1111))

    controller = await connect(timeout_s=IMPATIENT_S)
    server.behave = late
    with pytest.raises(ControllerTimeout):
        await controller.read_link()
    server.value = 2222
    await controller.connect()
    release.set()
    assert (await controller.read_link()).session == 2222


async def test_a_reply_nobody_asked_for_ends_the_connection(connect: Callable, server: MisbehavingServer) -> None:
    controller = await connect()
    await controller.read_link()
    server.say(right_reply(server.requests[-1]))

    async def ended() -> bool:
        return not controller.connected

    await until(ended)
    with pytest.raises(ControllerNonsense, match="no request was pending"):
        await controller.read_link()


async def test_a_cancelled_request_ends_the_connection(connect: Callable, server: MisbehavingServer) -> None:
    server.behave = server.be_silent
    controller = await connect()
    request = asyncio.create_task(controller.write_transfer(5))
    await until(server.asked)
    request.cancel()
    with pytest.raises(asyncio.CancelledError):
        await request
    assert not controller.connected
    with pytest.raises(ControllerUnavailable, match="was cancelled on its way"):
        await controller.read_link()


async def test_a_request_cancelled_in_the_queue_leaves_the_one_before_it_alone(
    connect: Callable, server: MisbehavingServer
) -> None:
    release = asyncio.Event()

    async def slow(request: bytes, writer: asyncio.StreamWriter) -> None:
        await release.wait()
        writer.write(right_reply(request, 3))

    server.behave = slow
    controller = await connect()
    first = asyncio.create_task(controller.read_link())
    await until(server.asked)
    second = asyncio.create_task(controller.write_transfer(7))
    third = asyncio.create_task(controller.read_link())
    await asyncio.sleep(0)
    second.cancel()
    with pytest.raises(asyncio.CancelledError):
        await second
    release.set()
    assert (await first).session == (await third).session == 3
    assert controller.connected
    assert [request[7] for request in server.requests] == [3, 3]


@pytest.mark.parametrize("first", ["the cancellation", "the reply"])
async def test_a_cancellation_in_the_very_moment_of_the_reply_is_not_swallowed(
    connect: Callable, server: MisbehavingServer, monkeypatch: pytest.MonkeyPatch, first: str
) -> None:
    take = RequestQueue._take

    def cancel_and_take(connection: RequestQueue, data: bytes) -> None:
        if first == "the cancellation":
            reading.cancel()
        take(connection, data)
        reading.cancel()

    controller = await connect()
    monkeypatch.setattr(RequestQueue, "_take", cancel_and_take)
    reading = asyncio.create_task(controller.read_link())
    with pytest.raises(asyncio.CancelledError):
        await reading
    monkeypatch.undo()
    await controller.read_link()  # the reply had come: nothing is under way


async def test_the_queue_behind_a_failed_request_fails_too_and_sends_nothing(
    connect: Callable, server: MisbehavingServer
) -> None:
    server.behave = server.be_silent
    controller = await connect(timeout_s=IMPATIENT_S)
    outcomes = await asyncio.gather(*(controller.read_link() for _ in range(4)), return_exceptions=True)
    assert all(isinstance(outcome, ControllerTimeout) for outcome in outcomes)
    await until(server.asked)
    assert len(server.requests) == 1


async def test_faults_are_raised_and_not_logged(
    connect: Callable, server: MisbehavingServer, caplog: pytest.LogCaptureFixture
) -> None:
    controller = await connect(timeout_s=IMPATIENT_S)
    server.behave = server.be_silent
    with pytest.raises(ControllerTimeout):
        await controller.read_link()
    server.reply_with(lambda request: b"garbage, and more of it")
    await controller.connect()
    with pytest.raises(ControllerError):
        await controller.read_link()
    assert caplog.records == []
