"""A local socket by which a person's commands reach the running daemon: one line of JSON asked, one line answered.

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
from collections.abc import Awaitable, Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from service.whole_file import REFUSALS

log = logging.getLogger("combtrace.control")

SOCKET_NAME = "control.sock"
MODE = 0o660
LONGEST_LINE = 4096
LONGEST_REASON = 200
IDLE_S = 10.0
RETRY_S = 1.0
MOST_CLIENTS = 16
PEER_CREDENTIALS = struct.Struct("3i")  # process, user, group: unix(7), SO_PEERCRED
ANSWER_BOUND_S = 15.0

Handler = Callable[[Mapping[str, Any], str], Awaitable[dict[str, Any]]]
"""Gets the request and who asks; gives what is answered. Raises CommandRefused."""


class CommandRefused(Exception):
    """The daemon does not do what was asked: why, and the next step."""


class ControlError(Exception):
    """The daemon cannot be asked: seen, expected, next step."""


class ControlServer:
    """Answers commands. A socket file that is there already is a dead daemon's: the state folder is locked by us."""

    def __init__(self, folder: Path, commands: Mapping[str, Handler]) -> None:
        self._folder = folder
        self._commands = commands
        self._clients = 0

    async def run(self) -> None:
        """Serve for ever, from when the disk lets the socket be made."""
        told = False
        while True:
            try:
                await self._run()
            except OSError as error:
                if error.errno not in REFUSALS:
                    raise
                log.log(logging.DEBUG if told else logging.WARNING, "no control socket, tried again: %s", error)
                told = True
            await asyncio.sleep(RETRY_S)

    async def _run(self) -> None:
        with _bound(self._folder) as listener:
            server = await asyncio.start_unix_server(self._serve, sock=listener, limit=LONGEST_LINE)
            async with server:
                await server.serve_forever()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._clients += 1
        try:
            if self._clients > MOST_CLIENTS:
                writer.write(_line({"ok": False, "error": f"{MOST_CLIENTS} clients are served already. Try again"}))
                return
            await self._answer_all(reader, writer)
        except (OSError, TimeoutError) as error:
            log.debug("a client went: %s", error)
        finally:
            self._clients -= 1
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
            writer.write(_line(await self._answer(line, who)))
            async with asyncio.timeout(IDLE_S):
                await writer.drain()

    async def _answer(self, line: bytes, who: str) -> dict[str, Any]:
        try:
            request = json.loads(line)
        except ValueError:
            return {"ok": False, "error": "no line of JSON"}
        name = request.get("command") if isinstance(request, dict) else None
        handler = self._commands.get(name) if isinstance(name, str) else None
        if handler is None:
            return {"ok": False, "error": f"command {name!r}: expected one of {', '.join(sorted(self._commands))}"}
        try:
            return {"ok": True, **await handler(request, who)}
        except CommandRefused as refused:
            return {"ok": False, "error": str(refused)}


def reason_text(given: str) -> str:
    """What a person gave as a reason, as one line that can be written anywhere, at most LONGEST_REASON characters."""
    line = " ".join(given.encode("utf-8", "backslashreplace").decode().split())
    return "".join(character if character.isprintable() else "?" for character in line)[:LONGEST_REASON]


def ask(folder: Path, request: Mapping[str, Any]) -> dict[str, Any]:
    """What the daemon of a state folder answers; raise ControlError, also where it refuses."""
    path = folder / SOCKET_NAME
    try:
        with _reached(folder) as address, socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.settimeout(ANSWER_BOUND_S)
            client.connect(address)
            client.sendall(_line(request))
            with client.makefile("rb") as answers:
                answer = answers.readline()
    except PermissionError as error:
        raise ControlError(f"{path}: you may not use it. {_who_may(path)}; run as one of them, or with sudo") from error
    except (FileNotFoundError, ConnectionRefusedError, NotADirectoryError) as error:
        raise ControlError(
            f"{path}: no daemon listens. Check that it runs, and that --config names its configuration"
        ) from error
    except OSError as error:
        raise ControlError(f"{path}: the daemon does not answer: {error.strerror or error}") from error
    try:
        told = json.loads(answer)
    except ValueError as error:
        raise ControlError(f"{path}: the daemon ended before it answered. See its log") from error
    if not told.pop("ok", False):
        raise ControlError(str(told.get("error", "refused")))
    return dict(told)


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
