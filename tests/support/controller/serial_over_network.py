"""A serial server in the network, RFC 2217, as pyserial plays it; behind it pyserial's own line looped back.

Its RTS is its own CTS, and DTR its DSR: so a test moves the inputs that a client across the network sees.
"""

from __future__ import annotations

import contextlib
import socket
import threading

import serial
import serial.rfc2217


class SerialServer:
    """Serves one client after the other. Use as a context manager."""

    def __init__(self) -> None:
        self.device = serial.serial_for_url("loop://", timeout=0)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(0.05)
        self._client: socket.socket | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self.url = f"rfc2217://127.0.0.1:{self._listener.getsockname()[1]}"

    def __enter__(self) -> SerialServer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self._listener.close()
        self.device.close()

    def write(self, data: bytes) -> None:
        """Towards the client: called by pyserial's manager."""
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.sendall(data)

    def say(self, data: bytes) -> None:
        """Bytes as from a device at the serial side."""
        self.write(data.replace(b"\xff", b"\xff\xff"))

    def hang_up(self) -> None:
        """Close the connection to the client."""
        if self._client is not None:
            with contextlib.suppress(OSError):
                self._client.shutdown(socket.SHUT_RDWR)

    def _run(self) -> None:
        while not self._stop.is_set():
            with contextlib.suppress(TimeoutError):
                self._client, _ = self._listener.accept()
                self._serve(self._client)

    def _serve(self, client: socket.socket) -> None:
        client.settimeout(0.01)
        manager = serial.rfc2217.PortManager(self.device, self)
        with client:
            while not self._stop.is_set():
                try:
                    data = client.recv(1024)
                    if not data:
                        return
                    b"".join(manager.filter(data))
                except TimeoutError:
                    pass
                except OSError:
                    return
                manager.check_modem_lines()
