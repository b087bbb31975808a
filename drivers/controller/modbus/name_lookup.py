"""The addresses of a host, found in a thread of its own.

A name server that hangs holds its caller for half a minute, and nothing can cancel it. In the event loop's shared pool
a few such attempts would leave no thread for anybody else. So each name has one thread at most: an attempt that finds a
look-up under way waits for that one.
"""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

Address = tuple[int, int, int, str, tuple[Any, ...]]
"""Family, kind, protocol, canonical name, socket address, as getaddrinfo gives them."""

_under_way: dict[tuple[str, int], Future[Sequence[Address]]] = {}


async def addresses_of(host: str, port: int) -> Sequence[Address]:
    """Where to connect to, the system's first choice first; OSError or UnicodeError: the name has no address."""
    try:
        return _numeric(host, port)
    except socket.gaierror:
        pass  # a name
    where = (host, port)
    found = _under_way.get(where)
    if found is None:
        found = _under_way[where] = Future()
        found.set_running_or_notify_cancel()  # from here on a caller that gives up does not end it for the others
        # A daemon thread: the process can end while the name server hangs.
        threading.Thread(target=_look_up, args=(where, found), name=f"address of {host}", daemon=True).start()
    return await asyncio.wrap_future(found)


def _numeric(host: str, port: int) -> Sequence[Address]:
    return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_NUMERICHOST)


def _look_up(where: tuple[str, int], found: Future[Sequence[Address]]) -> None:
    try:
        addresses = socket.getaddrinfo(*where, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        del _under_way[where]
        found.set_exception(error)
    else:
        del _under_way[where]
        found.set_result(addresses)
