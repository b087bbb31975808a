"""The page's server: HTTP in a thread and a loop of its own, so that no browser can hold up a job or a heartbeat."""

from __future__ import annotations

import asyncio
import importlib.metadata
import logging
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response

from service.config.config import Page as PageSettings
from service.daemon.operations import Operations
from service.web.api import Api, problem
from service.web.commands import Commands, Known
from service.web.daemon_access import DaemonAccess, PageSources
from service.web.guard import Guard
from service.web.html import Pages
from service.web.http_server import certificate_mistake, http_server, listening
from service.web.people.pins import PeopleFile
from service.web.people.tokens import TokenFile, TokenFileError
from service.web.trends.endpoints import TrendEndpoints

log = logging.getLogger("combtrace.page")

THREAD_ENDS_S = 5.0


class PageError(Exception):
    """The page cannot be served: where, why, what to do."""


class PageServer:
    """Serves page and REST interface; listens from the start, answers while `run` runs."""

    def __init__(self, settings: PageSettings, sources: PageSources, version: str) -> None:
        """Raise PageError where the token file, the certificate or the address cannot be used."""
        self._settings = settings
        known = known_of(settings)
        try:
            known.read()
        except TokenFileError as error:
            raise PageError(f"page: {error}") from error
        check_certificate(settings)
        self.daemon = DaemonAccess(sources)
        self._pages = Pages(self.daemon, settings.language, orders=known != Known())
        commands = Commands(self.daemon, sources.journal, known)
        self._make_api: Callable[[], Api] = lambda: Api(self.daemon, commands, version)
        self._socket: socket.socket | None = _bound(settings.host, settings.port)

    async def run(self, operations: Operations) -> None:
        """Serve for ever; in the daemon's loop."""
        self.daemon.open(operations)
        if self._socket is None:
            self._socket = _bound(self._settings.host, self._settings.port)
        listener, self._socket = self._socket, None
        api = self._make_api()
        trends = TrendEndpoints(self.daemon.sources.journal_path, self._pages)
        settings = self._settings
        guarded = Guard(application(api, self._pages, trends), settings.names)
        server = http_server(guarded, settings.certificate, settings.key)
        thread = ThreadPoolExecutor(1, "page")
        serving = asyncio.get_running_loop().run_in_executor(thread, _serve, server, listener)
        log.info("page: %s", self.address)
        try:
            await asyncio.shield(serving)
        finally:
            server.should_exit = True
            api.close()
            trends.close()
            await asyncio.wait([serving], timeout=THREAD_ENDS_S)
            thread.shutdown(wait=False)
        raise PageError("the page's server ended, expected it to run for ever")

    @property
    def address(self) -> str:
        """Where it is, for people."""
        host = f"[{self._settings.host}]" if ":" in self._settings.host else self._settings.host
        return f"http{'s' if self._settings.certificate else ''}://{host}:{self._settings.port}/"


def application(api: Api, pages: Pages, trends: TrendEndpoints) -> Starlette:
    """All that is served; what is not there is told as every error is."""

    async def unknown(_request: Request, _error: Exception) -> Response:
        return problem(404, "there is nothing here. See /api/v1/openapi.json")

    async def wrong_method(_request: Request, _error: Exception) -> Response:
        return problem(405, "not by this method. See /api/v1/openapi.json")

    routes = [*pages.routes(), *api.routes(), *trends.routes()]
    return Starlette(routes=routes, exception_handlers={404: unknown, 405: wrong_method})


def _serve(server: uvicorn.Server, listener: socket.socket) -> None:
    try:
        server.run([listener])
    except SystemExit as error:  # in the daemon's loop it would end the daemon
        raise PageError(f"the page's server gave up (status {error.code})") from error


def _bound(host: str, port: int) -> socket.socket:
    """A listening socket; raise PageError."""
    try:
        return listening(host, port)
    except OSError as error:
        raise PageError(
            f"page: {host}:{port} cannot be listened on: {error.strerror or error}. Set another page.host or page.port"
        ) from error


def known_of(settings: PageSettings) -> Known:
    """Who may give orders, by which file."""
    return Known(
        None if settings.token_file is None else TokenFile(settings.token_file),
        None if settings.people_file is None else PeopleFile(settings.people_file),
    )


def check_certificate(settings: PageSettings) -> None:
    """Raise PageError where there is one that cannot be used."""
    why_not = certificate_mistake(settings.certificate, settings.key)
    if why_not is not None:
        raise PageError(why_not)


def make_page(settings: PageSettings, sources: PageSources) -> PageServer:
    """The page as the configuration has it; raise PageError."""
    return PageServer(settings, sources, importlib.metadata.version("combtrace"))
