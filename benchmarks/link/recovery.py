"""How long after a controller's return contours can be sent to it again, over and over.

The simulated controller is a process of its own. It is killed and started anew, which refuses connections meanwhile, or
held and let go on, which leaves them hanging as a pulled cable does. The time away varies, so that the return meets
every phase of our attempts. It counts from when the controller listens, or goes on, to when the link has no fault:
connected, answered, its heartbeat seen to move, its echo right.
"""

from __future__ import annotations

import asyncio
import logging
import random
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from drivers.controller.modbus.client import ModbusController, ModbusRtuOverTcpController, ModbusTcpController
from service.link.link import Link, LinkSettings
from tests.support.processes.processes import COMBTRACE, free_port

REPEATS = 20
AWAY_S = (0.5, 2.5)  # an attempt and its pause take 1.5 s
LOOK_S = 0.002
BOUND_S = 60.0
LISTENING = "0A"  # proc(5): /proc/net/tcp's states
ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Recoveries:
    """Seconds from each return to a link without fault."""

    said: str
    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The middle one."""
        return median(self.seconds)

    @property
    def longest(self) -> float:
        """The worst one."""
        return max(self.seconds)


class Away:
    """A simulated controller's process that goes away and comes back. option: how it listens."""

    def __init__(self, option: str) -> None:
        self.port = free_port()
        self._option = option
        self._process = self._started()

    def kill(self) -> None:
        """kill -9."""
        self._process.kill()
        self._process.wait()

    async def start(self) -> float:
        """Start it anew; the time from which it listens."""
        self._process = self._started()
        await _until(lambda: _listens(self.port))
        return time.monotonic()

    def hold(self) -> None:
        """It keeps its connections, and does nothing."""
        self._process.send_signal(signal.SIGSTOP)

    async def go_on(self) -> float:
        """It does again what it did; the time from which on."""
        self._process.send_signal(signal.SIGCONT)
        return time.monotonic()

    def _started(self) -> subprocess.Popen[bytes]:
        command = [*COMBTRACE, "simulate-controller", self._option, f"127.0.0.1:{self.port}"]
        return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _listens(port: int) -> bool:
    """True where this machine listens on the port: asked of the kernel, for a connection would disturb."""
    rows = Path("/proc/net/tcp").read_text().splitlines()[1:]
    return any(row.split()[1].endswith(f":{port:04X}") and row.split()[3] == LISTENING for row in rows)


async def recoveries(repeats: int = REPEATS) -> list[Recoveries]:
    """Both ways there are in a network, both ways of being away."""
    logging.getLogger("combtrace.link").setLevel(logging.ERROR)  # which tells each loss
    ways = (("Modbus TCP", "--tcp", ModbusTcpController), ("RTU over TCP", "--rtu-over-tcp", _serial))
    # Not all four at once: a process that starts takes a processor for a second.
    found = [await _killed(*way, repeats) for way in ways]
    return [*found, *await asyncio.gather(*(_held(*way, repeats) for way in ways))]


def _serial(host: str, port: int) -> ModbusController:
    return ModbusRtuOverTcpController(host, port, baudrate=115_200)


async def _killed(said: str, option: str, driver: Callable[[str, int], ModbusController], repeats: int) -> Recoveries:
    away = Away(option)
    seconds = await _measured(away, driver, away.kill, away.start, repeats)
    return Recoveries(f"{said}: controller killed and started", seconds)


async def _held(said: str, option: str, driver: Callable[[str, int], ModbusController], repeats: int) -> Recoveries:
    away = Away(option)
    seconds = await _measured(away, driver, away.hold, away.go_on, repeats)
    return Recoveries(f"{said}: controller silent, then answers again", seconds)


async def _measured(
    away: Away,
    driver: Callable[[str, int], ModbusController],
    leave: Callable[[], None],
    come_back: Callable[[], Awaitable[float]],
    repeats: int,
) -> tuple[float, ...]:
    chance = random.Random(away.port)
    seconds = []
    async with _linked(driver("127.0.0.1", away.port)) as link:
        try:
            await _until(lambda: link.fault() is None)
            for _ in range(repeats):
                leave()
                await _until(lambda: link.fault() is not None)
                await asyncio.sleep(chance.uniform(*AWAY_S))
                returned_at = await come_back()
                await _until(lambda: link.fault() is None)
                seconds.append(time.monotonic() - returned_at)
        finally:
            away.kill()
    return tuple(seconds)


@asynccontextmanager
async def _linked(controller: ModbusController) -> AsyncIterator[Link]:
    link = Link(controller, LinkSettings())
    keeping = asyncio.ensure_future(link.run())
    try:
        yield link
    finally:
        keeping.cancel()
        await asyncio.wait([keeping])


async def _until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(BOUND_S):
        while not holds():
            await asyncio.sleep(LOOK_S)


if __name__ == "__main__":
    for row in asyncio.run(recoveries(int(sys.argv[1]) if len(sys.argv) > 1 else REPEATS)):
        print(f"{row.said}: median {row.median:.2f} s, longest {row.longest:.2f} s of {len(row.seconds)}")
