"""One of the two processes stands still for seconds (SIGSTOP, SIGCONT), at any step of the protocol."""

from __future__ import annotations

import asyncio
import signal

from tests.soak.cells.killed_cell import KilledCell
from tests.support.processes.processes import Process

BRIEFLY_S, LONG_S = (0.1, 1.0), (1.0, 5.0)


class StoppedCell(KilledCell):
    """As `KilledCell`, but the victim goes on where it stood, with all that it believed."""

    valid_for_s = 3.0  # some stops outlast it

    def strike_down(self, process: Process) -> None:
        process.send(signal.SIGSTOP)
        self.stopped_for_s = self.chance.uniform(*(BRIEFLY_S if self.chance.random() < 0.5 else LONG_S))

    async def bring_back(self, process: Process, _forgets: bool = False) -> Process:
        await asyncio.sleep(self.stopped_for_s)
        process.send(signal.SIGCONT)
        return process
