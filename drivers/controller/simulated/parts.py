"""The simulated controller's reading of the part block: written from part-block.md's text, not from the codec."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

from drivers.controller.mailbox.words import WordOrder
from drivers.controller.simulated.contour import AcceptedPart, Contradiction, PageCopy, i32, u32

HEADER, RECORD = 16, 12
LENGTH = 5  # offset of the payload's length


class PartCopy:
    """The controller's own copy of the part block."""

    def __init__(self, block: Sequence[int], word_order: WordOrder) -> None:
        self.registers = tuple(block)
        self.word_order = word_order
        self.layout, self.count = block[0], block[1]
        self.job_id, self.session = u32(block, 2, word_order), block[4]
        self.length = block[LENGTH]
        self.crc32, self.page_crc32 = u32(block, 6, word_order), u32(block, 8, word_order)
        self.point_count, self.ring_count = u32(block, 10, word_order), block[12]

    def belongs_to(self, page: PageCopy) -> bool:
        """True where it came whole, and with this page."""
        if len(self.registers) != HEADER + self.length:
            return False
        checked = list(self.registers)
        checked[6] = checked[7] = 0
        whole = zlib.crc32(struct.pack(f">{len(checked)}H", *checked)) == self.crc32
        own = (self.job_id, self.session, self.page_crc32) == (page.job_id, page.session, page.crc32)
        return whole and own

    def parts(self) -> tuple[AcceptedPart, ...]:
        """The parts; raise Contradiction where counts and registers do not agree."""
        if self.layout != 1:
            raise Contradiction(f"part_layout {self.layout}")
        if self.length != RECORD * self.count + 2 * self.ring_count + 4 * self.point_count:
            raise Contradiction(
                f"{self.count} parts, {self.ring_count} rings and {self.point_count} points in {self.length} registers"
            )
        table = HEADER + RECORD * self.count
        sizes = [u32(self.registers, table + 2 * ring, self.word_order) for ring in range(self.ring_count)]
        records = [self.registers[HEADER + RECORD * k : HEADER + RECORD * (k + 1)] for k in range(self.count)]
        if sum(sizes) != self.point_count or sum(record[1] for record in records) != self.ring_count:
            raise Contradiction(f"the ring table says {sizes}, {self.point_count} points, {self.ring_count} rings")
        if min(sizes, default=3) < 3 or min((record[1] for record in records), default=1) < 1:
            raise Contradiction("a part without a ring, or a ring of fewer than 3 vertices")
        rings, start = [], table + 2 * self.ring_count
        for size in sizes:
            rings.append(tuple(self._point(start + 4 * k) for k in range(size)))
            start += 4 * size
        return tuple(self._part(record, rings) for record in records)

    def _point(self, offset: int) -> tuple[float, float]:
        x, y = (i32(self.registers, offset + 2 * k, self.word_order) / 1000 for k in (0, 1))
        return x, y

    def _part(self, record: Sequence[int], rings: list[tuple[tuple[float, float], ...]]) -> AcceptedPart:
        """The part of a record, which takes its rings from the front of the list."""
        own = tuple(rings.pop(0) for _ in range(record[1]))
        x, y, angle, margin = (i32(record, offset, self.word_order) for offset in (2, 4, 6, 8))
        needed = u32(record, 10, self.word_order)
        return AcceptedPart(record[0], x / 1000, y / 1000, angle / 1e6, margin / 1000, needed / 1000, own)


def may_be_cut(offset: int, block: Sequence[int]) -> bool:
    """True where no value of the block lies on both sides of `offset`, so that a request may begin or end there."""
    if offset <= HEADER:
        return offset not in (3, 7, 9, 11)
    records = HEADER + RECORD * block[1]
    table = records + 2 * block[12]
    if offset <= records:
        return (offset - HEADER) % RECORD in (0, 1, 2, 6, 8, 10)
    return (offset - records) % 2 == 0 if offset <= table else (offset - table) % 4 == 0
