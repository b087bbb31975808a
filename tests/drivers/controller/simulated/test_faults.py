"""The scripted faults of the simulated controller, on a real socket and a real pseudo-terminal."""

from __future__ import annotations

import asyncio
import os
import struct
import tty
from collections.abc import Iterable, Iterator
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.faults import FAULT_KINDS, FaultPlan, LineFault, targets_of
from drivers.controller.simulated.received import FramingName, ReceivedRequest
from drivers.controller.simulated.server import QUIET_S, RegisterServer
from tests.support.controller.raw_client import Client, page, simulated
from tests.support.controller.rtu_frames import frame

READ_LINK = struct.pack(">BHH", 3, 0, 16)
CLEAR = struct.pack(">BHH", 6, 32, 0)
COMMIT = struct.pack(">BHH", 6, 32, 5)
SILENCE_S = 0.15


async def silent(client: Client) -> bool:
    """True where nothing comes for a while, and the connection stays."""
    try:
        async with asyncio.timeout(SILENCE_S):
            await client.reader.read(1)
    except TimeoutError:
        return True
    return False


def with_fault(kind: str, **options: object) -> SimulatedController:
    return simulated(faults=FaultPlan([LineFault(kind, **{"at": (1,), "request": "write", **options})]))  # type: ignore[arg-type]


# --- on TCP ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "done"), [("lost-request", False), ("lost-reply", True), ("garbled-request", False)])
async def test_what_is_lost_is_done_or_not_and_never_answered(kind: str, done: bool) -> None:
    async with with_fault(kind) as controller, Client(controller.port) as client:
        client.writer.write(struct.pack(">HHHB", 1, 0, 6, 1) + COMMIT)
        assert await silent(client)
        assert controller.registers(32, 1) == ((5,) if done else (0,))
        assert controller.verdict.as_json()["faults"] == {kind: 1}


async def test_a_late_reply_comes_late() -> None:
    async with with_fault("late-reply", delay_s=0.05) as controller, Client(controller.port) as client:
        started = asyncio.get_running_loop().time()
        assert await client.ask(COMMIT) == COMMIT
        assert asyncio.get_running_loop().time() - started >= 0.04


async def test_a_repeated_reply_comes_twice() -> None:
    async with with_fault("repeated-reply", delay_s=0.01) as controller, Client(controller.port) as client:
        assert await client.ask(COMMIT) == COMMIT
        assert (await client.reader.readexactly(12))[7:] == COMMIT


async def test_a_foreign_reply_tells_of_another_register() -> None:
    async with with_fault("foreign-reply", request="any", every=1) as controller, Client(controller.port) as client:
        assert await client.ask(COMMIT) == struct.pack(">BHH", 6, 33, 5)
    async with with_fault("foreign-reply", request="any") as controller, Client(controller.port) as client:
        assert len(await client.ask(READ_LINK)) == 2 + 30


@pytest.mark.parametrize("code", [2, 3, 4, 6])
async def test_an_exception_leaves_the_register_as_it_was(code: int) -> None:
    async with with_fault("exception", code=code) as controller, Client(controller.port) as client:
        assert await client.ask(COMMIT) == bytes([0x86, code])
        assert controller.registers(32, 1) == (0,)


async def test_exception_5_is_done_later() -> None:
    async with with_fault("exception", code=5, delay_s=0.02) as controller, Client(controller.port) as client:
        assert await client.ask(COMMIT) == bytes([0x86, 5])
        assert controller.registers(32, 1) == (0,)
        await asyncio.sleep(0.05)
        assert controller.registers(32, 1) == (5,)


@pytest.mark.parametrize(("kind", "done"), [("reset-before", False), ("reset-after", True)])
async def test_a_reset_ends_the_connection_before_or_after_the_request(kind: str, done: bool) -> None:
    async with with_fault(kind) as controller:
        client = Client(controller.port)
        await client.__aenter__()
        with pytest.raises((ConnectionResetError, asyncio.IncompleteReadError)):
            await client.ask(COMMIT)
        client.writer.close()
        assert controller.registers(32, 1) == ((5,) if done else (0,))


async def test_a_half_open_connection_says_nothing_more_and_another_one_does() -> None:
    async with with_fault("half-open") as controller, Client(controller.port) as client:
        client.writer.write(struct.pack(">HHHB", 1, 0, 6, 1) + CLEAR)
        client.writer.write(struct.pack(">HHHB", 2, 0, 6, 1) + READ_LINK)
        assert await silent(client)
        async with Client(controller.port) as other:
            assert (await other.ask(READ_LINK))[0] == 3


