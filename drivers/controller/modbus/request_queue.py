"""One connection to the controller: requests one after the other, and the first fault ends it for good."""

from __future__ import annotations

import asyncio
import copy
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from drivers.controller.errors import (
    ControllerError,
    ControllerNonsense,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
)
from drivers.controller.modbus.byte_channel import ByteChannel
from drivers.controller.modbus.reply_waiting import WAIT_S, InPlaceWaiting
from drivers.controller.modbus.requests import EXCEPTION, READ_REGISTERS, Request
from drivers.controller.modbus.transports import Descriptor, Transport

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
    1: "The controller must know function codes 3, 6 and 16; for one without 6 set single_write: fc16",
    2: "Check link_address, service_address, contour_address and payload_capacity",
    3: "Check payload_capacity, and the controller's limit of registers in one request, which must be 16 or more",
    10: "Check the gateway and device_id",
    11: "Check the gateway, the line behind it, and device_id",
}
HEARS_ITSELF = (
    "It is what was sent: the line echoes it. Set echo: true; a serial server must be set to keep it to itself"
)
SURELY_OUR_OWN = 3  # bytes of a read; the third is an address there, and a byte count in its reply
TIMER_STEP_S = 0.001  # epoll waits whole milliseconds, rounded up; t3.5 is 1.75 ms
MOST_SINGLE_IN_A_ROW = 4  # while a page waits: a heartbeat takes three requests, and none may hold a page up for ever
MAY_BE_DONE_LATER = (5, 11)  # these say that the request went on its way, not that it was refused


@dataclass(eq=False)
class _Exchange:
    """Requests of one caller, in order; `done` gets their replies' PDUs."""

    requests: Sequence[Request]
    done: asyncio.Future[list[bytes]]
    replies: list[bytes] = field(default_factory=list)

    @property
    def request(self) -> Request:
        """The next one, or the one under way."""
        return self.requests[len(self.replies)]


