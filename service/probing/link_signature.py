"""How a controller numbers its registers and orders its words, told from what stands and moves in them.

The service and the controller's program may each be right and yet not meet: one counts registers from 0, the other
from 1, or the halves of a 32-bit value go in another order. Both show in the link block: in `test_echo`, which the
controller computes from `test_value`, and in which registers move.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.words import WordOrder

SHIFTS = (0, 1, -1)
ORDERS: tuple[WordOrder, ...] = ("big", "little")
STATE, HEARTBEAT, ACK_RESULT, ECHO, LAST_RESULT, SESSION, CLOCK = 0, 1, 7, 8, 12, 13, 14  # offsets in the link block
HIGHEST_STATE = 3
ANSWERS = range(12)  # 0 is none
TEST_VALUE = 8  # offset in the service block
FEWEST_BEATS = 2  # a state may change once in the meantime
Registers = Mapping[int, int]
"""What was read, by PDU address."""


@dataclass(frozen=True)
class Signature:
    """How the controller sees the mailbox. shift: registers by which its blocks lie higher than configured."""

    shift: int
    word_order: WordOrder | None


def from_echo(registers: Registers, layout: MailboxLayout) -> list[Signature]:
    """Every way of seeing in which `test_echo` is `test_value` + 1, from one look at both blocks."""
    ways: list[Signature] = []
    for shift in SHIFTS:
        values, echoes = layout.service_address + TEST_VALUE + shift, layout.link_address + ECHO + shift
        ways += [Signature(shift, order) for order in ORDERS if _echoes(registers, values, echoes, order)]
    return ways


def from_mailbox(known: Registers, layout: MailboxLayout) -> list[Signature]:
    """Every way of seeing in which link and service block hold what a mailbox holds, wherever they lie."""
    ways = []
    for address in known:
        shift = address - layout.link_address
        if known[address] <= HIGHEST_STATE and _may_be_link(known, address):
            values, echoes = layout.service_address + shift + TEST_VALUE, address + ECHO
            ways += [Signature(shift, order) for order in ORDERS if _echoes(known, values, echoes, order)]
    return ways


def _may_be_link(known: Registers, link: int) -> bool:
    results = (known.get(link + ACK_RESULT), known.get(link + LAST_RESULT))
    return bool(known.get(link + SESSION)) and all(result in ANSWERS for result in results)


def _echoes(registers: Registers, values: int, echoes: int, order: WordOrder) -> bool:
    value, echo = _u32(registers, values, order), _u32(registers, echoes, order)
    return value is not None and echo == (value + 1) % 2**32


def from_movement(looks: Sequence[Registers], layout: MailboxLayout, shifts: Iterable[int] = SHIFTS) -> list[Signature]:
    """Every way of seeing in which the heartbeat moves and `controller_state` hardly does, from looks over some time.

    The word order follows from `clock`, of which the lower half moves fast, the higher one hardly ever.
    """
    moves = {
        address: sum(before.get(address) != after.get(address) for before, after in pairwise(looks))
        for address in looks[0]
    }
    ways = []
    for shift in shifts:
        start = layout.link_address + shift
        beats = moves.get(start + HEARTBEAT, 0)
        if beats >= FEWEST_BEATS and 2 * moves.get(start + STATE, 0) < beats:
            high, low = moves.get(start + CLOCK, 0), moves.get(start + CLOCK + 1, 0)
            order: WordOrder | None = None if high == low else "big" if low > high else "little"
            ways.append(Signature(shift, order))
    return ways


def _u32(registers: Registers, address: int, order: WordOrder) -> int | None:
    first, second = registers.get(address), registers.get(address + 1)
    if first is None or second is None:
        return None
    return first << 16 | second if order == "big" else second << 16 | first