async def test_a_late_write_lands_though_its_client_has_gone_and_nobody_blames_it() -> None:
    async with with_fault("late-write", delay_s=0.05) as controller:
        async with Client(controller.port) as client:
            client.writer.write(struct.pack(">HHHB", 1, 0, 6, 1) + COMMIT)
            await client.writer.drain()
            await asyncio.sleep(0.02)
        assert controller.registers(32, 1) == (0,)
        await asyncio.sleep(0.08)
        assert controller.registers(32, 1) == (5,)
        assert controller.verdict.clean, controller.verdict


# --- what the client does about it ----------------------------------------------------------------------------------


async def test_going_on_with_a_page_after_a_lost_reply_is_against_the_protocol() -> None:
    async with with_fault("lost-reply", request="clear") as controller:
        async with Client(controller.port) as client:
            client.writer.write(struct.pack(">HHHB", 1, 0, 6, 1) + CLEAR)
            assert await silent(client)
        async with Client(controller.port) as client:
            await client.write(33, *page().header)
        assert set(controller.verdict.counts) == {"went-on-after-lost-reply"}
        seen = controller.verdict.as_json()["violations"]
        assert seen[0]["seen"][0]["registers"]["address"] == 33  # type: ignore[index]


async def test_clearing_again_after_a_lost_reply_is_in_order() -> None:
    async with with_fault("lost-reply", request="page") as controller:
        async with Client(controller.port) as client:
            await client.write_one(32, 0)
            client.writer.write(struct.pack(">HHHBBHHBH", 1, 0, 9, 1, 16, 33, 1, 2, 0))
            assert await silent(client)
        async with Client(controller.port) as client:
            await client.until_started()
            await client.write_page(page(), 1)
        assert controller.verdict.clean, controller.verdict


async def test_asking_again_on_a_connection_that_owes_a_reply_is_against_the_protocol() -> None:
    async with with_fault("lost-reply", request="read") as controller, Client(controller.port) as client:
        client.writer.write(struct.pack(">HHHB", 1, 0, 6, 1) + READ_LINK)
        assert await silent(client)
        await client.ask(READ_LINK)
        assert set(controller.verdict.counts) == {"too-early"}


# --- on RTU ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    near, far = os.openpty()
    tty.setraw(far)
    os.set_blocking(near, False)
    yield near, os.ttyname(far)
    os.close(near)
    os.close(far)


async def heard(near: int, seconds: float = SILENCE_S) -> bytes:
    await asyncio.sleep(seconds)
    try:
        return os.read(near, 4096)
    except BlockingIOError:
        return b""


def rtu(pdu: bytes) -> bytes:
    return frame(b"\1" + pdu)


async def test_a_garbled_reply_has_a_wrong_crc_and_the_next_one_a_right_one(line: tuple[int, str]) -> None:
    near, name = line
    plan = FaultPlan([LineFault("garbled-reply", at=(1,))])
    async with SimulatedController.on_serial(name, scan_s=0.001, faults=plan):
        os.write(near, rtu(COMMIT))
        garbled = await heard(near)
        assert len(garbled) == 8
        assert garbled != rtu(COMMIT)
        os.write(near, rtu(COMMIT))
        assert await heard(near) == rtu(COMMIT)


async def test_half_a_request_is_dropped_once_the_line_was_silent(line: tuple[int, str]) -> None:
    near, name = line
    async with SimulatedController.on_serial(name, scan_s=0.001):
        os.write(near, rtu(COMMIT)[:5])
        assert await heard(near, 3 * QUIET_S) == b""
        os.write(near, rtu(COMMIT))
        assert await heard(near) == rtu(COMMIT)


async def test_rtu_frames_over_tcp_are_served_by_their_own_framing() -> None:
    async with SimulatedController(framing="rtu", scan_s=0.001) as controller:
        reader, writer = await asyncio.open_connection("127.0.0.1", controller.port)
        writer.write(rtu(COMMIT)[:3])
        await asyncio.sleep(0.005)
        writer.write(rtu(COMMIT)[3:])
        assert await reader.readexactly(8) == rtu(COMMIT)
        writer.close()
        await writer.wait_closed()


# --- rules and frames -----------------------------------------------------------------------------------------------


def test_every_kind_of_fault_is_explained() -> None:
    assert all(text and not text.endswith(".") for text in FAULT_KINDS.values())


