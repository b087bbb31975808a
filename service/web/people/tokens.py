"""Who may give commands from the page: tokens in a file that only its owner may read, and how often one may guess."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import os
import re
import stat
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

MODE = 0o600
LEAST_TOKEN = 20  # characters: `openssl rand -base64 24` gives 32
LARGEST_FILE = 100_000
NAME = r"[A-Za-z0-9_.@-]{1,40}"
LINE = re.compile(rf"({NAME})[ \t]+(\S+)")
WHAT = "a line 'name token' a person"

GUESSES, GUESSES_WITHIN_S = 5, 60.0
COMMANDS, COMMANDS_WITHIN_S = 30, 60.0
MOST_ADDRESSES = 1000


class TokenFileError(Exception):
    """A file of tokens or PINs cannot be used: seen, expected, next step."""


@dataclass(frozen=True)
class TokenFile:
    """Names by the SHA-256 of their tokens; read anew for each command, so that a line taken out counts at once."""

    path: Path

    def holder(self, token: str) -> str | None:
        """Whose token it is, None where nobody's; raise TokenFileError. All are compared, each in constant time."""
        asked = _digest(token)
        found = None
        for name, known in self.read():
            if hmac.compare_digest(asked, known):
                found = name
        return found

    def read(self) -> list[tuple[str, bytes]]:
        """Each person's name and the digest of the token; raise TokenFileError. No message shows a token."""
        holders: list[tuple[str, bytes]] = []
        for number, line in private_lines(self.path, WHAT):
            entry = LINE.fullmatch(line)
            if entry is None:
                raise TokenFileError(f"{self.path}: line {number} is not 'name token', the name of A-Z a-z 0-9 _ . @ -")
            if len(entry[2]) < LEAST_TOKEN:
                raise TokenFileError(
                    f"{self.path}: line {number}: a token of {len(entry[2])} characters, expected {LEAST_TOKEN} or "
                    "more. Make one: openssl rand -base64 24"
                )
            if entry[1] in {name for name, _ in holders}:
                raise TokenFileError(f"{self.path}: line {number}: {entry[1]} is there more than once")
            holders.append((entry[1], _digest(entry[2])))
        if not holders:
            raise TokenFileError(f"{self.path}: holds no token, expected a line 'name token' a person")
        return holders


def private_lines(path: Path, what: str) -> list[tuple[int, str]]:
    """Lines, numbered from 1, of a file that only its owner may read, without empty ones and those that begin with #;
    raise TokenFileError. what: is to be in it.
    """
    lines = ((number, line.strip()) for number, line in enumerate(_private_text(path, what).splitlines(), 1))
    return [(number, line) for number, line in lines if line and not line.startswith("#")]


def _private_text(path: Path, what: str) -> str:
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError as error:
        raise TokenFileError(f"{path}: cannot be read: {error.strerror}. Make it, {what}, mode 0600") from error
    try:
        found = os.fstat(handle)
        mode = stat.S_IMODE(found.st_mode)
        if not stat.S_ISREG(found.st_mode):
            raise TokenFileError(f"{path}: is no file. Make it, {what}, mode 0600")
        if mode != MODE:
            raise TokenFileError(f"{path}: has mode {mode:04o}, expected 0600. chmod 600, and make new ones")
        if found.st_uid != os.geteuid():
            raise TokenFileError(
                f"{path}: belongs to user {found.st_uid}, expected {os.geteuid()}, as whom the service runs. chown"
            )
        return os.read(handle, LARGEST_FILE).decode("ascii")
    except UnicodeDecodeError as error:
        raise TokenFileError(f"{path}: byte {error.start + 1} is no ASCII, expected {what}") from error
    finally:
        os.close(handle)


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()


class Rate:
    """At most `count` of something within `within_s`, for each key; the longest unused of many keys is forgotten."""

    def __init__(
        self, count: int, within_s: float, *, most_keys: int = MOST_ADDRESSES, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._count = count
        self._within_s = within_s
        self._most_keys = most_keys
        self._now = now
        self._times: OrderedDict[str, deque[float]] = OrderedDict()

    def wait_s(self, key: str) -> float:
        """How long until one more is allowed; 0 = now."""
        times = self._times.get(key)
        if times is None or len(times) < self._count:
            return 0.0
        return max(times[0] + self._within_s - self._now(), 0.0)

    def add(self, key: str) -> None:
        """Count one."""
        self._times.setdefault(key, deque(maxlen=self._count)).append(self._now())
        self._times.move_to_end(key)
        if len(self._times) > self._most_keys:
            self._times.popitem(last=False)

    def take_back(self, key: str) -> None:
        """Count one less: the newest."""
        times = self._times.get(key)
        if times:
            times.pop()


def network_of(address: str) -> str:
    """What guesses from an address are counted under: itself, of IPv6 its /64, which one computer has whole."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(found, ipaddress.IPv6Address):
        mapped = found.ipv4_mapped
        return str(mapped) if mapped else str(ipaddress.ip_network((found, 64), strict=False))
    return str(found)
