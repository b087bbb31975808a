"""The controller over Modbus TCP: one attempt a call. Reconnecting, repeating and waiting are the caller's."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence

from pymodbus.client import AsyncModbusTcpClient
from pymodbus.exceptions import ModbusException, ModbusIOException
from pymodbus.pdu import ModbusPDU

from drivers.controller.chunks import LONGEST_READ, LONGEST_WRITE, PAYLOAD_OFFSET, page_starts, spans
from drivers.controller.errors import (
    ControllerError,
    ControllerNonsense,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
    MailboxError,
)
from drivers.controller.library_log import cap_library_log
from drivers.controller.mailbox import (
    BLOCK_REGISTERS,
    HEADER_REGISTERS,
    LinkBlock,
    MailboxLayout,
    Page,
    ServiceBlock,
    decode_link,
    decode_service,
    encode_service,
)
from drivers.controller.replies import is_complete_tcp

__all__ = ["MailboxLayout", "ModbusTcpController"]

Send = Callable[[AsyncModbusTcpClient], Awaitable[ModbusPDU]]

EXCEPTION_NAMES = {
    1: "illegal function",
    2: "illegal data address",
    3: "illegal data value",
    4: "server device failure",
    5: "acknowledge: it goes on working at it",
    6: "server device busy",
    8: "memory parity error",
    10: "gateway path unavailable",
    11: "gateway target device did not respond",
}
NEXT_STEPS = {
    1: "The controller must know function codes 3, 6 and 16",
    2: "Check link_address, service_address, contour_address and payload_capacity",
    3: "Check payload_capacity, and the controller's limit of registers in one request",
    10: "Check the gateway and device_id",
    11: "Check the gateway, the line behind it, and device_id",
}
MAY_BE_DONE_LATER = (5, 11)  # these say that the request went on its way, not that it was refused


class Connection:
    """One TCP connection: requests one after the other, and the first fault ends it for good."""

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.name = f"{host}:{port}"
        self.fault: ControllerUnavailable | None = None
        self._timeout_s = timeout_s
        self._sent = b""
        self._pending = False
        self._client = AsyncModbusTcpClient(
            host,
            port=port,
            timeout=timeout_s,
            retries=0,  # the library re-sends writes, also on a new connection
            reconnect_delay=0,
            trace_packet=self._watch,
            trace_connect=self._told_of_connection,
        )

    async def open(self) -> None:
        """Connect; raise ControllerUnavailable."""
        next_step = "Check that the controller is on, the cable, host and port"
        try:
            async with asyncio.timeout(self._timeout_s):
                # What the client's own connect() awaits; that one turns the reason into a log line.
                await self._client.ctx.call_create()
        except TimeoutError as error:
            raise ControllerUnavailable(f"{self.name}: no connection in {self._timeout_s:g} s. {next_step}") from error
        except (OSError, UnicodeError) as error:
            raise ControllerUnavailable(f"{self.name}: no connection: {error}. {next_step}") from error

    def end(self, fault: ControllerUnavailable) -> None:
        """Close, and let the pending request fail with `fault`; the first fault stays."""
        if self.fault is not None:
            return
        self.fault = fault
        self._client.close()
        waiting = self._client.ctx.response_future
        if self._pending and not waiting.done():  # the library lets it wait out its whole time
            waiting.set_exception(fault)

    async def execute(self, send: Send, what: str) -> ModbusPDU:
        """The reply to one request, known to match it; raise ControllerRefused or ControllerUnavailable."""
        if self.fault is not None:
            raise type(self.fault)(str(self.fault))
        self._pending = True
        try:
            reply = await self._uncancelled(send)
        except asyncio.CancelledError:
            self.end(ControllerUnavailable(f"{self.name}: {what} was cancelled on its way, its reply may still come"))
            raise
        except ModbusIOException as error:
            raise self._ended(ControllerTimeout(self._no_reply(what))) from error
        except (ModbusException, OSError) as error:
            raise self._ended(ControllerUnavailable(f"{self.name}: {what} failed: {error}")) from error
        finally:
            self._pending = False
        if reply.isError():
            raise self._refusal(reply.exception_code, what)
        return reply

    async def _uncancelled(self, send: Send) -> ModbusPDU:
        """The reply; asyncio.CancelledError even where Python 3.11's wait_for prefers a reply of the same moment."""
        task = asyncio.current_task()
        before = task.cancelling() if task else 0
        reply = await send(self._client)
        if task and task.cancelling() > before:
            raise asyncio.CancelledError
        return reply

    def _ended(self, fault: ControllerUnavailable) -> ControllerUnavailable:
        self.end(fault)
        return fault

    def _no_reply(self, what: str) -> str:
        return (
            f"{self.name}: no reply to {what} in {self._timeout_s:g} s. "
            "Check device_id, whether the controller runs, and timeout_s"
        )

    def _refusal(self, code: int, what: str) -> ControllerError:
        name = EXCEPTION_NAMES.get(code, "not a code of the standard")
        text = f"{self.name} answered {what} with exception {code} ({name})"
        if code in NEXT_STEPS:
            text += f". {NEXT_STEPS[code]}"
        if code in MAY_BE_DONE_LATER:
            return self._ended(ControllerTimeout(text))
        return ControllerRefused(text, code)

    def _watch(self, sending: bool, data: bytes) -> bytes:
        """The library's hook for each packet: `data` is what is sent, or all that came since."""
        if sending:
            self._sent = data
            return data
        try:
            if is_complete_tcp(self._sent, data):
                self._sent = b""
        except ControllerNonsense as error:
            self.end(ControllerNonsense(f"{self.name}: {error}. Check what listens there, and for a second client"))
            return b""
        return data

    def _told_of_connection(self, up: bool) -> None:
        """The library's hook for a connection made, or lost through the other side."""
        if not up:
            self.end(ControllerUnavailable(f"{self.name}: the controller closed the connection"))


