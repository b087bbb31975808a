"""No late reply is under way: what must be known of a serial line before its replies are believed.

An RTU reply does not say which request it answers. One that comes after its time-out, from before a restart of the
service even, is taken for the answer to the next request of the same kind, and so for ever: results one behind.
A controller answers in the order of the requests. So a read that none but this check sends is a barrier: once its reply
has come, all that was under way before it has come too, or never will.
"""

from __future__ import annotations

from drivers.controller.errors import ControllerRefused
from drivers.controller.modbus.request_queue import RequestQueue
from drivers.controller.modbus.requests import SHORTEST_LIMIT, read_registers

# USB adapters hand on bytes in packets up to 16 ms apart; a serial server may collect them for longer.
SILENCE_S = 0.05
# All other reads are of an even number of registers.
BARRIER_COUNTS = tuple(range(1, SHORTEST_LIMIT, 2))


async def outlast_late_replies(connection: RequestQueue, contour_address: int, turn: int, timeout_s: float) -> None:
    """Return when no reply to an earlier request can come any more.

    turn: another one at each call, so that the reply to an earlier barrier is none to this one.
    Raises ControllerUnavailable, with which the connection has ended: no silence, no reply, or the reply to another
    request (ControllerNonsense), which is no fault of the line but what the barrier is there to catch.
    """
    await connection.wait_out(SILENCE_S, SILENCE_S + timeout_s)
    barrier = read_registers(contour_address, BARRIER_COUNTS[turn % len(BARRIER_COUNTS)])
    try:
        await connection.run([barrier])
    except ControllerRefused:
        # An exception does not say what it answers either: where the block cannot be read, only time tells.
        await connection.wait_out(timeout_s, 4 * timeout_s)
