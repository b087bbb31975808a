"""Two joined pseudo-terminals, slow as a serial line: `python -m benchmarks.link.paced_line BAUDRATE` says their names.

Each byte takes its ten bits of time; what is written arrives when its last bit would have.
"""

from __future__ import annotations

import contextlib
import os
import select
import sys
import time
import tty

BITS = 10
PRIORITY = 20
BUNCH = 16  # bytes that arrive together, as from a UART's buffer; the last of a frame is on time


class Direction:
    """Bytes from one master to the other, at the line's pace."""

    def __init__(self, source: int, sink: int, byte_s: float) -> None:
        self.source = source
        self._sink = sink
        self._byte_s = byte_s
        self._waiting = b""
        self._begun = 0.0  # when the first waiting byte's start bit was

    @property
    def due(self) -> float | None:
        """When the next bunch arrives, None where nothing is on its way."""
        return self._begun + min(len(self._waiting), BUNCH) * self._byte_s if self._waiting else None

    def take(self, now: float) -> None:
        """Read what was written into the line."""
        data = os.read(self.source, 4096)
        if not self._waiting:
            self._begun = now
        self._waiting += data

    def deliver(self, now: float) -> None:
        """Hand on what has arrived."""
        count = min(len(self._waiting), int((now - self._begun) / self._byte_s + 1e-6))
        if count:
            os.write(self._sink, self._waiting[:count])
            self._waiting = self._waiting[count:]
            self._begun += count * self._byte_s


def main(baudrate: int) -> None:
    """Carry bytes until killed, before all else that this machine does where that is allowed: it plays hardware."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    masters, devices = zip(*(os.openpty() for _ in range(2)), strict=True)
    for device in devices:
        tty.setraw(device)
    print("ready", *(os.ttyname(device) for device in devices), flush=True)
    ways = [Direction(*pair, BITS / baudrate) for pair in (masters, masters[::-1])]
    while True:
        dues = [way.due for way in ways if way.due is not None]
        if dues:
            # `select` counts milliseconds, a byte at 115,200 baud takes 87 µs.
            time.sleep(max(0.0, min(dues) - time.perf_counter()))
        readable, _, _ = select.select(masters, [], [], 0 if dues else None)
        now = time.perf_counter()
        for way in ways:
            if way.source in readable:
                way.take(now)
            way.deliver(now)


if __name__ == "__main__":
    main(int(sys.argv[1]))
