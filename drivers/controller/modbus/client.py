"""The controller over Modbus TCP, RTU, or RTU over TCP: one attempt a call. All policy is the caller's."""

from __future__ import annotations

import asyncio
import secrets
import struct
from collections.abc import Sequence

from drivers.controller.errors import ControllerNonsense, ControllerUnavailable, MailboxError
from drivers.controller.mailbox.blocks import (
    BLOCK_REGISTERS,
    LinkBlock,
    ServiceBlock,
    decode_link,
    decode_service,
    encode_service,
)
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.page_spans import PAYLOAD_OFFSET, header_spans, page_starts, spans
from drivers.controller.mailbox.pages import HEADER_REGISTERS, Page
from drivers.controller.mailbox.part_block import PART_HEADER_REGISTERS, part_starts
from drivers.controller.modbus.late_replies import outlast_late_replies
from drivers.controller.modbus.request_queue import RequestQueue
from drivers.controller.modbus.requests import (
    Request,
    RequestLimits,
    SingleWrite,
    read_registers,
    registers_of,
    stream_of,
    write_register,
    write_registers,
)
from drivers.controller.modbus.serial_line import Rs485, SerialLine
from drivers.controller.modbus.transports import RtuOverTcpTransport, RtuTransport, TcpTransport, Transport

__all__ = [
    "MailboxLayout",
    "ModbusController",
    "ModbusRtuController",
    "ModbusRtuOverTcpController",
    "ModbusTcpController",
    "RequestLimits",
    "Rs485",
    "SerialLine",
]

# Of the line, for one request of a page and its reply: our heartbeat waits for it, and is to change once a second.
LONGEST_EXCHANGE_S = 0.2
LATE_REPLIES = 4  # that one `connect` gets out of the way


