"""What systemd is told: readiness, state, stopping, and signs of life that come from work done. sd_notify(3)."""

from __future__ import annotations

import logging
import os
import socket
import time
from collections.abc import Callable, Iterable, Mapping

log = logging.getLogger("combtrace.systemd")

SENDS_A_LIMIT = 10  # signs of life are told no more often than so many times in the time that systemd waits


class Notifier:
    """Sends to the socket that systemd names in the environment; without one it does nothing. Never raises."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        self._address = environment.get("NOTIFY_SOCKET", "")
        if self._address.startswith("@"):
            self._address = "\0" + self._address[1:]
        mine = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        limit = environment.get("WATCHDOG_USEC", "") if mine else ""
        self.watchdog_s = int(limit) / 1e6 if limit.isdigit() else 0.0
        self._failed = False

    def send(self, **fields: str | int) -> None:
        """Send assignments, such as READY=1 and STATUS=…; a line break in a value becomes a space."""
        if not self._address:
            return
        text = "\n".join(f"{name}={' '.join(str(value).splitlines())}" for name, value in fields.items())
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as sender:
                sender.sendto(text.encode("utf-8", "backslashreplace"), self._address)
        except OSError as error:
            log.log(logging.DEBUG if self._failed else logging.WARNING, "systemd cannot be told: %s", error)
            self._failed = True


class Watchdog:
    """Tells systemd that the service lives once every part has got something done since it was told last.

    No timer feeds it: where one part hangs, in whatever call, nothing is told, and systemd starts the service anew.
    """

    def __init__(self, notifier: Notifier, *, now: Callable[[], float] = time.monotonic) -> None:
        self._notifier = notifier
        self._now = now
        self._parts: frozenset[str] = frozenset()
        self._silent: set[str] = set()
        self._sent_at = -1e9

    def watch(self, parts: Iterable[str]) -> None:
        """The parts without whose work nothing is told."""
        self._parts = frozenset(parts)
        self._silent = set(self._parts)

    @property
    def silent(self) -> frozenset[str]:
        """Parts that have got nothing done since systemd was told last."""
        return frozenset(self._silent)

    def feed(self, part: str) -> None:
        """A part has got something done."""
        self._silent.discard(part)
        if self._silent or not self._parts or not self._notifier.watchdog_s:
            return
        if self._now() - self._sent_at >= self._notifier.watchdog_s / SENDS_A_LIMIT:
            self._sent_at = self._now()
            self._silent = set(self._parts)
            self._notifier.send(WATCHDOG=1)