class ModbusTcpController:
    """The Controller role over Modbus TCP; see `Controller` for what is raised."""

    def __init__(
        self,
        host: str,
        port: int = 502,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        timeout_s: float = 1.0,
    ) -> None:
        if not 1 <= device_id <= 255:
            raise MailboxError(
                f"device_id is {device_id}, expected 1 to 255 (0 is a broadcast, which is never answered)"
            )
        cap_library_log()
        self._host = host
        self._port = port
        self._device_id = device_id
        self._layout = layout or MailboxLayout()
        self._timeout_s = timeout_s
        self._turn = asyncio.Lock()
        self._connection: Connection | None = None
        self._closings = 0

    def __str__(self) -> str:
        return f"{self._host}:{self._port} device {self._device_id}"

    @property
    def connected(self) -> bool:
        """True while requests can be tried."""
        return self._connection is not None and self._connection.fault is None

    async def connect(self) -> None:
        """Open a new connection, closing an old one first; raise ControllerUnavailable."""
        async with self._turn:  # two at once would leak a socket
            self._drop("replaced by a new connection")
            closings = self._closings
            connection = Connection(self._host, self._port, self._timeout_s)
            await connection.open()
            if closings != self._closings:
                connection.end(ControllerUnavailable("closed"))
                raise ControllerUnavailable(f"{self._host}:{self._port}: closed while connecting")
            self._connection = connection

    async def close(self) -> None:
        """Close the connection; never raises."""
        self._closings += 1
        self._drop("closed by this side")
        await asyncio.sleep(0)  # the socket closes in the loop's next round

    async def read_link(self) -> LinkBlock:
        """The controller's block, one FC3 of 16 registers."""
        registers = await self._read(self._held(), self._layout.link_address, BLOCK_REGISTERS)
        return decode_link(registers, self._layout.word_order)

    async def read_service(self) -> ServiceBlock:
        """The service's own block as the controller holds it, one FC3 of 16 registers."""
        registers = await self._read(self._held(), self._layout.service_address, BLOCK_REGISTERS)
        return decode_service(registers, self._layout.word_order)

    async def write_service(self, block: ServiceBlock) -> None:
        """Write the service's block whole, one FC16."""
        registers = encode_service(block, self._layout.word_order)
        await self._write(self._held(), self._layout.service_address, registers)

    async def write_transfer(self, transfer: int) -> None:
        """Write the commit register alone, FC6."""
        if not 0 <= transfer <= 0xFFFF:
            raise MailboxError(f"transfer is {transfer}, expected 0 to 65535")
        address = self._layout.contour_address
        await self._execute(
            self._held(),
            lambda client: client.write_register(address, transfer, device_id=self._device_id),
            f"FC6 of register {_people(address, 1)}",
        )

    async def write_page(self, page: Page) -> None:
        """Write payload and header without the commit register, in as few FC16 as the limit allows."""
        self._check_page(page)
        connection = self._held()
        registers = (*page.header, *page.payload)
        for offset, count in spans(page_starts(page.header, len(page.payload)), LONGEST_WRITE):
            await self._write(
                connection, self._layout.contour_address + offset, registers[offset - 1 : offset - 1 + count]
            )

    async def read_page(self, payload_length: int) -> Page:
        """Read header without the commit register and `payload_length` registers of payload back."""
        self._check_payload_length(payload_length)
        connection = self._held()
        contour = self._layout.contour_address
        header = await self._read(connection, contour + 1, HEADER_REGISTERS)
        payload: list[int] = []
        starts = [start for start in page_starts(header, payload_length) if start >= PAYLOAD_OFFSET]
        for offset, count in spans(starts, LONGEST_READ):
            payload += await self._read(connection, contour + offset, count)
        return Page(tuple(header), tuple(payload))

    async def _read(self, connection: Connection, address: int, count: int) -> list[int]:
        reply = await self._execute(
            connection,
            lambda client: client.read_holding_registers(address, count=count, device_id=self._device_id),
            f"FC3 of registers {_people(address, count)}",
        )
        return list(reply.registers)

    async def _write(self, connection: Connection, address: int, registers: Sequence[int]) -> None:
        await self._execute(
            connection,
            lambda client: client.write_registers(address, list(registers), device_id=self._device_id),
            f"FC16 of registers {_people(address, len(registers))}",
        )

    async def _execute(self, connection: Connection, send: Send, what: str) -> ModbusPDU:
        """One request in its turn; never on another connection than the one its caller began on."""
        async with self._turn:
            return await connection.execute(send, what)

    def _held(self) -> Connection:
        if self._connection is None:
            raise ControllerUnavailable(f"{self._host}:{self._port}: not connected. Connect first")
        return self._connection

    def _drop(self, why: str) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.end(ControllerUnavailable(f"{connection.name}: {why}"))

    def _check_page(self, page: Page) -> None:
        if len(page.header) != HEADER_REGISTERS:
            raise MailboxError(f"the page's header has {len(page.header)} registers, expected {HEADER_REGISTERS}")
        self._check_payload_length(len(page.payload))
        if not all(0 <= register <= 0xFFFF for register in (*page.header, *page.payload)):
            raise MailboxError("the page holds a register beyond 16 bits. Was it stored or changed by another program?")

    def _check_payload_length(self, payload_length: int) -> None:
        capacity = self._layout.payload_capacity
        if not 0 <= payload_length <= capacity:
            raise MailboxError(f"a payload of {payload_length} registers, payload_capacity is {capacity}")


def _people(address: int, count: int) -> str:
    """Registers by PDU address, with the 4xxxxx form that PLC programmers use beside it."""
    if count == 1:
        return f"{address} ({400001 + address})"
    return f"{address} to {address + count - 1} ({400001 + address} to {400000 + address + count})"
