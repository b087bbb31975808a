"""The contour mailbox as a controller reads it, written from `protocol.md` alone.

It shares no line with the service's codec, so that both ends cannot share a mistake. Standard library only.
Registers become dataclasses and back; the faults of a page or a contour are told in words. What a controller
answers to them stands in `tests.support.controller.played_controller`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

FLAG_NOT_LIVE, FLAG_HOLES, FLAG_LAST_PAGE, FLAG_ALIGNED = 1, 2, 4, 8
UNCERTAINTY_UNKNOWN = 0xFFFFFFFF
HEADER_LENGTH = 32

Point = tuple[int, int]
Ring = tuple[Point, ...]


# --- registers <-> numbers -----------------------------------------------------------------------------------------


def u32_from(registers: Sequence[int], word_order: str) -> int:
    """The 32-bit number in two registers: `big` has the high word first, `little` the low word."""
    first, second = registers
    return first << 16 | second if word_order == "big" else second << 16 | first


def i32_from(registers: Sequence[int], word_order: str) -> int:
    """The signed number in two registers, two's complement."""
    value = u32_from(registers, word_order)
    return value - (1 << 32) if value >> 31 else value


def words_of(value: int, word_order: str) -> list[int]:
    """Two registers of a 32-bit number, signed or not."""
    bits = value & 0xFFFFFFFF
    words = [bits >> 16, bits & 0xFFFF]
    return words if word_order == "big" else words[::-1]


def crc32(data: bytes) -> int:
    """CRC-32 of IEEE 802.3, bit by bit: reflected polynomial 0xEDB88320, start and final inversion all ones."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xEDB88320 if crc & 1 else crc >> 1
    return crc ^ 0xFFFFFFFF


def page_crc(header: Sequence[int], payload: Sequence[int]) -> int:
    """The CRC a page must carry: header offsets 1 to 31 with 8 and 9 taken as 0, then the payload, big-endian."""
    covered = [*header[1:8], 0, 0, *header[10:32], *payload]
    return crc32(b"".join(register.to_bytes(2, "big") for register in covered))


# --- the three blocks ----------------------------------------------------------------------------------------------

# offset, kind of each field, in the order of the protocol's tables
LINK_FIELDS = {
    "controller_state": (0, "u16"),
    "controller_heartbeat": (1, "u16"),
    "trigger_counter": (2, "u16"),
    "recipe": (3, "u16"),
    "block_thickness": (4, "u32"),
    "ack_transfer": (6, "u16"),
    "ack_result": (7, "u16"),
    "test_echo": (8, "u32"),
    "last_job": (10, "u32"),
    "last_result": (12, "u16"),
    "session": (13, "u16"),
    "clock": (14, "u32"),
}
SERVICE_FIELDS = {
    "protocol_version": (0, "u16"),
    "service_state": (1, "u16"),
    "service_heartbeat": (2, "u16"),
    "trigger_ack": (3, "u16"),
    "missed_triggers": (4, "u16"),
    "reject_reason": (5, "u16"),
    "job_id": (6, "u32"),
    "test_value": (8, "u32"),
    "session_ack": (10, "u16"),
    "owner": (11, "u16"),
    "settled_job": (12, "u32"),
    "reserved": (14, "u32"),
}
HEADER_FIELDS = {
    "transfer": (0, "u16"),
    "layout": (1, "u16"),
    "job_id": (2, "u32"),
    "page": (4, "u16"),
    "page_count": (5, "u16"),
    "ring_count": (6, "u16"),
    "payload_length": (7, "u16"),
    "crc32": (8, "u32"),
    "point_count": (10, "u32"),
    "min_x": (12, "i32"),
    "min_y": (14, "i32"),
    "max_x": (16, "i32"),
    "max_y": (18, "i32"),
    "area": (20, "u32"),
    "uncertainty": (22, "u32"),
    "captured_at": (24, "u32"),
    "recipe": (26, "u16"),
    "flags": (27, "u16"),
    "valid_for": (28, "u32"),
    "session": (30, "u16"),
    "trigger": (31, "u16"),
}
# what may differ between the pages of one job: page, payload_length, crc32, flags (and the commit register)
PER_PAGE_OFFSETS = frozenset({0, 4, 7, 8, 9, 27})


@dataclass(frozen=True)
class Link:
    """The link block. Lengths in micrometres, times in milliseconds."""

    controller_state: int = 0
    controller_heartbeat: int = 0
    trigger_counter: int = 0
    recipe: int = 0
    block_thickness: int = 0
    ack_transfer: int = 0
    ack_result: int = 0
    test_echo: int = 0
    last_job: int = 0
    last_result: int = 0
    session: int = 0
    clock: int = 0


@dataclass(frozen=True)
class Service:
    """The service block."""

    protocol_version: int = 0
    service_state: int = 0
    service_heartbeat: int = 0
    trigger_ack: int = 0
    missed_triggers: int = 0
    reject_reason: int = 0
    job_id: int = 0
    test_value: int = 0
    session_ack: int = 0
    owner: int = 0
    settled_job: int = 0
    reserved: int = 0


@dataclass(frozen=True)
class Header:
    """The contour block's header. Lengths in micrometres, area in square millimetres, times in milliseconds."""

    transfer: int
    layout: int
    job_id: int
    page: int
    page_count: int
    ring_count: int
    payload_length: int
    crc32: int
    point_count: int
    min_x: int
    min_y: int
    max_x: int
    max_y: int
    area: int
    uncertainty: int
    captured_at: int
    recipe: int
    flags: int
    valid_for: int
    session: int
    trigger: int


