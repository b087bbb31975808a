"""All registers that a controller lets be read, and where among them a mailbox lies that is not where it should be."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator

from drivers.controller.mailbox.layout import REGISTERS
from service.probing.link_signature import Registers

SURVEY_S = 60.0  # on a slow line the nearest registers alone can be read in it
BLOCK = 16

Read = Callable[[int, int], Awaitable[tuple[int, ...]]]
"""The registers of address and count; () where they cannot be read."""


async def survey(read: Read, longest: int, near: int, in_time: Callable[[], bool]) -> Registers:
    """What all registers hold, those first that lie near `near`, as long as there is time."""
    known: dict[int, int] = {}

    async def take(first: int, count: int) -> bool:
        registers = await read(first, count)
        known.update(enumerate(registers, start=first))
        return bool(registers)

    for first in sorted(range(0, REGISTERS, longest), key=lambda first: abs(first - near)):
        if not in_time():
            break
        if await take(first, min(longest, REGISTERS - first)):
            continue
        for part in _multiples(first, min(first + longest, REGISTERS)):
            if in_time() and await take(part, 1):
                await take(part, BLOCK)
    for edge, step in list(_edges(known)):
        beyond = edge
        while in_time() and beyond not in known and 0 <= beyond < REGISTERS and await take(beyond, 1):
            beyond += step
    return known


def _multiples(first: int, end: int) -> Iterator[int]:
    """Where blocks begin that touch these registers, at multiples of their length: any row of 16 holds one."""
    yield from range(first // BLOCK * BLOCK, min(end, REGISTERS - BLOCK + 1), BLOCK)


def _edges(known: Registers) -> Iterator[tuple[int, int]]:
    """Registers beside those that are known, and the way that leads on from there."""
    for address in known:
        if address - 1 not in known:
            yield address - 1, -1
        if address + 1 not in known:
            yield address + 1, 1
