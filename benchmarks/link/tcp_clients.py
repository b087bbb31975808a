"""Three clients that do the same writes to one libmodbus server on loopback: C, bare pymodbus, combtrace.

Where a client runs beside its server decides more than what it does: a reply that must wake a sleeping processor takes
tens of microseconds, one on the server's own processor a few. So each placement is a row of its own, for all three.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from pymodbus.client import AsyncModbusTcpClient

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import Page
from drivers.controller.modbus.client import ModbusController, ModbusTcpController
from tests.support.interop.programs import compiled, libmodbus_tcp

TURNS, ROUNDS = 15, 20  # the clients take turns, so that a busy moment meets all of them
CLIENTS = ("C", "pymodbus", "combtrace")
Write = tuple[int, int, tuple[int, ...]]
"""Function code, address, values."""


@dataclass(frozen=True)
class Placement:
    """Which processors server and clients may use."""

    said: str
    server: frozenset[int]
    client: frozenset[int]


@dataclass
class Taken:
    """What the clients took in one placement, µs a round; together: turns that ended on the server's processor."""

    placement: Placement
    rounds: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in CLIENTS})
    together: dict[str, int] = field(default_factory=lambda: dict.fromkeys(CLIENTS, 0))

    def us(self, client: str) -> float:
        """The median round."""
        return median(self.rounds[client])


def placements() -> list[Placement]:
    """One processor, two of them, and as the scheduler likes; where there is one only, that one."""
    allowed = os.sched_getaffinity(0)
    one, *others = (frozenset((number,)) for number in sorted(allowed))
    apart = [Placement("two processors", one, others[0])] if others else []
    return [
        Placement("one processor", one, one),
        *apart,
        Placement("as the scheduler likes", *[frozenset(allowed)] * 2),
    ]


async def send(controller: ModbusController, pages: Sequence[Page]) -> None:
    """The writes of a transfer through our driver."""
    for number, page in enumerate(pages, start=1):
        await controller.write_transfer(0)
        await controller.write_page(page)
        await controller.write_transfer(number)


async def compare(pages: Sequence[Page], writes: Sequence[Write], layout: MailboxLayout) -> list[Taken]:
    """Each client in each placement, turn by turn, on connections of that placement's own."""
    return [await _in_placement(placement, pages, writes, layout) for placement in placements()]


async def _in_placement(
    placement: Placement, pages: Sequence[Page], writes: Sequence[Write], layout: MailboxLayout
) -> Taken:
    taken = Taken(placement)
    with libmodbus_tcp() as (server, port), _placed(server.pid, placement):
        controller = ModbusTcpController("127.0.0.1", port, layout=layout)
        library = AsyncModbusTcpClient("127.0.0.1", port=port, retries=0)
        await controller.connect()
        await library.connect()

        def note(client: str, rounds: Sequence[float], processor: int) -> None:
            taken.rounds[client] += rounds
            taken.together[client] += processor == _processor(server.pid)

        for _ in range(TURNS):
            note("C", *_by_c(port, writes))
            note("pymodbus", await _timed(lambda: _by_pymodbus(library, writes)), _processor(os.getpid()))
            note("combtrace", await _timed(lambda: send(controller, pages)), _processor(os.getpid()))
        library.close()
        await controller.close()
    return taken


@contextmanager
def _placed(server: int, placement: Placement) -> Iterator[None]:
    """This process, those that it starts, and the server on their processors."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(server, placement.server)
    os.sched_setaffinity(0, placement.client)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def _processor(pid: int) -> int:
    """The processor that the process ran on last: field 39 of proc(5)'s stat."""
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[36])


async def _by_pymodbus(client: AsyncModbusTcpClient, writes: Sequence[Write]) -> None:
    """The same by the library's client, its replies believed."""
    for function_code, address, values in writes:
        if function_code == 6:
            await client.write_register(address, values[0], device_id=1)
        else:
            await client.write_registers(address, list(values), device_id=1)


def _by_c(port: int, writes: Sequence[Write]) -> tuple[list[float], int]:
    """Microseconds a round of the C client, and the processor that it ended on."""
    lines = (
        f"{code} {address} {values[0]}" if code == 6 else f"{code} {address} {len(values)} {' '.join(map(str, values))}"
        for code, address, values in writes
    )
    client = compiled("link_client", Path(__file__).parent)
    said = subprocess.run(
        [client, str(port), str(ROUNDS)], input="\n".join(lines), capture_output=True, text=True, check=True
    )
    *rounds, processor = said.stdout.split()
    return [float(line) for line in rounds], int(processor)


async def _timed(send_once: Callable[[], Awaitable[None]]) -> list[float]:
    """Microseconds a round."""
    took = []
    for _ in range(ROUNDS):
        begun = time.perf_counter()
        await send_once()
        took.append(1e6 * (time.perf_counter() - begun))
    return took