def _decode(table: dict[str, tuple[int, str]], registers: Sequence[int], word_order: str) -> dict[str, int]:
    length = max(offset + (1 if kind == "u16" else 2) for offset, kind in table.values())
    if len(registers) != length:
        raise ValueError(f"seen {len(registers)} registers, expected {length}")
    if any(not 0 <= register <= 0xFFFF for register in registers):
        raise ValueError(f"a register outside 0 to 65535 in {list(registers)}")
    values = {}
    for name, (offset, kind) in table.items():
        pair = registers[offset : offset + 2]
        if kind == "u16":
            values[name] = registers[offset]
        else:
            values[name] = u32_from(pair, word_order) if kind == "u32" else i32_from(pair, word_order)
    return values


def _encode(table: dict[str, tuple[int, str]], block: object, word_order: str) -> list[int]:
    registers: list[int] = []
    for name, (_, kind) in table.items():
        value = getattr(block, name)
        registers += [value & 0xFFFF] if kind == "u16" else words_of(value, word_order)
    return registers


def decode_link(registers: Sequence[int], word_order: str = "big") -> Link:
    """The link block in 16 registers."""
    return Link(**_decode(LINK_FIELDS, registers, word_order))


def encode_link(link: Link, word_order: str = "big") -> list[int]:
    """16 registers as a controller writes them."""
    return _encode(LINK_FIELDS, link, word_order)


def decode_service(registers: Sequence[int], word_order: str = "big") -> Service:
    """The service block in 16 registers."""
    return Service(**_decode(SERVICE_FIELDS, registers, word_order))


def encode_service(service: Service, word_order: str = "big") -> list[int]:
    """16 registers as a service writes them: for tests that play a foreign service."""
    return _encode(SERVICE_FIELDS, service, word_order)


def decode_header(registers: Sequence[int], word_order: str = "big") -> Header:
    """The contour header in 32 registers."""
    return Header(**_decode(HEADER_FIELDS, registers, word_order))


@dataclass(frozen=True)
class Layout:
    """Where the blocks lie, PDU addresses, and how the words of a 32-bit value lie in each of them."""

    link_address: int = 0
    service_address: int = 16
    contour_address: int = 32
    payload_capacity: int = 1984
    word_order: str = "big"

    def link(self, memory: Sequence[int]) -> Link:
        """The link block in a memory of holding registers."""
        return decode_link(memory[self.link_address : self.link_address + 16], self.word_order)

    def service(self, memory: Sequence[int]) -> Service:
        """The service block in a memory of holding registers."""
        return decode_service(memory[self.service_address : self.service_address + 16], self.word_order)

    def header_registers(self, memory: Sequence[int]) -> tuple[int, ...]:
        """The contour header's 32 registers."""
        return tuple(memory[self.contour_address : self.contour_address + HEADER_LENGTH])

    def header(self, memory: Sequence[int]) -> Header:
        """The contour header in a memory of holding registers."""
        return decode_header(self.header_registers(memory), self.word_order)

    def payload(self, memory: Sequence[int], length: int | None = None) -> tuple[int, ...]:
        """`length` registers of payload; as many as the header says (within the capacity) where None."""
        asked = self.header(memory).payload_length if length is None else length
        start = self.contour_address + HEADER_LENGTH
        return tuple(memory[start : start + min(asked, self.payload_capacity)])


