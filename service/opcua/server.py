"""The OPC UA server: in a thread and a loop of its own, so that no client can hold up a job or a heartbeat."""

from __future__ import annotations

import asyncio
import importlib.metadata
import logging
import socket
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from asyncua import ua

from service.config.config import Opcua
from service.config.recipes import Recipe
from service.daemon.listening_socket import bound
from service.daemon.operations import Operations
from service.jobs.executor import Executor
from service.jobs.health import Health
from service.opcua.bounded import ListeningServer
from service.opcua.methods import Methods
from service.opcua.session import MOST_CONNECTIONS, CellServer, Permissions, Rules
from service.opcua.trust import OpcuaError, OwnCertificate, Trust, own_certificate, read_own
from service.opcua.vision_system import StateSeen, VisionSystem, method_id, vision_system
from service.records.job import Job
from service.records.journal import Journal
from service.state import State
from service.web.people.tokens import TokenFile, TokenFileError

log = logging.getLogger("combtrace.opcua")

PART = "opcua"
THREAD_ENDS_S = 5.0
LOOK_S = 1.0  # how often recipes are looked at, which may be read again or adopted
AGAIN_S = 10.0
MOST_UNTOLD = 10_000
POLICY = ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt


@dataclass(frozen=True)
class OpcuaSources:
    """The daemon's parts. recipes: as they are now. folder: of certificates."""

    health: Health
    executor: Executor
    journal: Journal
    recipes: Callable[[], Mapping[int, Recipe]]
    folder: Path


@dataclass
class _Signals:
    """From the daemon's loop to one run of the server: there is something new, it is to end."""

    wake: asyncio.Event = field(default_factory=asyncio.Event)
    ends: bool = False


class OpcuaServer:
    """Listens from the start, answers while `run` runs."""

    def __init__(self, settings: Opcua, sources: OpcuaSources) -> None:
        """Raise OpcuaError where users, a certificate of the plant's, or the address cannot be used."""
        self._settings = settings
        self._sources = sources
        self._trust = Trust(sources.folder)
        self._users = users_of(settings)
        if settings.certificate is not None and settings.key is not None:
            read_own(settings.certificate, settings.key)
        self._socket: socket.socket | None = _listening(settings)
        self._untold: deque[StateSeen | Job] = deque(maxlen=MOST_UNTOLD)
        self._wake: Callable[[], None] = lambda: None
        self._listens = False

    async def run(self, operations: Operations) -> None:
        """Serve for ever, in the daemon's loop. What goes wrong here is a warning: jobs go on without it."""
        health = self._sources.health
        if not self._listens:
            health.listen(self._changed)
            self._sources.executor.on_settled.append(self._settled)
            self._listens = True
        methods = Methods(asyncio.get_running_loop(), operations, self._sources.journal)
        while True:
            why = await self._served(methods)
            told = None if isinstance(why, OpcuaError) else why
            log.error("opcua: not served, tried again in %g s: %s", AGAIN_S, why, exc_info=told)
            health.warn(PART, f"OPC UA is not served: {why}")
            await asyncio.sleep(AGAIN_S)
            health.warn(PART, None)

    async def _served(self, methods: Methods) -> Exception:
        """Serve until that ends, and why."""
        self._untold.clear()
        self._changed(self._sources.health.state, self._sources.health.reason)
        loop, signals, thread = asyncio.new_event_loop(), _Signals(), ThreadPoolExecutor(1, PART)

        def wake_up() -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(signals.wake.set)

        def work() -> None:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(self._serve(methods, signals))

        self._wake = wake_up
        serving = asyncio.get_running_loop().run_in_executor(thread, work)
        try:
            await asyncio.shield(serving)
        except Exception as error:  # noqa: BLE001  the owner of defects in this server: the cell outlives it, and tells
            return error
        finally:
            signals.ends = True
            wake_up()
            await asyncio.wait([serving], timeout=THREAD_ENDS_S)
            thread.shutdown(wait=False)
        return OpcuaError("it ended, expected it to run for ever")

    def close(self) -> None:
        """Listen no more, where it has not begun to serve."""
        if self._socket is not None:
            self._socket.close()

    def _changed(self, state: State, reason: str | None) -> None:
        self._untold.append(StateSeen(datetime.now(UTC), state, reason, self._sources.health.job))
        self._wake()

    def _settled(self, job: Job) -> None:
        self._untold.append(job)
        self._wake()

    async def _serve(self, methods: Methods, signals: _Signals) -> None:
        """In the server's own thread."""
        self._trust.open()
        own = await asyncio.to_thread(own_certificate, self._settings, self._sources.folder)
        rules = Rules(self._trust, self._users)
        listener, self._socket = self._socket or _listening(self._settings), None
        with closing(listener):
            server = ListeningServer(CellServer(rules), listener)
            await _prepared(server, own, self.address)
            cell = await vision_system(server)
            rules.reading[method_id("ResultManagement.GetResultById")] = methods.get_result
            rules.ordering[method_id("VisionStateMachine.Halt")] = methods.halt
            rules.ordering[method_id("VisionStateMachine.Reset")] = methods.reset
            last = self._sources.executor.last_settled
            if last is not None:
                await cell.show_result(last, tell=False)
            await self._show(cell)
            await server.start()
            log.info("opcua: %s, clients are trusted by %s", self.address, self._trust.trusted)
            try:
                await self._show_all(cell, signals)
            finally:
                await server.stop()

    async def _show_all(self, cell: VisionSystem, signals: _Signals) -> None:
        while not signals.ends:
            with suppress(TimeoutError):
                async with asyncio.timeout(LOOK_S):
                    await signals.wake.wait()
            signals.wake.clear()
            await self._show(cell)

    async def _show(self, cell: VisionSystem) -> None:
        """What is new, in its order."""
        await cell.show_recipes(self._sources.recipes())
        while self._untold:
            new = self._untold.popleft()
            if isinstance(new, Job):
                await cell.show_result(new)
            else:
                await cell.show_state(new)

    @property
    def address(self) -> str:
        """Where it is, for clients."""
        host = f"[{self._settings.host}]" if ":" in self._settings.host else self._settings.host
        return f"opc.tcp://{host}:{self._settings.port}"


async def _prepared(server: ListeningServer, own: OwnCertificate, address: str) -> None:
    """Its name, certificate and what it asks of a channel."""
    server.set_endpoint(address)
    server.name = "combtrace"
    server.manufacturer_name = "combtrace"
    server.product_uri = "urn:combtrace"
    server.application_type = ua.ApplicationType.Server
    server._application_uri = own.application_uri
    await server.init()
    version = importlib.metadata.version("combtrace")
    await server.set_build_info("urn:combtrace", "combtrace", "combtrace", version, "0", datetime.now(UTC))
    server.set_security_policy([POLICY], Permissions())
    await server.load_certificate(own.certificate, "pem")
    await server.load_private_key(own.key, format="pem")


def users_of(settings: Opcua) -> TokenFile | None:
    """Who may halt and reset; raise OpcuaError."""
    if settings.users_file is None:
        return None
    users = TokenFile(settings.users_file)
    try:
        users.read()
    except TokenFileError as error:
        raise OpcuaError(str(error)) from error
    return users


def _listening(settings: Opcua) -> socket.socket:
    try:
        listener = bound(settings.host, settings.port)
        listener.listen(MOST_CONNECTIONS)
    except OSError as error:
        raise OpcuaError(
            f"{settings.host}:{settings.port} cannot be listened on: {error.strerror or error}. Set another opcua.host "
            "or opcua.port"
        ) from error
    listener.setblocking(False)
    return listener
