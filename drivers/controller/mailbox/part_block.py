"""The part block: where a job's parts lie in its contour, as registers beside the contour block's.

It is written before the last page's commit and belongs to that page alone, whose CRC it names. A controller that does
not know it reads nothing of it.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.controller.errors import ContourTooLarge, MailboxError
from drivers.controller.mailbox.pages import REGISTERS_PER_POINT, Page, crc32_of, decode_header
from drivers.controller.mailbox.words import WordOrder, fields, pack, words32

PART_HEADER_REGISTERS = 16
PART_RECORD_REGISTERS = 12

PART_HEADER_FIELDS = fields(
    (0, "part_layout", "u16"),
    (1, "part_count", "u16"),
    (2, "job_id", "u32"),
    (4, "session", "u16"),
    (5, "part_length", "u16"),
    (6, "part_crc32", "u32"),
    (8, "page_crc32", "u32"),
    (10, "part_points", "u32"),
    (12, "part_rings", "u16"),
)
PART_RECORD_FIELDS = fields(
    (0, "part", "u16"),
    (1, "rings", "u16"),
    (2, "x", "i32"),
    (4, "y", "i32"),
    (6, "angle", "i32"),
    (8, "margin", "i32"),
    (10, "needed", "u32"),
)
_CRC = slice(6, 8)


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """One part in its place. number: its place in the recipe's list, from 1. Lengths µm.

    x_um, y_um, angle_udeg: the drawing turned by so many millionths of a degree, counter-clockwise, then moved.
    rings_um: its outline there, as a contour message's rings. margin_um: the least distance to the contour that was
        reached; needed_um: what it must be, the contour's bound in it.
    """

    number: int
    x_um: int
    y_um: int
    angle_udeg: int
    margin_um: int
    needed_um: int
    rings_um: tuple[NDArray[np.integer], ...]


def with_parts(
    pages: Sequence[Page], parts: Sequence[PlacedPart], capacity: int, word_order: WordOrder
) -> tuple[Page, ...]:
    """The pages of a contour, the last of which brings the part block along; of a job without parts an empty one.

    capacity: registers that the block has behind its header. ContourTooLarge: it takes more. MailboxError: a value that
    its register cannot hold.
    """
    last = pages[-1]
    payload = [word for part in parts for word in _record(part, word_order)]
    rings = [ring for part in parts for ring in part.rings_um]
    payload += words32([len(ring) for ring in rings], word_order)
    payload += words32(np.concatenate(rings), word_order) if rings else ()
    points = sum(len(ring) for ring in rings)
    if len(payload) > capacity:
        raise ContourTooLarge(
            f"{len(parts)} part(s) of {points} vertices take {len(payload)} registers, part_block.capacity is "
            f"{capacity}. Raise it, or draw the part with fewer vertices"
        )
    of_page = decode_header(last, word_order)
    values = {
        "part_layout": 1,
        "part_count": len(parts),
        "job_id": of_page["job_id"],
        "session": of_page["session"],
        "part_length": len(payload),
        "part_crc32": 0,
        "page_crc32": crc32_of(last.header, last.payload),
        "part_points": points,
        "part_rings": len(rings),
    }
    header = pack(PART_HEADER_FIELDS, values, PART_HEADER_REGISTERS, word_order)
    header[_CRC] = words32([part_crc32_of([*header, *payload])], word_order)
    return (*pages[:-1], replace(last, part=(*header, *payload)))


def part_crc32_of(block: Sequence[int]) -> int:
    """CRC-32 of a part block, header and payload, with the CRC's own two registers as 0; as a page's."""
    registers = np.asarray(block, dtype=">u2")
    registers[_CRC] = 0
    return zlib.crc32(registers.tobytes())


def part_starts(block: Sequence[int]) -> list[int]:
    """Offsets in the part block at which a request may begin, ascending, then its end.

    Where the header contradicts itself, as a torn one that was read back does, the block's length rules.
    """
    end = len(block)
    records_end = min(PART_HEADER_REGISTERS + PART_RECORD_REGISTERS * block[1], end)
    table_end = min(records_end + 2 * block[12], end)
    records = [
        start + offset
        for start in range(PART_HEADER_REGISTERS, records_end, PART_RECORD_REGISTERS)
        for offset in (0, 6)
    ]
    pairs = range(table_end, end, REGISTERS_PER_POINT)
    return [0, *(start for start in records if start < end), *range(records_end, table_end, 2), *pairs, end]


def _record(part: PlacedPart, word_order: WordOrder) -> list[int]:
    if not part.rings_um:
        raise MailboxError(f"part {part.number} has no ring, expected its exterior and its holes")
    values = {
        "part": part.number,
        "rings": len(part.rings_um),
        "x": part.x_um,
        "y": part.y_um,
        "angle": part.angle_udeg,
        "margin": part.margin_um,
        "needed": part.needed_um,
    }
    return pack(PART_RECORD_FIELDS, values, PART_RECORD_REGISTERS, word_order)
