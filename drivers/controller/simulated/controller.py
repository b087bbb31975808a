"""A simulated cutting machine's controller: a Modbus server that does what the protocol says that a controller does.

Written from the protocol's text with its own page assembly; of the codec it knows only where the blocks lie.

What it does not model:
- scans and requests are atomic to each other: what one request writes is never seen half written (a page of several
  requests is; `Pace` makes copies of it that are torn, and tears the link block's 32-bit values);
- nothing is cut: the machine is busy only when it is told so, and limits of travel are not known to it;
- retained memory outlives a killed process, not a power cut in the midst of a disk write;
- on a serial line no connection is seen, so heartbeats are not judged there; bytes are paced by the port alone, frames
  are told apart by their length and by 20 ms of silence, and parity, framing errors and echoes do not happen.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from drivers.controller.errors import ControllerError
from drivers.controller.mailbox.layout import REGISTERS, MailboxLayout
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.faults import FaultPlan, LineFault, targets_of
from drivers.controller.simulated.memory import RetainedMemory
from drivers.controller.simulated.program import (
    ControllerProgram,
    Judge,
    Pace,
    ProgramStart,
    TriggerNotPossible,
    judge_by_geometry,
)
from drivers.controller.simulated.received import FramingName, ReceivedRequest
from drivers.controller.simulated.server import RegisterServer
from drivers.controller.simulated.verdict import Verdict
from drivers.controller.simulated.watch import ClientWatch
from drivers.controller.simulated.window import RegisterWindow, ServerLimits

NO_SUCH_DEVICE = 11  # exception: gateway target device did not respond

__all__ = [
    "AcceptedContour",
    "FaultPlan",
    "Pace",
    "ServerLimits",
    "SimulatedController",
    "TriggerNotPossible",
    "Verdict",
]


class SimulatedController:
    """A controller on a real socket (or, by `on_serial`, on a serial line), from `start` to `stop`.

    host, port: where it listens; port 0 takes a free one, told by `port`.
    framing: "tcp" for Modbus TCP, "rtu" for RTU frames over TCP, as a serial server hands them on.
    scan_s: period of the program's scan.
    first_trigger: the first `trigger_counter` of a session. clock_start_ms: `clock` at the program's start.
    session_source: the session of each start; by default a retained counter, begun at random where there is none.
    memory_path: where last answer and session counter outlive the process; None: they live as long as this object.
    has_clock: False: `clock` stays 0 for ever.
    judge: 1 accepted, 4 geometry refused or 7 operator refused, for a contour that is otherwise in order.
    faults: what befalls which requests.
    pace: how many scans it takes for a page.
    limits: what its server takes.
    on_accepted: gets each accepted contour once, after it is in memory. Killed between the two, the next start hands
        the contour on; killed right after it, that start hands it on again: who must not act twice keeps the job_id.
    """

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        framing: FramingName = "tcp",
        device_id: int = 1,
        layout: MailboxLayout | None = None,
        scan_s: float = 0.01,
        session_source: Callable[[], int] | None = None,
        memory_path: Path | None = None,
        has_clock: bool = True,
        clock_start_ms: int = 0,
        first_trigger: int = 1,
        judge: Judge = judge_by_geometry,
        faults: FaultPlan | None = None,
        pace: Pace | None = None,
        limits: ServerLimits | None = None,
        on_accepted: Callable[[AcceptedContour], None] = lambda contour: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.verdict = Verdict()
        self.judge = judge
        self.faults = faults or FaultPlan()
        self.pace = pace or Pace()
        self.scan_s = scan_s
        self._framing: FramingName = framing
        self._host = host
        self._port = self._used_port = port
        self._serial: tuple[str, int] | None = None
        self._limits = limits or ServerLimits()
        self._device_id = device_id if self._limits.answer_as is None else self._limits.answer_as
        self._layout = layout or MailboxLayout()
        self._memory = RetainedMemory(memory_path)
        self._session_source = session_source or self._memory.count_session
        self._has_clock = has_clock
        self._clock_start_ms = clock_start_ms
        self._first_trigger = first_trigger
        self._on_accepted = on_accepted
        self._now = now
        self._registers = [0] * REGISTERS
        self._watch = ClientWatch(self._layout, self.verdict, write_single=self._limits.write_single)
        self._window = RegisterWindow(self._registers, self._layout, self._watch, self._limits)
        self._program = self._new_program()
        self._run_since = self._began = 0.0
        self._halted = False
        self._server: RegisterServer | None = None
        self._scanning: asyncio.Task[None] | None = None

    @classmethod
    def on_serial(cls, port: str, baudrate: int = 115200, **options: Any) -> SimulatedController:
        """The same on serial port `port`: Modbus RTU, 8N1. options: as of the class, but for host, port and framing."""
        controller = cls(framing="rtu", **options)
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
        port = self._server.port if self._server is not None else None
        if port is None:
            raise ControllerError("the simulated controller does not listen on TCP now. Start it first")
        return port

    async def start(self) -> None:
        """Listen and run the program; raise ControllerUnavailable where the address cannot be had."""
        if self._server is not None:
            raise ControllerError("the simulated controller runs already. Stop it first")
        self._hand_on(self._memory.undelivered)
        server = RegisterServer(self, self._framing, self.faults)
        await self._listen(server, self._port)
        self._server = server
        self._began = self._now()
        self._run_since = self._now()
        self._scanning = asyncio.create_task(self._scan_for_ever(), name="simulated controller")

    async def unplug(self) -> None:
        """Cut the line: connections end, nobody can connect; the program goes on."""
        if self._server is not None:
            self._used_port = self._server.port or self._used_port
            await self._server.stop()

    async def plug_in(self) -> None:
        """Serve again where it did; raise ControllerUnavailable."""
        if self._server is not None:  # else it was stopped for good meanwhile
            await self._listen(self._server, self._used_port)

    async def switch_off(self) -> None:
        """Listen no more and stand still, as without power."""
        self._halted = True
        await self.unplug()

    async def switch_on(self) -> None:
        """Power is back: listen where it did, and start the program anew; raise ControllerUnavailable."""
        await self.plug_in()
        self.restart()

    async def _listen(self, server: RegisterServer, port: int) -> None:
        if self._serial is None:
            await server.listen(self._host, port)
        else:
            await server.open_line(*self._serial)

    async def stop(self) -> None:
        """Stop the program and close every connection; nothing is left open. An error of `on_accepted` is raised."""
        server, self._server = self._server, None
        scanning, self._scanning = self._scanning, None
        if server is not None:
            await server.stop()
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
        counter = self._program.request_measurement(recipe, thickness_um, force=force)
        self._watch.issued(self._program.session, counter)
        self.verdict.tell("trigger", session=self._program.session, trigger=counter, recipe=recipe)
        return counter

    def write_as_another(self, owner: int, heartbeat: int) -> None:
        """Write `owner` and `service_heartbeat` as another service would; the verdict is not told."""
        start = self._layout.service_address
        self._registers[start + 11], self._registers[start + 2] = owner, heartbeat

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
        start = ProgramStart(
            self._session_source, self._judged, self._has_clock, self._clock_start_ms, self._first_trigger
        )
        return ControllerProgram(self._registers, self._layout, self._memory, self._watch, start, self.pace)

    def _judged(self, contour: AcceptedContour) -> int:
        return self.judge(contour)

    async def _scan_for_ever(self) -> None:
        while True:
            if not self._halted:
                self._scan()
            await asyncio.sleep(self.scan_s)

    def _scan(self) -> None:
        now = self._now()
        program = self._program
        session = program.session
        contour = program.scan(int((now - self._run_since) * 1000))
        if program.session != session:
            self.verdict.tell("session", session=program.session)
        self._watch.tick(now, *self._window.trigger)
        for copy, answer in program.answered:
            self.verdict.answers[answer] += 1
            self.verdict.tell(
                "answer",
                job=copy.job_id,
                page=copy.page,
                layout=copy.layout,
                answer=int(answer),
                session=program.session,
                trigger=copy.trigger,
                whole=contour is not None,
            )
        program.answered.clear()
        if contour is not None:
            self.verdict.accepted += 1
            self._hand_on(contour)

    def _hand_on(self, contour: AcceptedContour | None) -> None:
        if contour is not None:
            self._on_accepted(contour)
            self._memory.delivered()

    # --- what the server asks -----------------------------------------------------------------------------------

    def addressed(self, request: ReceivedRequest) -> ReceivedRequest:
        """The request as to the device whose number its reply carries."""
        return request if self._limits.answer_as is None else replace(request, unit=self._limits.answer_as)

    def answer(self, request: ReceivedRequest) -> bytes | None:
        """The PDU of the reply to a request; None where it is for another device on a line."""
        if request.unit != self._device_id:
            return None if self._framing == "rtu" else bytes([request.pdu[0] | 0x80, NO_SUCH_DEVICE])
        self.verdict.requests += 1
        return self._window.answer(request.pdu, self._now())

    def answer_late(self, request: ReceivedRequest) -> None:
        """Do a write that the line or the server kept back: none of the client's doing, so nobody judges it."""
        self._window.store_late(request.pdu)

    def strike(self, request: ReceivedRequest) -> LineFault | None:
        """The fault that befalls the request."""
        if request.unit != self._device_id:
            return None
        fault = self.faults.strike(targets_of(request.pdu, self._layout), self._now() - self._began)
        if fault is not None:
            self.verdict.faults[fault.name] += 1
            self.verdict.tell("fault", kind=fault.name, request=request.pdu[:5].hex(" "))
            self._watch.excuse()
        return fault

    def unanswered(self, request: ReceivedRequest) -> None:
        """The request's reply never leaves."""
        self._watch.unanswered(request.pdu[0], int.from_bytes(request.pdu[1:3], "big"))

    def too_early(self, request: ReceivedRequest) -> None:
        """The request came on a connection that owes a reply."""
        self._watch.too_early(request.pdu[0])

    def connection(self, up: bool) -> None:
        """A client came or went."""
        self._watch.connection(up)
