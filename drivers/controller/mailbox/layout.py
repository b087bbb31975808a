"""Where the mailbox lies among the controller's holding registers."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from drivers.controller.errors import MailboxError
from drivers.controller.mailbox.blocks import BLOCK_REGISTERS
from drivers.controller.mailbox.pages import HEADER_REGISTERS, REGISTERS_PER_POINT
from drivers.controller.mailbox.part_block import PART_HEADER_REGISTERS
from drivers.controller.mailbox.words import WordOrder

REGISTERS = 65536  # of one Modbus device


@dataclass(frozen=True)
class MailboxLayout:
    """Where the three blocks lie among the controller's holding registers (PDU addresses, 0-based), and word order.

    part_address: where the part block lies that some controllers have besides; None = there is none.
    """

    link_address: int = 0
    service_address: int = 16
    contour_address: int = 32
    payload_capacity: int = 1984
    word_order: WordOrder = "big"
    part_address: int | None = None
    part_capacity: int = 0

    def __post_init__(self) -> None:
        if self.payload_capacity < REGISTERS_PER_POINT or self.payload_capacity % 2:
            raise MailboxError(f"payload_capacity is {self.payload_capacity}, expected an even number from 4 on")
        if self.word_order not in ("big", "little"):
            raise MailboxError(f"word_order is {self.word_order!r}, expected 'big' or 'little'")
        blocks = sorted((start, end, name) for name, (start, end) in self.blocks.items())
        for (start, end, name), (limit, _, obstacle) in pairwise([*blocks, (REGISTERS, 0, "the end")]):
            if start < 0 or end > limit:
                raise MailboxError(
                    f"{name} {start} to {end - 1} runs into {obstacle} at {limit}. Move the blocks apart"
                )

    @property
    def blocks(self) -> dict[str, tuple[int, int]]:
        """First register of each block and the one after its last, by the name of its address."""
        contour_end = self.contour_address + 1 + HEADER_REGISTERS + self.payload_capacity
        blocks = {
            "link_address": (self.link_address, self.link_address + BLOCK_REGISTERS),
            "service_address": (self.service_address, self.service_address + BLOCK_REGISTERS),
            "contour_address": (self.contour_address, contour_end),
        }
        if self.part_address is not None:
            part_end = self.part_address + PART_HEADER_REGISTERS + self.part_capacity
            blocks["part_address"] = (self.part_address, part_end)
        return blocks
