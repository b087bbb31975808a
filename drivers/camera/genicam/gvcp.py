"""Questions to a GigE Vision camera that need no control of it: is it there, who has it, what is its name.

Aravis waits 2.5 s for one answer and notices after 6 s that a camera has gone. These questions are of the GigE Vision
Control Protocol's simplest kind, go from a socket of their own, and bring an answer within milliseconds or none.
"""

from __future__ import annotations

import ipaddress
import socket
import struct
import time

PORT = 3956
TRIES, WAIT_S = 3, 0.2
_READ_REGISTER, _READ_MEMORY = 0x0080, 0x0084
_KEY_AND_ACK = 0x4201
# Bootstrap registers of GigE Vision 2.
_USER_NAME, _USER_NAME_BYTES = 0x00E8, 16
_CONTROL_PRIVILEGE, _PRIMARY_ADDRESS = 0x0A00, 0x0A14


class GigeQuestions:
    """A socket to one camera. Every answer is None where none came; nothing raises."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect((address, PORT))
        self._number = 0

    def control_is_taken(self) -> bool | None:
        """Whether a client has control of the camera; a camera that was switched off and on has none."""
        return self._answered(self._register(_CONTROL_PRIVILEGE))

    def controlled_from(self) -> str:
        """The address of the client that has control, "" where the camera does not tell."""
        value = self._register(_PRIMARY_ADDRESS)
        return str(ipaddress.IPv4Address(value)) if value else ""

    def user_name(self) -> str:
        """The name that a user gave the camera, "" where there is none."""
        body = self._ask(_READ_MEMORY, struct.pack(">IHH", _USER_NAME, 0, _USER_NAME_BYTES))
        return "" if body is None else body[4:].split(b"\0")[0].decode("utf-8", "replace")

    def close(self) -> None:
        """Let the socket go."""
        self._socket.close()

    @staticmethod
    def _answered(value: int | None) -> bool | None:
        return None if value is None else value != 0

    def _register(self, address: int) -> int | None:
        body = self._ask(_READ_REGISTER, struct.pack(">I", address))
        return None if body is None or len(body) < 4 else int(struct.unpack(">I", body[:4])[0])

    def _ask(self, command: int, question: bytes) -> bytes | None:
        """The answer's body; of a camera that only refuses to tell, a body that says 1."""
        for _ in range(TRIES):
            self._number = self._number % 0xFFFF + 1
            packet = struct.pack(">HHHH", _KEY_AND_ACK, command, len(question), self._number) + question
            give_up_at = time.monotonic() + WAIT_S
            try:
                self._socket.send(packet)
                while (left_s := give_up_at - time.monotonic()) > 0:
                    self._socket.settimeout(left_s)
                    answer = self._socket.recv(1024)
                    if len(answer) >= 8 and struct.unpack(">HHHH", answer[:8])[3] == self._number:
                        status = struct.unpack(">H", answer[:2])[0]
                        return answer[8:] if status == 0 else b"\0\0\0\1"
            except TimeoutError:
                continue
            except OSError:  # refused: the machine is there and nothing listens, as after a camera's fall
                time.sleep(max(0.0, give_up_at - time.monotonic()))
        return None