def test_a_rule_strikes_the_requests_that_it_names_and_no_others() -> None:
    plan = FaultPlan([LineFault("lost-reply", request="commit", every=2, times=2)])
    layout = MailboxLayout()
    struck = [
        plan.strike(targets_of(pdu, layout), 0.0) is not None
        for pdu in (COMMIT, CLEAR, COMMIT, READ_LINK, COMMIT, COMMIT, COMMIT, COMMIT)
    ]
    assert struck == [False, False, True, False, False, True, False, False]


def test_a_rule_holds_in_its_time_only() -> None:
    plan = FaultPlan([LineFault("lost-reply", every=1, after_s=1, before_s=2)])
    assert [plan.strike(frozenset({"any"}), at) is not None for at in (0.9, 1.0, 1.9, 2.0)] == [
        False,
        True,
        True,
        False,
    ]


def test_the_same_seed_strikes_the_same_requests() -> None:
    def struck(seed: int) -> list[bool]:
        plan = FaultPlan([LineFault("lost-reply", chance=0.3)], seed)
        return [plan.strike(frozenset({"any"}), 0.0) is not None for _ in range(200)]

    assert struck(1) == struck(1)
    assert struck(1) != struck(2)
    assert 30 < sum(struck(1)) < 90


PDUS = st.one_of(
    st.builds(lambda a, n: struct.pack(">BHH", 3, a, n), st.integers(0, 65535), st.integers(0, 65535)),
    st.builds(
        lambda v: struct.pack(f">BHHB{len(v)}H", 16, 0, len(v), 2 * len(v), *v),
        st.lists(st.integers(0, 65535), max_size=120),
    ),
)


class Listener:
    """A device that keeps what it is asked."""

    def __init__(self) -> None:
        self.heard: list[bytes] = []

    def addressed(self, request: ReceivedRequest) -> ReceivedRequest:
        return request

    def strike(self, request: ReceivedRequest) -> None:
        return None

    def answer(self, request: ReceivedRequest) -> None:
        self.heard.append(request.pdu)

    def connection(self, up: bool) -> None:
        """Nothing: it does not matter here."""


class Nowhere(asyncio.Transport):
    """A connection to nobody."""

    def is_closing(self) -> bool:
        return False

    def write(self, data: object) -> None:
        raise AssertionError("nothing is answered")

    def abort(self) -> None:
        """Nothing: the server hears no more from itself."""

    close = abort


async def heard_of(framing: FramingName, pieces: Iterable[bytes], after_silence: bytes = b"") -> list[bytes]:
    """What a server makes of bytes that arrive in pieces, and of those that come after the line was silent."""
    listener = Listener()
    server = RegisterServer(listener, framing, FaultPlan())
    await server.listen("127.0.0.1", 0)
    connection = server._server.callback_new_connection()
    connection.connection_made(Nowhere())
    for piece in filter(None, pieces):
        connection.data_received(piece)
    if after_silence:
        connection._fall_silent()
        connection.data_received(after_silence)
    await server.stop()
    return listener.heard


@given(st.lists(PDUS, max_size=4), st.lists(st.integers(0, 1000), max_size=8))
def test_requests_are_the_same_however_the_bytes_arrive(pdus: list[bytes], cuts: list[int]) -> None:
    for framing, frames in (
        ("rtu", [rtu(pdu) for pdu in pdus]),
        ("tcp", [struct.pack(">HHHB", 7, 0, len(pdu) + 1, 1) + pdu for pdu in pdus]),
    ):
        data = b"".join(frames)
        places = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
        assert asyncio.run(heard_of(framing, (data[a:b] for a, b in pairwise(places)))) == pdus


@given(st.binary(max_size=300))
def test_noise_on_the_line_is_no_crash_and_is_over_with_a_silence(noise: bytes) -> None:
    asyncio.run(heard_of("tcp", [noise]))
    assert asyncio.run(heard_of("rtu", [noise], rtu(COMMIT)))[-1:] == [COMMIT]


@pytest.mark.parametrize("framing", ["rtu", "tcp"])
def test_a_function_code_that_nobody_knows_is_a_request_too(framing: FramingName) -> None:
    pdu = bytes([99, 1, 2, 3])
    data = rtu(pdu) if framing == "rtu" else struct.pack(">HHHB", 7, 0, 5, 1) + pdu
    assert asyncio.run(heard_of(framing, [data])) == [pdu]
