"""What listens where a broker should: it says what it is told to, reads as much as it is told to, and no more."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

CONNACK = b"\x20\x02\x00\x00"
NO_ROOM = b"\x20\x02\x00\x03"  # server unavailable
SUBACK = b"\x90\x03\x00\x01\x01"  # of the first SUBSCRIBE
HUGE = b"\x30\xff\xff\xff\x7f" + b"x" * 65_536  # a publish of 256 MB begins
HOARD = b"".join(  # publishes of QoS 2, never released
    b"\x34\x0c\x00\x04what" + number.to_bytes(2, "big") + b"junk" for number in range(1, 2000)
)
NONSENSE = {
    "silence": (),
    "an end": (b"",),
    "HTTP": (b"HTTP/1.1 400 Bad Request\r\n\r\n",),
    "zeros": (bytes(10_000),),
    "no room": (NO_ROOM,),
    "noise": (bytes(range(256)) * 40,),
    "CONNACK and noise": (CONNACK, bytes(range(255, -1, -1)) * 40),
    "answers nobody asked for": (CONNACK, SUBACK * 1000 + b"\x40\x02\xff\xff" * 1000),
    "a huge publish": (CONNACK, SUBACK, HUGE),
    "messages to be kept": (CONNACK, SUBACK, HOARD),
    "a deaf ear": (CONNACK, SUBACK),
}


class FalseBroker:
    """Says one piece after each first read of a connection, then reads no more; an empty piece ends the connection."""

    def __init__(self, *pieces: bytes) -> None:
        self._pieces = pieces
        self._listener = socket.socket()
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        self._listener.bind(("127.0.0.1", 0))
        self._listener.listen(8)
        self.port = int(self._listener.getsockname()[1])
        self.calls = 0
        self._open: list[socket.socket] = []
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            try:
                caller, _ = self._listener.accept()
            except OSError:
                return
            self._open.append(caller)
            with suppress(OSError):
                for piece in self._pieces:
                    caller.recv(1000)
                    if not piece:
                        caller.close()
                        break
                    caller.sendall(piece)
            self.calls += 1

    def close(self) -> None:
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        for one in (self._listener, *self._open):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        self._thread.join()
