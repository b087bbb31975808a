"""The far end of a serial line that the daemon opens: a real pseudo-terminal."""

from __future__ import annotations

import os
import pty
import select
import time
import tty

from tests.support.processes.processes import BOUND_S


class Terminal:
    """The far end of a pseudo-terminal that the daemon opens as its serial port."""

    def __init__(self) -> None:
        self.master, slave = pty.openpty()
        tty.setraw(self.master)
        self.name = os.ttyname(slave)
        self._slave = slave  # kept open: the line does not hang up between two opens of the daemon's
        self._rest = b""

    def type(self, data: bytes) -> None:
        os.write(self.master, data)

    def line(self, bound_s: float = BOUND_S) -> str:
        """The next line that the daemon sent."""
        give_up_at = time.monotonic() + bound_s
        while b"\n" not in self._rest:
            left = give_up_at - time.monotonic()
            assert left > 0, f"no line; so far {self._rest!r}"
            if select.select([self.master], [], [], left)[0]:
                self._rest += os.read(self.master, 4096)
        line, _, self._rest = self._rest.partition(b"\n")
        return line.decode("ascii").strip()

    def acknowledged(self, bound_s: float = BOUND_S) -> int:
        """The job that the next line acknowledges."""
        word, job = self.line(bound_s).split()
        assert word == "ACK"
        return int(job)

    def close(self) -> None:
        os.close(self._slave)
        os.close(self.master)
