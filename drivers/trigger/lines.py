"""Bytes of a serial line -> lines of text, in bounded memory whatever arrives."""

from __future__ import annotations

LONGEST = 80
CR, LF = 0x0D, 0x0A


class LineSplitter:
    """Cuts a stream at CR, LF or CRLF.

    A line beyond 80 bytes is given once, as its first 81, as soon as they are there; the rest of it is swallowed. So
    whoever reads sees that it was too long, and noise without line ends costs neither memory nor more than one reply.
    """

    def __init__(self) -> None:
        self._partial = bytearray()
        self._swallowing = False
        self._after_cr = False

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that `data` completes, without their ends; an empty one is given too."""
        lines = []
        for byte in data:
            ends_crlf, self._after_cr = self._after_cr and byte == LF, byte == CR
            if ends_crlf:
                continue
            if byte in (CR, LF):
                if not self._swallowing:
                    lines.append(bytes(self._partial))
                self.drop()
            elif not self._swallowing:
                self._partial.append(byte)
                if len(self._partial) > LONGEST:
                    lines.append(bytes(self._partial))
                    self._partial.clear()
                    self._swallowing = True
        return lines

    def drop(self) -> None:
        """Forget the line that has begun."""
        self._partial.clear()
        self._swallowing = False
