"""A local socket by which a person's commands reach the running daemon: a line of JSON asked, one or more answered.

Who may use it is decided by the file system: the socket has mode 0660 and lies in the state folder.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import pwd
import socket
import stat
import struct
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from service.atomic_file import REFUSALS

log = logging.getLogger("combtrace.control")

SOCKET_NAME = "control.sock"
MODE = 0o660
LONGEST_LINE = 4096
LONGEST_REASON = 200
IDLE_S = 10.0
RETRY_S = 1.0
MOST_CLIENTS = 16
MOST_STREAMS = 8  # of them, those that wait for the end of a job: a halt has to find a place
PEER_CREDENTIALS = struct.Struct("3i")  # process, user, group: unix(7), SO_PEERCRED
ANSWER_BOUND_S = 15.0

Handler = Callable[[Mapping[str, Any], str], Awaitable[dict[str, Any]]]
"""Gets the request and who asks; gives what is answered. Raises CommandRefused."""

Stream = Callable[[Mapping[str, Any], str], AsyncIterator[dict[str, Any]]]
"""The same with several answers, as they come; the connection is closed after the last."""


class CommandRefused(Exception):
    """The daemon does not do what was asked: why, and the next step."""


class ControlError(Exception):
    """The daemon cannot be asked: seen, expected, next step."""


class ControlServer:
    """Answers commands. A socket file that is there already is a dead daemon's: the state folder is locked by us."""

    def __init__(
        self, folder: Path, commands: Mapping[str, Handler], streams: Mapping[str, Stream] | None = None
    ) -> None:
        self._folder = folder
        self._commands = commands
        self._streams = streams or {}
        self._streaming = 0
        self._clients: set[asyncio.Task[Any]] = set()

    async def run(self) -> None:
        """Serve for ever, from when the disk lets the socket be made."""
        warned = False
        while True:
            try:
                await self._run()
            except OSError as error:
                if error.errno not in REFUSALS:
                    raise
                log.log(logging.DEBUG if warned else logging.WARNING, "no control socket, tried again: %s", error)
                warned = True
            await asyncio.sleep(RETRY_S)

    async def _run(self) -> None:
        with _bound(self._folder) as listener:
            server = await asyncio.start_unix_server(self._serve, sock=listener, limit=LONGEST_LINE)
            try:
                await asyncio.get_running_loop().create_future()
            finally:
                server.close()
                for client in self._clients:  # one that waits for the end of a job must not hold up ours
                    client.cancel()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients.add(task)
        try:
            if len(self._clients) > MOST_CLIENTS:
                writer.write(_line({"ok": False, "error": f"{MOST_CLIENTS} clients are served already. Try again"}))
                return
            await self._answer_all(reader, writer)
        except (OSError, TimeoutError) as error:
            log.debug("a client went: %s", error)
        finally:
            self._clients.discard(task)
            with contextlib.suppress(OSError):
                writer.close()

    async def _answer_all(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        who = _peer(writer)
        while True:
            try:
                async with asyncio.timeout(IDLE_S):
                    line = await reader.readline()
            except ValueError:
                writer.write(_line({"ok": False, "error": f"a line beyond {LONGEST_LINE} bytes"}))
                return
            if not line.endswith(b"\n"):
                return
            try:
                request = json.loads(line)
            except ValueError:
                request = None
            name = request.get("command") if isinstance(request, dict) else None
            stream = self._streams.get(name) if isinstance(name, str) else None
            if stream is not None:
                await self._tell_all(stream, request, who, writer)
                return
            await _send(writer, await self._answer(request, name, who))

    async def _answer(self, request: Any, name: Any, who: str) -> dict[str, Any]:
        if request is None:
            return {"ok": False, "error": "no line of JSON"}
        handler = self._commands.get(name) if isinstance(name, str) else None
        if handler is None:
            known = ", ".join(sorted([*self._commands, *self._streams]))
            return {"ok": False, "error": f"command {name!r}: expected one of {known}"}
        try:
            return {"ok": True, **await handler(request, who)}
        except CommandRefused as refused:
            return {"ok": False, "error": str(refused)}

    async def _tell_all(
        self, stream: Stream, request: Mapping[str, Any], who: str, writer: asyncio.StreamWriter
    ) -> None:
        if self._streaming >= MOST_STREAMS:
            await _send(writer, {"ok": False, "error": f"{MOST_STREAMS} wait for ends of jobs already. Try again"})
            return
        self._streaming += 1
        try:
            async for answer in stream(request, who):
                await _send(writer, {"ok": True, **answer})
        except CommandRefused as refused:
            await _send(writer, {"ok": False, "error": str(refused)})
        finally:
            self._streaming -= 1


async def _send(writer: asyncio.StreamWriter, answer: Mapping[str, Any]) -> None:
    writer.write(_line(answer))
    async with asyncio.timeout(IDLE_S):
        await writer.drain()


def reason_text(given: str) -> str:
    """What a person gave as a reason, as one line that can be written anywhere, at most LONGEST_REASON characters."""
    line = " ".join(given.encode("utf-8", "backslashreplace").decode().split())
    return "".join(character if character.isprintable() else "?" for character in line)[:LONGEST_REASON]


def ask(folder: Path, request: Mapping[str, Any]) -> dict[str, Any]:
    """What the daemon of a state folder answers; raise ControlError, also where it refuses."""
    for answer in answers(folder, request, ANSWER_BOUND_S):
        return answer
    raise ControlError(f"{folder / SOCKET_NAME}: the daemon ended before it answered. See its log")


def answers(folder: Path, request: Mapping[str, Any], bound_s: float) -> Iterator[dict[str, Any]]:
    """All that the daemon of a state folder answers within `bound_s`, as it comes; raise ControlError as `ask` does."""
    path = folder / SOCKET_NAME
    give_up_at_s = time.monotonic() + bound_s
    try:
        with _reached(folder) as address, socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.settimeout(bound_s)
            client.connect(address)
            client.sendall(_line(request))
            with client.makefile("rb") as lines:
                while line := lines.readline():
                    yield _answer_of(line, path)
                    client.settimeout(max(give_up_at_s - time.monotonic(), 0.001))
    except ConnectionResetError:
        return  # it went: whoever waits for more sees that there is none
    except PermissionError as error:
        raise ControlError(f"{path}: you may not use it. {_who_may(path)}; run as one of them, or with sudo") from error
    except (FileNotFoundError, ConnectionRefusedError, NotADirectoryError) as error:
        raise ControlError(
            f"{path}: no daemon listens. Check that it runs, and that --config names its configuration"
        ) from error
    except OSError as error:
        raise ControlError(f"{path}: the daemon does not answer: {error.strerror or error}") from error


def _answer_of(line: bytes, path: Path) -> dict[str, Any]:
    try:
        answer = json.loads(line)
    except ValueError as error:
        raise ControlError(f"{path}: the daemon ended before it answered. See its log") from error
    if not answer.pop("ok", False):
        raise ControlError(str(answer.get("error", "refused")))
    return dict(answer)


@contextlib.contextmanager
def _reached(folder: Path) -> Iterator[str]:
    """An address of the socket that is short enough, however long the folder's path: 107 bytes are all there are."""
    opened = os.open(folder, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{opened}/{SOCKET_NAME}"
    finally:
        os.close(opened)


@contextlib.contextmanager
def _bound(folder: Path) -> Iterator[socket.socket]:
    """The listening socket; its file is there for the time of it, never with more rights than MODE."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / SOCKET_NAME
    with contextlib.suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise ControlError(f"{path}: is no socket, expected nothing or an old one. Move it away")
        path.unlink()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as listener:
        os.fchmod(listener.fileno(), MODE)  # before bind: the file is made with it, less the umask
        with _reached(folder) as address:
            listener.bind(address)
        path.chmod(MODE)
        try:
            yield listener
        finally:
            path.unlink(missing_ok=True)


def _line(fields: Mapping[str, Any]) -> bytes:
    return json.dumps(fields, ensure_ascii=False).encode() + b"\n"


def _peer(writer: asyncio.StreamWriter) -> str:
    """Who asks, as the kernel says."""
    credentials = writer.get_extra_info("socket").getsockopt(
        socket.SOL_SOCKET, socket.SO_PEERCRED, PEER_CREDENTIALS.size
    )
    _, user, _ = PEER_CREDENTIALS.unpack(credentials)
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return f"user {user}"


def _who_may(path: Path) -> str:
    import grp

    for known in (path, path.parent):  # a folder that may not be entered hides the socket in it
        with contextlib.suppress(OSError, KeyError):
            found = known.stat()
            owner, group = pwd.getpwuid(found.st_uid).pw_name, grp.getgrgid(found.st_gid).gr_name
            return f"User {owner} and group {group} may"
    return "Its owner and group may"
