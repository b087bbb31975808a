"""The simulated controller's dealing with requests of one connection or line: done, befallen by faults, answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Protocol

from pymodbus.framer import FramerBase, FramerRTU

from drivers.controller.simulated.faults import FaultPlan, LineFault, foreign
from drivers.controller.simulated.received import READ, ReceivedRequest


class Device(Protocol):
    """What stands behind the server."""

    def answer(self, request: ReceivedRequest) -> bytes | None:
        """Do the request; the PDU of its reply, None where it is for another device on the line."""

    def addressed(self, request: ReceivedRequest) -> ReceivedRequest:
        """The request as to the device whose number its reply carries."""

    def answer_late(self, request: ReceivedRequest) -> None:
        """Do a write long after its client gave it up."""

    def strike(self, request: ReceivedRequest) -> LineFault | None:
        """The fault that befalls the request."""

    def unanswered(self, request: ReceivedRequest) -> None:
        """The request's reply never leaves."""

    def too_early(self, request: ReceivedRequest) -> None:
        """The request came on a connection on which the reply to the one before has not been sent."""

    def connection(self, up: bool) -> None:
        """A client came or went."""


class Outlet:
    """Where replies leave. On a serial line, or a serial server's, they leave in order, to whoever listens by then.

    late: hold a frame back, and on a line all that follow it, for so long.
    """

    def __init__(self, in_order: bool, later: Callable[[float, Callable[[], None]], None]) -> None:
        self._in_order = in_order
        self._later = later
        self._held: deque[bytes] = deque()
        self._listener: Callable[[bytes], None] = lambda _frame: None

    def forget(self) -> None:
        """Drop what is held back: the server has stopped."""
        self._held.clear()

    def listen(self, send: Callable[[bytes], None]) -> None:
        """From here on replies go to `send`."""
        self._listener = send

    def send(self, frame: bytes) -> None:
        """Send a frame, behind those that are held back."""
        if self._held:
            self._held.append(frame)
        else:
            self._listener(frame)

    def late(self, seconds: float, frame: bytes, sent: Callable[[], None]) -> None:
        """Send a frame so much later; `sent` is called then."""

        def release() -> None:
            sent()
            if not self._in_order:
                self._listener(frame)
                return
            held, self._held = self._held, deque()
            for waiting in held:
                self._listener(waiting)

        if self._held:  # it waits behind another late one as it is
            self._held.append(frame)
            sent()
            return
        if self._in_order:
            self._held.append(frame)
        self._later(seconds, release)


class Exchange:
    """Requests of one connection or line: done in order, befallen by faults, answered through `send`."""

    def __init__(
        self,
        device: Device,
        framer: FramerBase,
        faults: FaultPlan,
        later: Callable[[float, Callable[[], None]], None],
        *,
        outlet: Outlet,
        reset: Callable[[], None] | None,
    ) -> None:
        self._device = device
        self._serial_frames = isinstance(framer, FramerRTU)
        self._framer = framer
        self._faults = faults
        self._later = later
        self._outlet = outlet
        self._send = outlet.send
        self._reset = reset
        self._dead = False
        self._waiting = 0  # requests whose reply has not left

    def receive(self, received: ReceivedRequest) -> None:
        """Take a request."""
        if self._dead:
            return
        request = self._device.addressed(received)
        if self._waiting and self._reset is not None:
            self._device.too_early(request)
        fault = self._device.strike(request)
        if fault is None:
            self._reply(request, self._device.answer(request))
        else:
            self._befall(fault, request)

    def _reply(self, request: ReceivedRequest, pdu: bytes | None) -> None:
        if pdu is not None:
            self._send(self._frame(request, pdu))

    def _frame(self, request: ReceivedRequest, pdu: bytes) -> bytes:
        return self._framer.encode(pdu, request.unit, request.transaction)

    # --- faults -------------------------------------------------------------------------------------------------

    def _befall(self, fault: LineFault, request: ReceivedRequest) -> None:
        kind = fault.kind
        if kind in ("garbled-request", "garbled-reply") and not self._serial_frames:
            kind = "lost-request" if kind == "garbled-request" else "lost-reply"
        if kind in ("reset-before", "reset-after") and self._reset is None:
            kind = "lost-request" if kind == "reset-before" else "lost-reply"
        if kind == "exception":
            self._refuse(fault, request)
        elif kind in ("lost-request", "garbled-request", "reset-before", "half-open"):
            self._lose(request)
            if kind == "half-open":
                self._die(fault.delay_s)
        elif kind == "late-write":
            self._lose(request)
            if request.pdu[0] != READ:
                self._later(fault.delay_s, lambda: self._device.answer_late(request))
        else:
            self._spoil_reply(kind, fault, request, self._device.answer(request))
        if kind in ("reset-before", "reset-after") and self._reset is not None:
            self._reset()

    def _spoil_reply(self, kind: str, fault: LineFault, request: ReceivedRequest, pdu: bytes | None) -> None:
        if pdu is None:
            return
        frame = self._frame(request, pdu)
        if kind in ("lost-reply", "reset-after"):
            self._lose(request)
        elif kind == "garbled-reply":
            self._lose(request)
            self._send(self._faults.garbled(frame))
        elif kind == "foreign-reply":
            self._lose(request)
            self._send(self._frame(request, foreign(pdu)))
        elif kind == "repeated-reply":
            self._send(frame)
            # On a line, where replies keep their order, the copy follows at once.
            self._later(0.0 if self._serial_frames else fault.delay_s, lambda: self._send(frame))
        else:
            self._waiting += 1
            self._outlet.late(fault.delay_s, frame, self._sent_late)

    def _sent_late(self) -> None:
        self._waiting -= 1

    def _refuse(self, fault: LineFault, request: ReceivedRequest) -> None:
        self._send(self._frame(request, bytes([request.pdu[0] | 0x80, fault.code])))
        if fault.code == 5 and request.pdu[0] != READ:
            self._device.unanswered(request)
            self._later(fault.delay_s, lambda: self._device.answer_late(request))

    def _lose(self, request: ReceivedRequest) -> None:
        self._waiting += 1
        self._device.unanswered(request)

    def _die(self, seconds: float) -> None:
        self._dead = True
        if self._reset is None:  # a serial line comes back by itself
            self._later(seconds, self._revive)

    def _revive(self) -> None:
        self._dead = False
