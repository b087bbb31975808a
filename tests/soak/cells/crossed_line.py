"""Two pseudo-terminals, crossed: a serial line with two ends."""

from __future__ import annotations

import asyncio
import os
import tty
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress


@asynccontextmanager
async def crossed_line() -> AsyncIterator[tuple[str, str]]:
    """Two serial ports, crossed: what is written to one is read from the other."""
    loop = asyncio.get_running_loop()
    ends = [os.openpty(), os.openpty()]
    for master, slave in ends:
        tty.setraw(slave)
        os.set_blocking(master, False)

    def carry(source: int, target: int) -> None:
        with suppress(BlockingIOError):
            os.write(target, os.read(source, 4096))

    (one, one_slave), (other, other_slave) = ends
    loop.add_reader(one, carry, one, other)
    loop.add_reader(other, carry, other, one)
    try:
        yield os.ttyname(one_slave), os.ttyname(other_slave)
    finally:
        for master, slave in ends:
            loop.remove_reader(master)
            os.close(master)
            os.close(slave)