class RequestQueue:
    """An open transport, from here to its first fault.

    Callers take turns, one request each, and who has a single one goes before who has a row of them: a heartbeat waits
    for one request of a page, never for a whole page. A row's next request goes out from within the arrival of the
    reply to the one before: a page costs one wake-up of its task, not 17.
    """

    def __init__(self, transport: Transport, descriptor: Descriptor, device_id: int, timeout_s: float) -> None:
        self.name = transport.name
        self.fault: ControllerUnavailable | None = None
        self._transport = transport
        self._timing = transport.timing
        self._framing = transport.framing(device_id)
        self._timeout_s = timeout_s
        self._loop = asyncio.get_running_loop()
        self._singles: deque[_Exchange] = deque()
        self._rows: deque[_Exchange] = deque()
        self._singles_in_a_row = 0
        self._under_way: _Exchange | None = None
        self._received = b""
        self._echo = b""
        self._sent = b""  # the last request's frame, where it is a read on a line that might echo it
        self._deadline = 0.0
        self._silent_from = 0.0
        self._alarm: asyncio.TimerHandle | None = None
        self._rest: asyncio.Handle | None = None
        self._listening = False
        self._sent_at = 0.0
        self._waiting_in_place = InPlaceWaiting()
        self._in_place = bool(transport.timing.silence_s)  # a serial line is never prompt
        self._channel = ByteChannel(*descriptor, self._receive, self._lost)

    def end(self, fault: ControllerUnavailable) -> None:
        """Close, and let all requests fail with `fault`; the first fault stays."""
        if self.fault is not None:
            return
        self.fault = fault
        self._channel.close()
        for timer in (self._alarm, self._rest):
            if timer is not None:
                timer.cancel()
        for exchange in (self._under_way, *self._singles, *self._rows):
            if exchange is not None and not exchange.done.done():
                exchange.done.set_exception(_again(fault))
        self._under_way = None
        self._singles.clear()
        self._rows.clear()

    async def run(self, requests: Sequence[Request]) -> list[bytes]:
        """The PDUs of the replies, known to match; the first refusal ends the row.

        Raises ControllerRefused, ControllerUnavailable. Cancelled while one is under way, the connection ends.
        """
        if self.fault is not None:
            raise _again(self.fault)
        if not requests:
            return []
        exchange = _Exchange(requests, self._loop.create_future())
        (self._singles if len(requests) == 1 else self._rows).append(exchange)
        self._send_next()
        if len(requests) == 1:
            self._wait_in_place()
        else:  # first let those that want to go in between take their turn in the queue
            self._loop.call_soon(self._wait_in_place)
        try:
            return await exchange.done
        except asyncio.CancelledError:
            if exchange is self._under_way:
                what = f"{exchange.request} was cancelled on its way, its reply may still come"
                self.end(ControllerUnavailable(f"{self.name}: {what}"))
            raise

    def at_once(self, request: Request) -> bytes | None:
        """The reply's PDU where it comes promptly and is no refusal; None where `run` must ask for it."""
        if (
            self._singles
            or self._rows
            or self._under_way
            or self.fault
            or self._in_place
            or not self._waiting_in_place.worth(self._loop.time())
        ):
            return None
        exchange = _Exchange((request,), self._loop.create_future())
        self._singles.append(exchange)
        self._send_next()
        self._wait_in_place()
        if exchange.done.done() and exchange.done.exception() is None:
            return exchange.replies[0]
        exchange.done.add_done_callback(asyncio.Future.exception)  # nobody else asks for it
        return None

    async def wait_out(self, silence_s: float, longest_s: float) -> None:
        """Return when nothing has come for `silence_s`; what comes is dropped. Raises ControllerUnavailable."""
        self._listening = True
        begun = self._loop.time()
        self._silent_from = max(self._silent_from, begun)
        while (left := self._silent_from + silence_s - self._loop.time()) > 0:
            if self._loop.time() - begun > longest_s:
                self.end(
                    ControllerUnavailable(
                        f"{self.name}: something talks all the time, expected {silence_s:g} s of silence within "
                        f"{longest_s:g} s. Check baud rate, parity, termination and bias, and for a second client"
                    )
                )
            if self.fault is not None:
                raise _again(self.fault)
            await asyncio.sleep(left)
        self._listening = False

    # --- sending ------------------------------------------------------------------------------------------------

    def _send_next(self) -> None:
        """Send the request whose turn it is, once the line has been silent; nothing while one is under way."""
        turns = self._next_turn()
        if self._under_way is not None or turns is None or self.fault is not None:
            return
        now = self._loop.time()
        left = self._silent_from + self._timing.silence_s - now
        if left > 0:
            if self._rest is None:
                self._rest = self._rest_for(left)
            return
        exchange = self._under_way = turns.popleft()
        self._singles_in_a_row = self._singles_in_a_row + 1 if turns is self._singles else 0
        request = exchange.request
        data = self._framing.request(request)
        self._sent_at = now
        self._deadline = now + self._timeout_s + self._timing.byte_s * self._framing.wire_length(request)
        if self._alarm is None:
            self._alarm = self._loop.call_at(self._deadline, self._look_at_deadline)
        if self._timing.silence_s:  # the reply to a write begins as the write does
            self._sent = data if request.pdu[0] == READ_REGISTERS else b""
        if self._timing.echo:
            self._echo = data
        self._channel.write(data)

    def _next_turn(self) -> deque[_Exchange] | None:
        """The queue whose first request goes next; None where nobody waits."""
        for queue in (self._singles, self._rows):
            while queue and queue[0].done.done():  # cancelled in the queue
                queue.popleft()
        if self._singles and not (self._rows and self._singles_in_a_row >= MOST_SINGLE_IN_A_ROW):
            return self._singles
        return self._rows or None

    def _wait_in_place(self) -> None:
        """Hold the event loop while replies come promptly, as long as `InPlaceWaiting` allows."""
        if self._in_place:
            return
        self._in_place = True
        came, begun = True, self._loop.time()
        while came and self._under_way is not None and self._waiting_in_place.worth(begun):
            came = self._channel.wait(WAIT_S)
            now = self._loop.time()
            self._waiting_in_place.waited(now - begun, now, came)
            begun = now
        self._in_place = False

    def _rest_for(self, left_s: float) -> asyncio.Handle:
        """Come back after `left_s`, or a little earlier: the loop's timers are late by up to `TIMER_STEP_S`."""
        if left_s > TIMER_STEP_S:
            return self._loop.call_later(left_s - TIMER_STEP_S, self._rested)
        return self._loop.call_soon(self._rested)

    def _rested(self) -> None:
        self._rest = None
        self._send_next()

    def _look_at_deadline(self) -> None:
        """One timer serves all requests: setting and cancelling one each would cost more than the request."""
        self._alarm = None
        if self._under_way is None:
            return
        if self._loop.time() < self._deadline:
            self._alarm = self._loop.call_at(self._deadline, self._look_at_deadline)
            return
        text = f"{self.name}: no reply to {self._under_way.request} in {self._timeout_s:g} s"
        if self._received:
            text += f", {len(self._received)} bytes of one"
        self.end(ControllerTimeout(f"{text}. {self._transport.missing}"))

    # --- receiving ----------------------------------------------------------------------------------------------

    def _receive(self, data: bytes) -> None:
        if self._timing.silence_s:
            self._silent_from = self._loop.time()
        elif not self._in_place:
            self._waiting_in_place.came_by_loop(self._loop.time() - self._sent_at)
        if self._listening:
            return
        try:
            if self._echo:
                data = self._without_echo(data)
                if not data:
                    return
            self._take(data)
        except ControllerNonsense as error:
            next_step = HEARS_ITSELF if self._hears_itself() else self._transport.mismatch
            if error.answered_as is not None:
                next_step = f"If that is the controller, set device_id: {error.answered_as}"
            self.end(ControllerNonsense(f"{self.name}: {error}. {next_step}", error.answered_as))
        self._wait_in_place()

    def _take(self, data: bytes) -> None:
        exchange = self._under_way
        if exchange is None:
            raise ControllerNonsense(f"{len(data)} bytes came though no request was pending")
        self._received += data
        reply = self._framing.reply(self._received)
        if reply is None:
            return
        self._received = b""
        self._under_way = None
        if reply[0] & EXCEPTION:
            self._refuse(exchange, reply[1])
        else:
            exchange.replies.append(reply)
            if len(exchange.replies) < len(exchange.requests) and not exchange.done.done():
                self._rows.append(exchange)
            elif not exchange.done.done():
                exchange.done.set_result(exchange.replies)
        self._send_next()

    def _refuse(self, exchange: _Exchange, code: int) -> None:
        refusal = self._refusal(code, exchange.request)
        if not exchange.done.done():
            exchange.done.set_exception(refusal)
        if isinstance(refusal, ControllerUnavailable):
            self.end(refusal)

    def _hears_itself(self) -> bool:
        """True where what came instead of a reply is the beginning of what was sent."""
        came, sent = self._received, self._sent
        return min(len(came), len(sent)) >= SURELY_OUR_OWN and sent.startswith(came[: len(sent)])

    def _without_echo(self, data: bytes) -> bytes:
        """What is left of `data` when our own bytes are taken off."""
        own = self._echo[: len(data)]
        if not data.startswith(own):
            raise ControllerNonsense(
                "what was sent did not come back as it was sent, so two talked at once, or the line does not echo: "
                "then take out echo"
            )
        self._echo = self._echo[len(own) :]
        return data[len(own) :]

    def _lost(self, reason: str) -> None:
        """The channel's word that the other end has gone."""
        self.end(ControllerUnavailable(f"{self.name}: {self._transport.lost(reason)}"))

    def _refusal(self, code: int, request: Request) -> ControllerError:
        name = EXCEPTION_NAMES.get(code, "not a code of the standard")
        text = f"{self.name} answered {request} with exception {code} ({name})"
        if code in NEXT_STEPS:
            text += f". {NEXT_STEPS[code]}"
        return ControllerTimeout(text) if code in MAY_BE_DONE_LATER else ControllerRefused(text, code)


def _again(fault: ControllerUnavailable) -> ControllerUnavailable:
    """The fault anew: one exception object must not be raised in several tasks."""
    return copy.copy(fault)
