"""A person at a serial line, a real pseudo-terminal, who waits for the end of each job though the service is killed."""

from __future__ import annotations

import asyncio
import os
import time
from contextlib import suppress
from pathlib import Path

from tests.soak.cells.killed_cell import KilledCell, Killing, Toll
from tests.soak.promises import untold
from tests.support.processes.terminal import Terminal

PATIENCE_S = 0.3  # for ACK or NAK; then the person types again
LAST_WORD_S = 10.0  # how long DONE or FAIL may take once the jobs have ended


class ToldCell(KilledCell):
    """The service's triggers come over a serial line; all that it says on it is kept."""

    def __init__(self, folder: Path, killing: Killing) -> None:
        super().__init__(folder, killing)
        self._rest_of_line = b""
        self._heard = asyncio.Event()
        self._asked_at = 0.0

    async def kill_service(self) -> Toll:
        terminal = Terminal()
        os.set_blocking(terminal.master, False)
        self._terminal = terminal
        self.triggers = f"[{{kind: serial, port: {terminal.name}}}]"
        asyncio.get_running_loop().add_reader(terminal.master, self._hear)
        try:
            return await super().kill_service()
        finally:
            asyncio.get_running_loop().remove_reader(terminal.master)
            terminal.close()

    def _hear(self) -> None:
        with suppress(BlockingIOError):
            *whole, self._rest_of_line = (self._rest_of_line + os.read(self._terminal.master, 4096)).split(b"\n")
            self.said += [line.decode("ascii").strip() for line in whole]
            self._heard.set()

    async def _ask(self) -> None:
        while True:
            await asyncio.sleep(self.chance.uniform(0, 0.02))
            self._heard.clear()
            with suppress(BlockingIOError):
                self._terminal.type(b"TRIG\n")
            with suppress(TimeoutError):
                async with asyncio.timeout(PATIENCE_S):
                    await self._heard.wait()

    def all_told(self) -> bool:
        """Or nobody waits any more. What was typed last may not have been heard yet."""
        self._asked_at = self._asked_at or time.monotonic()
        waited_s = time.monotonic() - self._asked_at
        return waited_s > LAST_WORD_S or (waited_s > PATIENCE_S and not untold(self.said))
