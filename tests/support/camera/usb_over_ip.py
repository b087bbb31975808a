"""A USB device of a test's own, plugged into the kernel through USB/IP: the kernel's drivers take it for a real one.

The kernel's virtual host controller (module `vhci-hcd`) sends each transfer over a socket and expects its result there;
closing the socket pulls the device out. Format of the messages: the kernel's Documentation/usb/usbip_protocol.rst.
"""

from __future__ import annotations

import socket
import struct
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

CONTROLLER = Path("/sys/devices/platform/vhci_hcd.0")
SUBMIT, UNLINK, RESULT, UNLINKED = 1, 2, 3, 4
HEADER = struct.Struct(">IIIII")  # command, number, device, direction (1 = to the host), endpoint
REQUEST = struct.Struct(">IiIIi8s")  # flags, length, start frame, packets, interval, set-up
ANSWER = struct.Struct(">iiIIi8x")  # status, length, start frame, packets, errors
STALL, CANCELLED = -32, -104  # -EPIPE, -ECONNRESET
HIGH_SPEED = 3
PORT = 0


@dataclass(frozen=True)
class Setup:
    """The set-up packet of a control transfer."""

    kind: int
    request: int
    value: int
    index: int
    length: int


class UsbDevice:
    """Plugs itself in on `plug_in`; what it does is in `control` and in who feeds its one bulk endpoint.

    control: answers a control transfer, given the data that came with it; None stalls it.
    """

    def __init__(self, control: Callable[[Setup, bytes], bytes | None]) -> None:
        self._control = control
        self._waiting: list[tuple[int, int]] = []  # number and length of the host's reads of the bulk endpoint
        self._changed = threading.Condition()
        self._near: socket.socket | None = None

    def plug_in(self) -> None:
        """Attach to the virtual host controller, whose module is loaded if need be."""
        subprocess.run(["/bin/busybox", "modprobe", "vhci-hcd"], check=True)
        self._near, far = socket.socketpair()
        with far:
            text = f"{PORT} {far.fileno()} 65538 {HIGH_SPEED}"
            (CONTROLLER / "attach").write_text(text, encoding="ascii")
        threading.Thread(target=self._serve, args=(self._near,), daemon=True).start()

    def pull_out(self) -> None:
        """End the connection: to the kernel the device has gone."""
        with self._changed:
            near, self._near = self._near, None
            self._waiting.clear()
            self._changed.notify_all()
        if near is not None:
            near.shutdown(socket.SHUT_RDWR)
            near.close()

    @property
    def is_plugged_in(self) -> bool:
        """Whether the kernel still talks to it."""
        return self._near is not None

    def give(self, data: bytes, timeout_s: float = 1.0) -> bool:
        """Answer the host's next read of the bulk endpoint; False where none came in time. data: not longer than a
        read, which the caller knows from what the host agreed to."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._waiting or self._near is None, timeout_s) or not self._waiting:
                return False
            number, length = self._waiting.pop(0)
            assert len(data) <= length
            self._answer(number, data, len(data))
        return True

    def _serve(self, near: socket.socket) -> None:
        try:
            while True:
                command, number, _device, to_host, endpoint = HEADER.unpack(self._received(near, HEADER.size))
                body = self._received(near, REQUEST.size)
                if command == UNLINK:
                    self._unlink(number, struct.unpack_from(">I", body)[0])
                    continue
                _flags, length, _start, _packets, _interval, packet = REQUEST.unpack(body)
                data = b"" if to_host else self._received(near, length)
                if endpoint:
                    with self._changed:
                        self._waiting.append((number, length))
                        self._changed.notify_all()
                else:
                    self._controlled(number, Setup(*struct.unpack("<BBHHH", packet)), data)
        except OSError:
            self.pull_out()

    def _received(self, near: socket.socket, length: int) -> bytes:
        data = b""
        while len(data) < length:
            part = near.recv(length - len(data))
            if not part:
                raise ConnectionResetError("the host has ended the connection")
            data += part
        return data

    def _controlled(self, number: int, setup: Setup, data: bytes) -> None:
        answer = self._control(setup, data)
        with self._changed:
            if answer is None:
                self._answer(number, b"", 0, STALL)
            elif setup.kind & 0x80:
                self._answer(number, answer[: setup.length], len(answer[: setup.length]))
            else:
                self._answer(number, b"", len(data))

    def _unlink(self, number: int, unwanted: int) -> None:
        with self._changed:
            found = [read for read in self._waiting if read[0] == unwanted]
            self._waiting = [read for read in self._waiting if read[0] != unwanted]
            self._send(HEADER.pack(UNLINKED, number, 0, 0, 0) + struct.pack(">i24x", CANCELLED if found else 0))

    def _answer(self, number: int, data: bytes, length: int, status: int = 0) -> None:
        self._send(HEADER.pack(RESULT, number, 0, 0, 0) + ANSWER.pack(status, length, 0, 0, 0) + data)

    def _send(self, message: bytes) -> None:
        if self._near is not None:
            try:
                self._near.sendall(message)
            except OSError:
                self._near = None
