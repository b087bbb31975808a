"""HTTP as every page of ours is served: few connections, and nothing that a client claims of itself is believed."""

from __future__ import annotations

import asyncio
import socket
import ssl
from asyncio import Transport
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.daemon.listening_socket import bound

MOST_CONNECTIONS = 64  # beyond, a new one is closed: a flood must not use up the descriptors that jobs need
FIRST_REQUEST_S = 10.0
KEEP_ALIVE_S = 10
LARGEST_HEAD = 16_384
STOP_S = 1


class _BoundedHttp(H11Protocol):
    """HTTP/1.1 for a bounded number of connections, each of which has to ask for something soon."""

    _soon: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Transport) -> None:  # type: ignore[override]
        """A connection, closed at once where there are too many."""
        if len(self.connections) >= MOST_CONNECTIONS:
            transport.abort()
            return
        super().connection_made(transport)
        self._soon = self.loop.call_later(FIRST_REQUEST_S, self._close_unless_asked)

    def _close_unless_asked(self) -> None:
        if not self.cycle:  # of a request; there has been none
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Its end."""
        if self._soon is not None:
            self._soon.cancel()
            super().connection_lost(exc)


def http_server(app: ASGIApp, certificate: Path | None = None, key: Path | None = None) -> uvicorn.Server:
    """A server of the application, over TLS where there is a certificate with its key."""
    return uvicorn.Server(
        uvicorn.Config(
            app,
            loop="asyncio",
            http=_BoundedHttp,
            ws="none",
            lifespan="off",
            log_config=None,
            log_level="warning",
            access_log=False,
            proxy_headers=False,  # else a header could say from where a command comes
            server_header=False,
            timeout_keep_alive=KEEP_ALIVE_S,
            timeout_graceful_shutdown=STOP_S,
            h11_max_incomplete_event_size=LARGEST_HEAD,
            ssl_certfile=certificate,
            ssl_keyfile=key,
        )
    )


def certificate_mistake(certificate: Path | None, key: Path | None) -> str | None:
    """Why a certificate cannot be served with; None where it can, or where there is none."""
    if certificate is None or key is None:
        return None
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    except OSError as error:
        return (
            f"page: certificate {certificate} and key {key} cannot be used: {error.strerror or error}. "
            "Expected PEM files that belong together"
        )
    return None


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens there; raise OSError."""
    listener = bound(host, port)
    try:
        listener.listen(MOST_CONNECTIONS)
    except OSError:
        listener.close()
        raise
    return listener
