"""A socket where a server of ours listens."""

from __future__ import annotations

import socket


def bound(host: str, port: int) -> socket.socket:
    """A socket that nobody else listens on; raise OSError, UnicodeError. A port may be taken again at once."""
    family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    listener = socket.socket(family, kind, protocol)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
    except OSError:
        listener.close()
        raise
    return listener
