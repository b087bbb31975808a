"""A simulated cutting machine's controller: a Modbus server that does what the protocol says that a controller does.

Written from the protocol's text with its own page assembly; of the codec it knows only where the blocks lie.

What it does not model:
- scans and requests are atomic to each other: a block of one request is never seen half written, so neither torn pages
  nor a torn link block come about by themselves (a proxy that delays or drops requests brings about the rest);
- pages are copied and checked within one scan, however long they are;
- nothing is cut: the machine is busy only when `set_state` says so, and limits of travel are not known to it;
- retained memory outlives a killed process, not a power cut in the midst of a disk write;
- on a serial line no connection is seen, so heartbeats are not judged there, and line errors do not happen.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.pdu import ModbusPDU
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.controller.errors import ControllerError, ControllerUnavailable
from drivers.controller.layout import REGISTERS, MailboxLayout
from drivers.controller.library_log import cap_library_log
from drivers.controller.simulated_contour import AcceptedContour
from drivers.controller.simulated_memory import RetainedMemory
from drivers.controller.simulated_program import (
    ControllerProgram,
    Judge,
    TriggerNotPossible,
    judge_by_geometry,
)
from drivers.controller.simulated_verdict import Verdict
from drivers.controller.simulated_watch import LONGEST_WRITE, ClientWatch

__all__ = ["AcceptedContour", "SimulatedController", "TriggerNotPossible", "Verdict"]

KNOWN_FUNCTIONS = (3, 6, 16)
Server = ModbusTcpServer | ModbusSerialServer


class SimulatedController:
    """A controller on a real socket (or, by `on_serial`, on a serial line), from `start` to `stop`.

    host, port: where it listens; port 0 takes a free one, told by `port`.
    scan_s: period of the program's scan.
    session_source: the session of each start; by default a retained counter, begun at random where there is none.
    memory_path: where last answer and session counter outlive the process; None: they live as long as this object.
    has_clock: False: `clock` stays 0 for ever.
    judge: 1 accepted, 4 geometry refused or 7 operator refused, for a contour that is otherwise in order.
    on_accepted: gets each accepted contour once, after it is in memory. Killed between the two, the next start hands
        the contour on; killed right after it, that start hands it on again: who must not act twice keeps the job_id.
    """

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        scan_s: float = 0.01,
        session_source: Callable[[], int] | None = None,
        memory_path: Path | None = None,
        has_clock: bool = True,
        judge: Judge = judge_by_geometry,
        on_accepted: Callable[[AcceptedContour], None] = lambda contour: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        cap_library_log()
        self.verdict = Verdict()
        self.judge = judge
        self._host = host
        self._port = port
        self._serial: tuple[str, int] | None = None
        self._device_id = device_id
        self._layout = layout or MailboxLayout()
        self._scan_s = scan_s
        self._memory = RetainedMemory(memory_path)
        self._session_source = session_source or self._memory.count_session
        self._has_clock = has_clock
        self._on_accepted = on_accepted
        self._now = now
        self._registers = [0] * REGISTERS
        self._watch = ClientWatch(self._layout, self.verdict)
        self._program = self._new_program()
        self._run_since = 0.0
        self._halted = False
        self._server: Server | None = None
        self._scanning: asyncio.Task[None] | None = None

    @classmethod
    def on_serial(cls, port: str, baudrate: int = 115200, **options: Any) -> SimulatedController:
        """The same on serial port `port`: Modbus RTU, 8N1. options: as of the class, but for host and port."""
        controller = cls(**options)
        controller._serial = (port, baudrate)
        return controller

    # --- running ------------------------------------------------------------------------------------------------

    async def __aenter__(self) -> SimulatedController:
        await self.start()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        await self.stop()

    @property
    def port(self) -> int:
        """The TCP port that it listens on."""
        sockets = getattr(self._server.transport, "sockets", ()) if self._server is not None else ()
        if not sockets:
            raise ControllerError("the simulated controller does not listen on TCP now. Start it first")
        return int(sockets[0].getsockname()[1])

    async def start(self) -> None:
        """Listen and run the program; raise ControllerUnavailable where the address cannot be had."""
        if self._server is not None:
            raise ControllerError("the simulated controller runs already. Stop it first")
        self._hand_on(self._memory.undelivered)
        server = self._new_server()
        try:
            await server.serve_forever(background=True)
        except RuntimeError as error:  # the library turns every reason into this one
            raise ControllerUnavailable(
                f"cannot serve on {self._where()}. Check that it exists here, is free, and may be used"
            ) from error
        self._server = server
        self._run_since = self._now()
        self._scanning = asyncio.create_task(self._scan_for_ever(), name="simulated controller")

    async def stop(self) -> None:
        """Stop the program and close every connection; nothing is left open. An error of `on_accepted` is raised."""
        server, self._server = self._server, None
        scanning, self._scanning = self._scanning, None
        if server is not None:
            await server.shutdown()  # type: ignore[no-untyped-call]
        if scanning is not None:
            scanning.cancel()
            await asyncio.wait([scanning])
            if not scanning.cancelled() and (error := scanning.exception()):
                raise error
        await asyncio.sleep(0)  # sockets close in the loop's next round

    async def wait(self) -> None:
        """Wait until the program ends, which it does by an error of `on_accepted` or of the memory file: raised."""
        if self._scanning is not None:
            await asyncio.shield(self._scanning)

    def halt(self) -> None:
        """Stop scanning; the registers stay readable and writable, as those of a PLC in STOP."""
        self._halted = True

    def restart(self, *, keep_registers: bool = False, forget: bool = False) -> None:
        """Start the program anew, with a new session. forget: its memory was lost."""
        if forget:
            self._memory.forget()
        if not keep_registers:
            self._registers[:] = [0] * REGISTERS
        self._program = self._new_program()
        self._run_since = self._now()
        self._halted = False

    # --- the person and the machine -----------------------------------------------------------------------------

    def set_state(self, state: int) -> None:
        """Set `controller_state`: 0 not ready, 1 ready, 2 busy, 3 fault; readable from the next scan on."""
        self._program.state = state

    def request_measurement(self, recipe: int = 0, thickness_um: int = 0, *, force: bool = False) -> int:
        """Trigger a measurement and return the new `trigger_counter`; see ControllerProgram.request_measurement."""
        return self._program.request_measurement(recipe, thickness_um, force=force)

    @property
    def can_request(self) -> bool:
        """True while the protocol lets the controller request a measurement."""
        return not self._halted and self._program.can_request

    @property
    def trigger_open(self) -> bool:
        """True while a trigger of its own waits for its contour."""
        return self._program.trigger_open

    def registers(self, address: int, count: int) -> tuple[int, ...]:
        """Holding registers as they stand now, by PDU address."""
        return tuple(self._registers[address : address + count])

    # --- inside -------------------------------------------------------------------------------------------------

    def _new_program(self) -> ControllerProgram:
        return ControllerProgram(
            self._registers,
            self._layout,
            self._memory,
            self._watch,
            new_session=self._session_source,
            judge=self._judged,
            has_clock=self._has_clock,
        )

    def _judged(self, contour: AcceptedContour) -> int:
        return self.judge(contour)

    async def _scan_for_ever(self) -> None:
        while True:
            if not self._halted:
                self._scan()
            await asyncio.sleep(self._scan_s)

    def _scan(self) -> None:
        now = self._now()
        program = self._program
        contour = program.scan(int((now - self._run_since) * 1000))
        self._watch.tick(now)
        for _, answer in program.answered:
            self.verdict.answers[answer] += 1
        program.answered.clear()
        if contour is not None:
            self.verdict.accepted += 1
            self._hand_on(contour)

    def _hand_on(self, contour: AcceptedContour | None) -> None:
        if contour is not None:
            self._on_accepted(contour)
            self._memory.delivered()

    def _where(self) -> str:
        return f"{self._host}:{self._port}" if self._serial is None else f"serial port {self._serial[0]}"

    def _new_server(self) -> Server:
        devices = [
            _device(self._device_id, self._serve),
            _device(0, _serve_nobody),  # every other device id
        ]
        if self._serial is None:
            return ModbusTcpServer(
                devices,
                address=(self._host, self._port),
                trace_pdu=self._look_at_request,
                trace_connect=self._watch.connection,
            )
        port, baudrate = self._serial
        return ModbusSerialServer(
            devices,
            port=port,
            baudrate=baudrate,
            ignore_missing_devices=True,  # other devices on the line answer for themselves
            trace_pdu=self._look_at_request,
        )

    def _look_at_request(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """The library's hook for each message; over-long writes never come as far as `_serve`."""
        if not sending and pdu.function_code == 16 and pdu.count > LONGEST_WRITE:
            self._watch.too_long(pdu.address, pdu.count)
        return pdu

    async def _serve(
        self,
        function_code: int,
        start_address: int,
        address: int,
        count: int,
        shown: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """The library's hook for each request, before it looks into its own store: ours is the one that counts."""
        if function_code not in KNOWN_FUNCTIONS:
            self._watch.foreign_function(function_code)
            return ExcCodes.ILLEGAL_FUNCTION
        if values is None:
            if not any(start <= address and address + count <= end for start, end in self._readable()):
                return ExcCodes.ILLEGAL_ADDRESS
            offset = address - start_address
            shown[offset : offset + count] = self._registers[address : address + count]
            return None
        if not self._watch.write(function_code, address, values, self._registers, self._now()):
            return ExcCodes.ILLEGAL_ADDRESS
        self._registers[address : address + count] = values
        return None

    def _readable(self) -> list[tuple[int, int]]:
        """Ranges that one request may read: the blocks, joined where they touch."""
        joined: list[tuple[int, int]] = []
        for start, end in sorted(self._layout.blocks.values()):
            if joined and joined[-1][1] == start:
                joined[-1] = (joined[-1][0], end)
            else:
                joined.append((start, end))
        return joined


Action = Callable[[int, int, int, int, list[int], list[int] | list[bool] | None], Awaitable[ExcCodes | None]]


def _device(device_id: int, action: Action) -> SimDevice:
    store = SimData(0, count=REGISTERS, values=0, datatype=DataType.REGISTERS)
    return SimDevice(device_id, simdata=[store], action=action)  # type: ignore[arg-type]


async def _serve_nobody(
    function_code: int, start: int, address: int, count: int, shown: list[int], values: list[int] | list[bool] | None
) -> ExcCodes | None:
    raise NoSuchIdException("no device of this id")
