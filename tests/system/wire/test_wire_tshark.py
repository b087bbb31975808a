"""The wire in another's eyes: Wireshark's Modbus dissector reads a captured transfer."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from drivers.controller import ServiceBlock
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import ContourMessage, encode_pages, micrometres
from drivers.controller.mailbox.words import WordOrder
from drivers.controller.modbus.client import ModbusController, ModbusRtuOverTcpController, ModbusTcpController
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.protocol_decoder import decode_contour
from tests.support.real_parts import missing, need_program

INSTALL = "apt-get install tshark"
SESSION = 9
VERTICES = 490
FIELDS = (
    "tcp.dstport",
    "modbus.func_code",
    "modbus.reference_num",
    "modbus.word_cnt",
    "modbus.regval_uint16",
    "modbus.data",  # where it shows FC6's value
)


@dataclass(frozen=True)
class Frame:
    """One Modbus frame as tshark reads it; what it does not find is None, or ()."""

    to_controller: bool
    function_code: int
    address: int | None
    count: int | None
    values: tuple[int, ...]


@contextlib.asynccontextmanager
async def captured(port: int, file: Path, controller: ModbusController) -> AsyncIterator[None]:
    """Capture loopback's `port` into `file` while the block runs; no packet of the block is missed."""
    shown, said = file.with_suffix(".shown"), file.with_suffix(".said")
    command = [need_program("tshark", INSTALL), "-i", "lo", "-f", f"tcp port {port}", "-w", str(file), "-P", "-l"]
    with shown.open("wb") as out, said.open("wb") as err:
        tshark = await asyncio.create_subprocess_exec(*command, stdout=out, stderr=err)

    def packets() -> int:
        return shown.read_bytes().count(b"\n")

    async def probe(until: int) -> None:
        """Send requests that do no harm until the capture has shown packet number `until`."""
        async with asyncio.timeout(60):
            while packets() < until:
                if tshark.returncode is not None:
                    missing(f"tshark cannot capture here: {said.read_text().strip()}. Run as root")
                await controller.read_link()
                await asyncio.sleep(0.01)

    try:
        await probe(1)
        yield
        await probe(packets() + 50)
    finally:
        if tshark.returncode is None:
            tshark.terminate()
        await tshark.wait()


TCP, RTU = "mbtcp", "mbrtu"
"""Wireshark's names of the two framings."""


def tshark_reads(file: Path, port: int, framing: str, display_filter: str, *fields: str) -> list[list[str]]:
    """A row of `fields` for each packet of the capture that the filter lets through."""
    command = [need_program("tshark", INSTALL), "-r", str(file), "-o", f"{framing}.tcp.port:{port}"]
    command += ["-o", "mbrtu.crc_verification:TRUE", "-Y", display_filter]
    command += ["-T", "fields", "-E", "separator=;", "-E", "aggregator=,"]
    for field in fields:
        command += ["-e", field]
    output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [line.split(";") for line in output.splitlines()]


def in_hexadecimal(data: str) -> tuple[int, ...]:
    digits = data.replace(":", "")
    return tuple(int(digits[start : start + 4], 16) for start in range(0, len(digits), 4))


def frames_in(file: Path, port: int, framing: str) -> list[Frame]:
    rows = tshark_reads(file, port, framing, "modbus", *FIELDS)
    return [
        Frame(
            to_controller=int(destination) == port,
            function_code=int(function_code),
            address=int(address) if address else None,
            count=int(count) if count else None,
            values=tuple(int(value) for value in values.split(",") if value) or in_hexadecimal(data),
        )
        for destination, function_code, address, count, values, data in rows
    ]


@pytest.mark.parametrize(("framing", "word_order"), [(TCP, "big"), (TCP, "little"), (RTU, "big")])
async def test_wireshark_reads_a_transfer_as_the_protocol_tells_it(
    tmp_path: Path, framing: str, word_order: WordOrder
) -> None:
    need_program("tshark", INSTALL)
    angles = np.linspace(0, 2 * np.pi, VERTICES, endpoint=False)
    ring = micrometres(np.stack([400 * np.cos(angles), 300 * np.sin(angles)], axis=1))
    area = round(VERTICES / 2 * 400 * 300 * np.sin(2 * np.pi / VERTICES))
    message = ContourMessage(7, (ring,), area, 200, 0, 1, True, False, 0, SESSION)
    (page,) = encode_pages(message, 1984, word_order)
    layout = MailboxLayout(word_order=word_order)
    file = tmp_path / "transfer.pcapng"

    served = SimulatedController(
        layout=layout, session_source=lambda: SESSION, framing="tcp" if framing == TCP else "rtu"
    )
    driver = ModbusTcpController if framing == TCP else ModbusRtuOverTcpController
    async with served as simulated:
        port = simulated.port
        controller = driver("127.0.0.1", port, layout=layout, timeout_s=30)
        await controller.connect()
        while (await controller.read_link()).session != SESSION:
            await asyncio.sleep(0.01)
        async with captured(port, file, controller):
            await controller.write_service(ServiceBlock(service_state=5))
            await controller.write_transfer(0)
            await controller.write_page(page)
            assert await controller.read_page(len(page.payload)) == page
            await controller.write_transfer(3)
            while (await controller.read_link()).ack_transfer != 3:
                await asyncio.sleep(0.01)
        await controller.close()
    assert simulated.verdict.accepted == 1
    assert set(simulated.verdict.counts) <= {"heartbeat-stalled"}, simulated.verdict  # this client has none

    assert tshark_reads(file, port, framing, "mbrtu.crc16.status == 0", "frame.number") == []
    assert (
        tshark_reads(file, port, framing, "_ws.malformed || _ws.short || modbus.exception_code", "frame.number") == []
    )
    frames = frames_in(file, port, framing)
    asked = [frame for frame in frames if frame.to_controller]
    assert {frame.function_code for frame in frames} == {3, 6, 16}
    assert abs(len(frames) - 2 * len(asked)) <= 1  # the capture may begin or end between request and reply

    writes = [frame for frame in asked if frame.function_code != 3]
    service, clearing, *chunks, commit = writes
    assert (service.function_code, service.address, service.count) == (16, 16, 16)
    assert (clearing.function_code, clearing.address, clearing.values) == (6, 32, (0,))
    assert (commit.function_code, commit.address, commit.values) == (6, 32, (3,))
    assert all(chunk.function_code == 16 and chunk.count == len(chunk.values) <= 123 for chunk in chunks)
    starts = [33]
    for chunk in chunks:
        assert chunk.address == starts[-1]
        starts.append(chunk.address + chunk.count)
    assert starts[-1] == 64 + 2 + 4 * VERTICES
    assert len(chunks) == (17 if framing == TCP else 27)  # over a slow line heartbeats go between shorter requests

    written = [value for chunk in chunks for value in chunk.values]
    contour = decode_contour([((3, *written[:31]), written[31:])], word_order)
    assert contour.rings == (tuple(map(tuple, ring.tolist())),)
    assert contour.header.session == SESSION
