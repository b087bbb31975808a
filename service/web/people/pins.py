"""People by short PINs: a file that holds hashes alone, and how often a PIN may be guessed."""

from __future__ import annotations

import base64
import hashlib
import hmac
import os
import re
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from service.web.people.tokens import NAME, TokenFileError, private_lines

PIN = re.compile(r"[0-9]{4,12}")
LINE = re.compile(rf"({NAME})[ \t]+scrypt\$([0-9]+)\$([A-Za-z0-9+/=]+)\$([A-Za-z0-9+/=]+)")
WHAT = "a line of `combtrace pin NAME` a person"
COST, BLOCK, LANES = 14, 8, 1  # scrypt's log2 N, r, p: 16 MB and some 50 ms a try
COSTS = range(COST, 18)  # others are a mistake, or would hold the page up
SALT_BYTES, HASH_BYTES = 16, 32
MOST_MEMORY = 2**29

FREE_TRIES = 3  # a person's; mistyping is no guessing
FREE_TRIES_OF_ADDRESS = 5  # a panel that several people share
FIRST_LOCK_S, LONGEST_LOCK_S = 30.0, 3600.0
FORGOTTEN_S = 24 * 3600.0
MOST_KEYS = 1000


def hashed(pin: str, salt: bytes, cost: int = COST) -> bytes:
    """The PIN's scrypt hash."""
    return hashlib.scrypt(pin.encode(), salt=salt, n=1 << cost, r=BLOCK, p=LANES, maxmem=MOST_MEMORY, dklen=HASH_BYTES)


def line_of(name: str, pin: str) -> str:
    """A person's line for the file; raise ValueError where name or PIN is none."""
    if re.fullmatch(NAME, name) is None:
        raise ValueError(f"{name!r} is no name: expected up to 40 of A-Z a-z 0-9 _ . @ -")
    if PIN.fullmatch(pin) is None:
        raise ValueError("that is no PIN: expected 4 to 12 digits")
    salt = os.urandom(SALT_BYTES)
    return f"{name} scrypt${COST}${_text(salt)}${_text(hashed(pin, salt))}"


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


@dataclass(frozen=True)
class Person:
    """Somebody who may give orders, with what their PIN is checked by."""

    name: str
    cost: int
    salt: bytes
    hash: bytes

    def has(self, pin: str) -> bool:
        """True where it is theirs."""
        return hmac.compare_digest(hashed(pin, self.salt, self.cost), self.hash)


NOBODY = Person("", COST, b"\0" * SALT_BYTES, b"\0" * HASH_BYTES)
"""Checked where there is no such person, so that the answer takes as long."""


@dataclass(frozen=True)
class PeopleFile:
    """Read anew for each order, so that a line taken out counts at once."""

    path: Path

    def holds(self, name: str, pin: str) -> bool:
        """True where the PIN is that person's; raise TokenFileError. Takes as long for a name that is not there."""
        person = next((one for one in self.read() if one.name == name), NOBODY)
        return person.has(pin) and person is not NOBODY

    def read(self) -> list[Person]:
        """Everybody; raise TokenFileError."""
        people: list[Person] = []
        for number, line in private_lines(self.path, WHAT):
            entry = LINE.fullmatch(line)
            if entry is None:
                raise TokenFileError(f"{self.path}: line {number} is not {WHAT}")
            people.append(self._person(entry, number))
            if people[-1].name in {one.name for one in people[:-1]}:
                raise TokenFileError(f"{self.path}: line {number}: {people[-1].name} is there more than once")
        if not people:
            raise TokenFileError(f"{self.path}: holds nobody, expected {WHAT}")
        return people

    def _person(self, entry: re.Match[str], number: int) -> Person:
        try:
            salt, kept = base64.b64decode(entry[3], validate=True), base64.b64decode(entry[4], validate=True)
        except ValueError as error:
            raise TokenFileError(f"{self.path}: line {number} is damaged, expected {WHAT}") from error
        if int(entry[2]) not in COSTS or len(kept) != HASH_BYTES or len(salt) < SALT_BYTES:
            raise TokenFileError(f"{self.path}: line {number} is damaged, expected {WHAT}")
        return Person(entry[1], int(entry[2]), salt, kept)


class Tries:
    """Wrong tries by a key: after some free ones each further one locks it for twice as long."""

    def __init__(self, free: int, *, now: Callable[[], float] = time.monotonic) -> None:
        self._free = free
        self._now = now
        self._wrong: OrderedDict[str, tuple[int, float]] = OrderedDict()  # how many, and when the last one was

    def wait_s(self, key: str) -> float:
        """How long the key is locked; 0 = it is not."""
        count, last_s = self._wrong.get(key, (0, 0.0))
        if count < self._free:
            return 0.0
        lock_s = min(FIRST_LOCK_S * 2.0 ** min(count - self._free, 20), LONGEST_LOCK_S)
        return max(last_s + lock_s - self._now(), 0.0)

    def wrong(self, key: str) -> None:
        """One more. Those of a day ago are forgotten; of too many keys the longest unused."""
        count, last_s = self._wrong.get(key, (0, 0.0))
        now_s = self._now()
        self._wrong[key] = (1 if now_s - last_s > FORGOTTEN_S else count + 1), now_s
        self._wrong.move_to_end(key)
        if len(self._wrong) > MOST_KEYS:
            self._wrong.popitem(last=False)

    def right(self, key: str) -> None:
        """Forget all of its."""
        self._wrong.pop(key, None)