class ModbusController:
    """The Controller role over `transport`; see `Controller` for what is raised."""

    def __init__(
        self,
        transport: Transport,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        timeout_s: float = 1.0,
        limits: RequestLimits | None = None,
        single_write: SingleWrite = "fc6",
    ) -> None:
        """single_write: the function by which the commit register is written.

        Both it and `device_id` may be changed; another device id counts from the next connection on.
        """
        transport.framing(device_id)  # MailboxError: a device id that none can have
        self._transport = transport
        self.device_id = device_id
        self._layout = layout or MailboxLayout()
        self._read_link = (read_registers(self._layout.link_address, BLOCK_REGISTERS),)
        self._read_service = (read_registers(self._layout.service_address, BLOCK_REGISTERS),)
        self._timeout_s = timeout_s
        self.single_write = single_write
        self._limits = limits or RequestLimits()
        if transport.timing.byte_s:
            self._limits = self._limits.within(LONGEST_EXCHANGE_S / transport.timing.byte_s)
        self._connecting = asyncio.Lock()
        self._connection: RequestQueue | None = None
        self._opening: RequestQueue | None = None
        self._closings = 0
        self._barriers = secrets.randbelow(1000)  # another place in their row than that of a process just killed

    def __str__(self) -> str:
        return f"{self._transport.name} device {self.device_id}"

    @property
    def connected(self) -> bool:
        """True while requests can be tried."""
        return self._connection is not None and self._connection.fault is None

    async def connect(self) -> None:
        """Open a new connection, closing an old one first; raise ControllerUnavailable.

        On a serial line it returns when no reply to an earlier request can come any more.
        """
        async with self._connecting:  # two at once would leak a socket
            self._drop("replaced by a new connection")
            closings = self._closings
            self._connection = await self._checked(closings)

    async def close(self) -> None:
        """Close the connection; never raises."""
        self._closings += 1
        self._drop("closed by this side")

    @property
    def serial(self) -> bool:
        """True on a line, where device id 0 is a broadcast."""
        return self._transport.serial

    @property
    def layout(self) -> MailboxLayout:
        """Where the mailbox lies."""
        return self._layout

    @property
    def limits(self) -> RequestLimits:
        """How long one request may be; on a slow line shorter than the controller would take."""
        return self._limits

    async def run(self, requests: Sequence[Request]) -> list[bytes]:
        """The PDUs of the replies to requests that the caller made: for commissioning."""
        return await self._held().run(requests)

    async def read_link(self) -> LinkBlock:
        """The controller's block, one FC3 of 16 registers."""
        registers = await self._read_block(self._read_link)
        return decode_link(registers, self._layout.word_order)

    def glance(self) -> LinkBlock | None:
        """The same where the controller is prompt, else None: then `read_link` asks, and tells what is wrong."""
        reply = None if self._connection is None else self._connection.at_once(self._read_link[0])
        return None if reply is None else decode_link(registers_of(reply), self._layout.word_order)

    async def read_service(self) -> ServiceBlock:
        """The service's own block as the controller holds it, one FC3 of 16 registers."""
        registers = await self._read_block(self._read_service)
        return decode_service(registers, self._layout.word_order)

    async def write_service(self, block: ServiceBlock) -> None:
        """Write the service's block whole, one FC16."""
        registers = encode_service(block, self._layout.word_order)
        await self._held().run([write_registers(self._layout.service_address, stream_of(registers))])

    async def write_transfer(self, transfer: int) -> None:
        """Write the commit register alone, by FC6, or FC16 where the controller knows no other."""
        if not 0 <= transfer <= 0xFFFF:
            raise MailboxError(f"transfer is {transfer}, expected 0 to 65535")
        address = self._layout.contour_address
        by_fc6 = self.single_write == "fc6"
        await self._held().run(
            [write_register(address, transfer) if by_fc6 else write_registers(address, stream_of((transfer,)))]
        )

    async def write_page(self, page: Page) -> None:
        """Write part block, payload and header without the commit register, in as few FC16 as the limit allows."""
        stream = self._stream(page)
        first = self._layout.contour_address
        of_part = [
            write_registers(self._part_address(page.part) + offset, _stream_of(page.part[offset : offset + count]))
            for offset, count in (spans(part_starts(page.part), self._limits.write) if page.part else ())
        ]
        await self._held().run(
            [
                *of_part,
                *(
                    write_registers(first + offset, stream[2 * (offset - 1) : 2 * (offset - 1 + count)])
                    for offset, count in spans(page_starts(page.header, len(page.payload)), self._limits.write)
                ),
            ]
        )

    async def read_page(self, payload_length: int, part_length: int = 0) -> Page:
        """Read header without the commit register, `payload_length` registers of payload and the part block's back."""
        self._check_payload_length(payload_length)
        connection = self._held()
        first = self._layout.contour_address
        replies = await connection.run(
            [read_registers(first + offset, count) for offset, count in header_spans(self._limits.read)]
        )
        header = tuple(register for reply in replies for register in registers_of(reply))[1:]
        starts = [start for start in page_starts(header, payload_length) if start >= PAYLOAD_OFFSET]
        reads = [read_registers(first + offset, count) for offset, count in spans(starts, self._limits.read)]
        replies = await connection.run(reads)
        payload = tuple(register for reply in replies for register in registers_of(reply))
        return Page(header, payload, await self._read_part(connection, part_length))

    async def _read_part(self, connection: RequestQueue, length: int) -> tuple[int, ...]:
        if not length:
            return ()
        first = self._part_address((0,) * length)
        # Values may be split here, since it is only compared; counts are even, as `header_spans` says why.
        longest = self._limits.read // 2 * 2
        reads = [read_registers(first + at, min(longest, length - at)) for at in range(0, length, longest)]
        return tuple(register for reply in await connection.run(reads) for register in registers_of(reply))

    # --- connection ---------------------------------------------------------------------------------------------

    async def _checked(self, closings: int) -> RequestQueue:
        """A new connection on which no late reply can come."""
        for left in reversed(range(LATE_REPLIES)):
            descriptor = await self._transport.open(self._timeout_s)
            connection = RequestQueue(self._transport, descriptor, self.device_id, self._timeout_s)
            self._opening = connection
            try:
                self._check_still_wanted(closings)
                if self._transport.serial:
                    self._barriers += 1
                    contour = self._layout.contour_address
                    await outlast_late_replies(connection, contour, self._barriers, self._timeout_s)
                return connection
            except ControllerNonsense:
                if not left:
                    raise
            except BaseException:
                connection.end(ControllerUnavailable(f"{self._transport.name}: not connected"))
                raise
            finally:
                self._opening = None
        raise AssertionError("unreachable: the last late reply is raised")

    def _check_still_wanted(self, closings: int) -> None:
        if closings != self._closings:
            raise ControllerUnavailable(f"{self._transport.name}: closed while connecting")

    def _held(self) -> RequestQueue:
        if self._connection is None:
            # A job meets this while the connection is opened anew: it is read by people, in log and journal.
            raise ControllerUnavailable(
                f"{self._transport.name}: no connection stands. Check that the controller is on, and its cable"
            )
        return self._connection

    def _drop(self, why: str) -> None:
        for connection in (self._connection, self._opening):
            if connection is not None:
                connection.end(ControllerUnavailable(f"{connection.name}: {why}"))
        self._connection = None

    # --- registers ----------------------------------------------------------------------------------------------

    async def _read_block(self, row: Sequence[Request]) -> tuple[int, ...]:
        (reply,) = await self._held().run(row)
        return registers_of(reply)

    def _stream(self, page: Page) -> bytes:
        """The page's registers from offset 1 on, as they go on the wire."""
        if len(page.header) != HEADER_REGISTERS:
            raise MailboxError(f"the page's header has {len(page.header)} registers, expected {HEADER_REGISTERS}")
        self._check_payload_length(len(page.payload))
        return _stream_of(page.header) + _stream_of(page.payload)

    def _part_address(self, part: Sequence[int]) -> int:
        """Where the part block goes; raise MailboxError where it has no room."""
        address, room = self._layout.part_address, PART_HEADER_REGISTERS + self._layout.part_capacity
        if address is None or not PART_HEADER_REGISTERS <= len(part) <= room:
            raise MailboxError(
                f"a part block of {len(part)} registers, the layout has "
                + ("none" if address is None else f"{PART_HEADER_REGISTERS} to {room}")
            )
        return address

    def _check_payload_length(self, payload_length: int) -> None:
        capacity = self._layout.payload_capacity
        if not 0 <= payload_length <= capacity:
            raise MailboxError(f"a payload of {payload_length} registers, payload_capacity is {capacity}")


