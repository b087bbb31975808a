"""Connections as they come from the network: bounded in memory and in the processor time that they may take.

The interpreter runs one thread at a time, so what a client has worked out here is taken from the jobs.
"""

from __future__ import annotations

import asyncio
import logging
import time
from socket import socket
from typing import Any

from asyncua import Server
from asyncua.common.connection import TransportLimits
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol

from service.opcua.session import CellServer

log = logging.getLogger("combtrace.opcua")

LARGEST_CHUNK = 65_535
LARGEST_MESSAGE = 262_144
MOST_UNREAD = 2_000_000  # bytes of answers that a client leaves lying
REST = 3.0  # times as long as a request took nothing is done for any client
LIMITS = TransportLimits(
    max_recv_buffer=LARGEST_CHUNK,
    max_send_buffer=LARGEST_CHUNK,
    max_chunk_count=LARGEST_MESSAGE // LARGEST_CHUNK + 1,
    max_message_size=LARGEST_MESSAGE,
)


class _Connection(OPCUAProtocol):
    """A client's connection; closed where it sends what is no message of ours, or does not read its answers."""

    turn: asyncio.Lock
    rules: Any

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.processor is not None and self.transport is not None:
            self.transport.set_write_buffer_limits(high=MOST_UNREAD)
            # Without this a channel that has no security would be asked for no rights.
            self.processor._connection.security_policy.permissions = self.rules

    def data_received(self, data: bytes) -> None:
        """Raise nothing, keep no more than a chunk that is not whole."""
        super().data_received(data)
        if len(self._buffer) > LARGEST_CHUNK:
            self._close("a chunk is too large")

    def pause_writing(self) -> None:
        """The library writes on, whether a client reads or not."""
        self._close("it does not read its answers")

    async def _process_one_msg(self, header: Any, buf: Any) -> bool:
        """One message at a time of all clients, and a rest after it: a flood gets a share of the interpreter."""
        async with self.turn:
            begun_s = time.thread_time()
            try:
                return bool(await super()._process_one_msg(header, buf))
            except Exception as error:  # noqa: BLE001  whatever a client sends, only its own connection ends
                self._close(f"a message that cannot be taken: {error}")
                return False
            finally:
                await asyncio.sleep((time.thread_time() - begun_s) * REST)

    def _close(self, why: str) -> None:
        log.warning("opcua: connection of %s closed: %s", self.peer_name, why)
        if self.transport is not None:
            self.transport.abort()


class _BoundedServer(BinaryServer):
    """The library's server on a socket that listens already."""

    def __init__(self, server: Server, listener: socket) -> None:
        super().__init__(server.iserver, "", 0, LIMITS)
        self.set_policies(server._policies)
        self._listener = listener
        self._turn = asyncio.Lock()
        self._rules = server._permission_ruleset

    def _make_protocol(self) -> OPCUAProtocol:
        made = _Connection(self.iserver, self._policies, self.clients, self.closing_tasks, self.limits)
        made.turn, made.rules = self._turn, self._rules
        return made

    async def start(self) -> None:
        """Listen."""
        self._server = await asyncio.get_running_loop().create_server(self._make_protocol, sock=self._listener)
        self.cleanup_task = asyncio.create_task(self._close_task_loop())


class ListeningServer(Server):
    """The library's server, with bounded connections."""

    def __init__(self, iserver: CellServer, listener: socket) -> None:
        super().__init__(iserver)
        self._listener = listener

    async def start(self) -> None:
        """Begin to answer."""
        await self._setup_server_nodes()
        await self.iserver.start()
        self.bserver = _BoundedServer(self, self._listener)
        await self.bserver.start()