# --- a contour out of pages ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Contour:
    """A contour as received: rings of (x, y) in micrometres, the exterior first, and the header it came with."""

    header: Header
    rings: tuple[Ring, ...]

    @property
    def millimetres(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """The rings in millimetres."""
        return tuple(tuple((x / 1000, y / 1000) for x, y in ring) for ring in self.rings)


def doubled_area(ring: Sequence[Point]) -> int:
    """Twice the signed area, exact integers, square micrometres: positive where the ring runs counter-clockwise."""
    following = [*ring[1:], *ring[:1]]
    return sum(x * v - u * y for (x, y), (u, v) in zip(ring, following, strict=True))


def rings_of(header: Header, payload: Sequence[int], word_order: str = "big") -> tuple[Ring, ...]:
    """The rings in the joined payload of all pages; ValueError where table, counts and length contradict."""
    table_length, length = 2 * header.ring_count, 2 * header.ring_count + 4 * header.point_count
    if len(payload) != length:
        raise ValueError(f"payload of {len(payload)} registers, counts ask for {length}")
    table = [u32_from(payload[at : at + 2], word_order) for at in range(0, table_length, 2)]
    if not table or sum(table) != header.point_count or min(table) < 3:
        raise ValueError(f"ring table {table} against point_count {header.point_count}")
    numbers = [i32_from(payload[at : at + 2], word_order) for at in range(table_length, length, 2)]
    points = list(zip(numbers[::2], numbers[1::2], strict=True))
    rings, start = [], 0
    for count in table:
        rings.append(tuple(points[start : start + count]))
        start += count
    return tuple(rings)


def page_faults(
    header: Sequence[int], payload: Sequence[int], payload_capacity: int = 1984, word_order: str = "big"
) -> list[str]:
    """What is wrong with one page by itself, in words; empty for a good one. `header` has its 32 registers."""
    seen, faults = decode_header(header, word_order), []
    if seen.crc32 != page_crc(header, payload):
        faults.append(f"crc32 is {seen.crc32:#010x}, the registers give {page_crc(header, payload):#010x}")
    if seen.payload_length != len(payload) or seen.payload_length > payload_capacity:
        faults.append(f"payload_length {seen.payload_length} with {len(payload)} registers, at most {payload_capacity}")
    if seen.job_id == 0:
        faults.append("job_id is 0")
    if seen.layout == 0:
        held = {name for name in HEADER_FIELDS if getattr(seen, name)} - {"transfer", "job_id", "session", "crc32"}
        return faults + [f"a withdrawal carries {name}" for name in sorted(held)]
    if seen.layout != 1:
        faults.append(f"layout {seen.layout}")
    if not 1 <= seen.page <= seen.page_count:
        faults.append(f"page {seen.page} of {seen.page_count}")
    table_length = 2 * seen.ring_count if seen.page == 1 else 0
    if seen.payload_length < table_length or (seen.payload_length - table_length) % 4:
        faults.append("the ring table is not whole on page 1, or the page does not end on a whole pair")
    if bool(seen.flags & FLAG_HOLES) != (seen.ring_count > 1):
        faults.append(f"flags {seen.flags:#x} with {seen.ring_count} rings")
    if bool(seen.flags & FLAG_LAST_PAGE) != (seen.page == seen.page_count):
        faults.append(f"flags {seen.flags:#x} on page {seen.page} of {seen.page_count}")
    if seen.flags >> 4:
        faults.append(f"unknown flags {seen.flags:#x}")
    return faults


def contradictions(header: Header, rings: Sequence[Ring]) -> list[str]:
    """Where the header's bounding box contradicts the points (counts were checked when the rings were cut out)."""
    xs, ys = [x for ring in rings for x, _ in ring], [y for ring in rings for _, y in ring]
    box = (min(xs), min(ys), max(xs), max(ys))
    told = (header.min_x, header.min_y, header.max_x, header.max_y)
    return [] if box == told else [f"bounding box {told}, the points give {box}"]


def geometry_faults(header: Header, rings: Sequence[Ring]) -> list[str]:
    """What a careful machine would refuse: orientation, area (to 1 mm², it is a whole number), doubled vertices."""
    faults = []
    for number, ring in enumerate(rings):
        doubled = doubled_area(ring)
        if doubled == 0 or (doubled > 0) != (number == 0):
            faults.append(f"ring {number} has signed area {doubled / 2e6} mm²: exterior positive, holes negative")
        if any(here == there for here, there in zip(ring, [*ring[1:], *ring[:1]], strict=True)):
            faults.append(f"ring {number} repeats a vertex")
    area = sum(doubled_area(ring) for ring in rings) / 2e6
    if abs(area - header.area) > 1:
        faults.append(f"area {header.area} mm², the points give {area} mm²")
    return faults


def decode_contour(pages: Iterable[tuple[Sequence[int], Sequence[int]]], word_order: str = "big") -> Contour:
    """The contour in the (header, payload) pages of one job, in order; ValueError names every fault."""
    pages = [(tuple(header), tuple(payload)) for header, payload in pages]
    first = decode_header(pages[0][0], word_order)
    faults = [fault for header, payload in pages for fault in page_faults(header, payload, 0xFFFF, word_order)]
    if [decode_header(header, word_order).page for header, _ in pages] != list(range(1, first.page_count + 1)):
        faults.append(f"pages out of order or missing, page_count {first.page_count}")
    faults += [fault for header, _ in pages[1:] for fault in foreign_page(pages[0][0], header)]
    if faults:
        raise ValueError("; ".join(faults))
    rings = rings_of(first, [register for _, payload in pages for register in payload], word_order)
    faults = contradictions(first, rings) + geometry_faults(first, rings)
    if faults:
        raise ValueError("; ".join(faults))
    return Contour(first, rings)


def foreign_page(first: Sequence[int], other: Sequence[int]) -> list[str]:
    """Where two pages of one job differ and must not: all offsets but 4, 7, 8 and 27 are common."""
    differing = [at for at in range(HEADER_LENGTH) if first[at] != other[at] and at not in PER_PAGE_OFFSETS]
    return [f"pages of one job differ in header offsets {differing}"] if differing else []
