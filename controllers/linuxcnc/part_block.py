"""The part block beside a contour, by part-block.md: standard library only."""

import binascii
import struct

HEADER, RECORD = 16, 12


class Part:
    """A part in its place: rings of (x, y) in mm as a contour's; margin kept, and needed, mm."""

    def __init__(self, number, rings, margin_mm, needed_mm):
        self.number, self.rings = number, rings
        self.margin_mm, self.needed_mm = margin_mm, needed_mm


def belongs_to(block, page, of32):
    """Whether the block came whole, and with this page. of32: gives the 32-bit value at an index of registers."""
    length = HEADER + block[5]
    if length > len(block):
        return False
    words = [*block[:6], 0, 0, *block[8:length]]
    whole = binascii.crc32(struct.pack(f">{length}H", *words)) == of32(block, 6)
    return whole and [*block[2:5], *block[8:10]] == [*page[2:4], page[30], *page[8:10]]


def parts(block, of32, signed):
    """The parts, None where counts, ring table and length contradict one another."""
    count, points, ring_count = block[1], of32(block, 10), block[12]
    if block[0] != 1 or block[5] != RECORD * count + 2 * ring_count + 4 * points:
        return None
    records = [block[HEADER + RECORD * k : HEADER + RECORD * (k + 1)] for k in range(count)]
    table = HEADER + RECORD * count
    sizes = [of32(block, table + 2 * k) for k in range(ring_count)]
    if sum(sizes) != points or sum(record[1] for record in records) != ring_count:
        return None
    if min(sizes, default=3) < 3 or min((record[1] for record in records), default=1) < 1:
        return None
    rings, start = [], table + 2 * ring_count
    for size in sizes:
        places = range(start, start + 4 * size, 4)
        rings.append([(signed(block, at) / 1000, signed(block, at + 2) / 1000) for at in places])
        start += 4 * size
    found = []
    for record in records:
        own, rings = rings[: record[1]], rings[record[1] :]
        found.append(Part(record[0], own, signed(record, 8) / 1000, of32(record, 10) / 1000))
    return found
