"""What a process takes while nothing happens, beside the least that could do its reading.

`python -m benchmarks.rest link PORT` keeps a link to a controller on loopback and does nothing else; `bare PORT` is an
asyncio loop that asks for the controller's block as often and looks at nothing. The processor time of a program that
sleeps between short steps depends on the machine more than on the program, so both are measured in the same minutes.
"""

from __future__ import annotations

import asyncio
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from statistics import median

from drivers.controller.modbus.client import ModbusTcpController
from service.link.link import Link, LinkSettings

ROOT = Path(__file__).parents[1]
SETTLES_S = 2.0  # after a start, before the rest is measured
READ_LINK = bytes((0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 16))  # MBAP header, FC3 of 16 registers from 0
LONGEST_REPLY = 260


def processor_s(process_id: int) -> float:
    """Seconds of processor that a process has used, all threads: proc(5), fields 14 and 15."""
    fields = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def share_percent(process_id: int, seconds: float) -> float:
    """What the process takes of one core over the next `seconds`."""
    before, begun = processor_s(process_id), time.monotonic()
    time.sleep(seconds)
    return 100 * (processor_s(process_id) - before) / (time.monotonic() - begun)


def medians_percent(whats: Sequence[str], port: int, seconds: float, rounds: int) -> list[float]:
    """Of each of `whats`, "link" or "bare", the median of `rounds` shares of a core, taken in turn."""
    shares: dict[str, list[float]] = {what: [] for what in whats}
    for _ in range(rounds):
        for what, seen in shares.items():
            with _started(what, port) as process_id:
                time.sleep(SETTLES_S)
                seen.append(share_percent(process_id, seconds))
    return [median(seen) for seen in shares.values()]


@contextmanager
def _started(what: str, port: int) -> Iterator[int]:
    process = subprocess.Popen([sys.executable, "-m", "benchmarks.rest", what, str(port)], cwd=ROOT)
    try:
        yield process.pid
        if process.poll() is not None:
            raise RuntimeError(f"benchmarks.rest {what} ended with status {process.returncode} before it was measured")
    finally:
        process.kill()
        process.wait()


async def _link(port: int) -> None:
    await Link(ModbusTcpController("127.0.0.1", port), LinkSettings()).run()


async def _bare(port: int) -> None:
    loop = asyncio.get_running_loop()
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setblocking(False)
        while True:
            await asyncio.sleep(LinkSettings().poll_period_s)
            await loop.sock_sendall(connection, READ_LINK)
            if not await loop.sock_recv(connection, LONGEST_REPLY):
                return


def main(arguments: Sequence[str]) -> None:
    """Be one of the two until killed."""
    what, port = arguments
    asyncio.run({"link": _link, "bare": _bare}[what](int(port)))


if __name__ == "__main__":
    main(sys.argv[1:])
