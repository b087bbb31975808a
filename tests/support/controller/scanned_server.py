"""A controller's program behind the Modbus server of the LinuxCNC bridge, scanned as a PLC scans."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[3] / "controllers" / "linuxcnc"))
from modbus_server import ModbusServer

SCAN_PERIOD_S = 0.005


@contextmanager
def scanned_server(controller: Any, scan: Callable[[], None]) -> Iterator[int]:
    """The port on loopback at which a controller's registers are served, while `scan` runs period after period."""
    server = ModbusServer(("127.0.0.1", 0), controller)
    ended = threading.Event()

    def scans() -> None:
        while not ended.wait(SCAN_PERIOD_S):
            scan()

    threads = [threading.Thread(target=server.serve_forever, args=(0.05,)), threading.Thread(target=scans)]
    for thread in threads:
        thread.start()
    try:
        yield server.server_address[1]
    finally:
        ended.set()
        server.shutdown()
        for thread in threads:
            thread.join()
        server.server_close()