def _stream_of(registers: Sequence[int]) -> bytes:
    """Registers as they go on the wire; raise MailboxError where they are none."""
    try:
        return stream_of(registers)
    except struct.error as error:
        raise MailboxError(
            f"the page holds what is no register of 16 bits ({error}). Was it stored or changed by another program?"
        ) from error


class ModbusTcpController(ModbusController):
    """Over Modbus TCP."""

    def __init__(
        self,
        host: str,
        port: int = 502,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        timeout_s: float = 1.0,
        limits: RequestLimits | None = None,
        single_write: SingleWrite = "fc6",
    ) -> None:
        super().__init__(TcpTransport(host, port), device_id, layout, timeout_s, limits, single_write)


class ModbusRtuController(ModbusController):
    """Over Modbus RTU on a serial port of this machine; timeout_s counts from when the request has gone out."""

    def __init__(
        self,
        line: SerialLine,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        timeout_s: float = 1.0,
        limits: RequestLimits | None = None,
        single_write: SingleWrite = "fc6",
    ) -> None:
        super().__init__(RtuTransport(line), device_id, layout, timeout_s, limits, single_write)


class ModbusRtuOverTcpController(ModbusController):
    """Over RTU frames through a TCP serial server; baudrate is that of the line behind it."""

    def __init__(
        self,
        host: str,
        port: int = 4001,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        timeout_s: float = 1.0,
        limits: RequestLimits | None = None,
        single_write: SingleWrite = "fc6",
        baudrate: int = 9600,
    ) -> None:
        super().__init__(RtuOverTcpTransport(host, port, baudrate), device_id, layout, timeout_s, limits, single_write)
