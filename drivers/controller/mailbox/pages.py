"""The contour block: a contour as pages of registers, and the page that takes a job back."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.controller.errors import ContourTooLarge, MailboxError
from drivers.controller.mailbox.words import Unpacking, WordOrder, fields, pack, words32

HEADER_REGISTERS = 31  # offsets 1…31: the page without its commit register, offset 0
UNKNOWN_UNCERTAINTY = 0xFFFFFFFF
REGISTERS_PER_POINT = 4
LARGEST_COORDINATE_UM = 2**31 - 1


@dataclass(frozen=True)
class Page:
    """One page as registers: header offsets 1…31 (31 registers, without the commit register), then the payload.

    part: the part block that is committed with it, on a job's last page where the controller has one; else empty.
    """

    header: tuple[int, ...]
    payload: tuple[int, ...]
    part: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class ContourMessage:
    """One contour as it is to be sent. Lengths µm, area mm², times ms on the controller's clock.

    rings_um: exterior first, counter-clockwise, then the holes, clockwise; each of shape (N, 2), integers, N >= 3,
        first vertex not repeated, no two neighbours alike (`micrometres` makes such rings).
    uncertainty_um: 95 % bound on the contour's position, None where nobody computed it.
    simulated: the frame is not from a live camera. aligned: the coordinates are in the machine's frame.
    valid_for_ms: 0 = no limit. session, trigger: 0 where there is none.
    """

    job_id: int
    rings_um: tuple[NDArray[np.integer], ...]
    area_mm2: int
    uncertainty_um: int | None
    captured_at: int
    recipe: int
    simulated: bool
    aligned: bool
    valid_for_ms: int
    session: int
    trigger: int = 0


HEADER_FIELDS = fields(
    (1, "layout", "u16"),
    (2, "job_id", "u32"),
    (4, "page", "u16"),
    (5, "page_count", "u16"),
    (6, "ring_count", "u16"),
    (7, "payload_length", "u16"),
    (8, "crc32", "u32"),
    (10, "point_count", "u32"),
    (12, "min_x", "i32"),
    (14, "min_y", "i32"),
    (16, "max_x", "i32"),
    (18, "max_y", "i32"),
    (20, "area", "u32"),
    (22, "uncertainty", "u32"),
    (24, "captured_at", "u32"),
    (26, "recipe", "u16"),
    (27, "flags", "u16"),
    (28, "valid_for", "u32"),
    (30, "session", "u16"),
    (31, "trigger", "u16"),
)
HEADER_OFFSETS = {field.name: field.offset for field in HEADER_FIELDS}
HEADER_NAMES = tuple(field.name for field in HEADER_FIELDS)
_UNPACK_HEADER = Unpacking(HEADER_FIELDS)
_PLACES = {field.name: slice(field.offset - 1, field.offset - 1 + field.width) for field in HEADER_FIELDS}


def micrometres(ring_mm: NDArray[np.float64]) -> NDArray[np.int64]:
    """Vertices in whole micrometres, shape (M, 2), M <= N, neighbours that became alike counted once.

    ring_mm: shape (N, 2), millimetres. MailboxError: not finite, beyond ±2.1 km, or fewer than three vertices left.
    """
    ring = np.asarray(ring_mm, dtype=np.float64)
    if ring.ndim != 2 or ring.shape[1] != 2:
        raise MailboxError(f"a ring has shape {ring.shape}, expected (N, 2)")
    scaled = np.rint(ring * 1000.0)
    if not np.all(np.abs(scaled) <= LARGEST_COORDINATE_UM):  # also where it is not a number
        raise MailboxError("a vertex is not finite or beyond ±2147483.647 mm. Check calibration and alignment")
    points = scaled.astype(np.int64)
    points = points[np.any(points != np.roll(points, -1, axis=0), axis=1)]
    if len(points) < 3:
        raise MailboxError(f"a ring keeps {len(points)} vertices in whole micrometres, expected 3 or more")
    return points


def encode_pages(message: ContourMessage, payload_capacity: int, word_order: WordOrder) -> tuple[Page, ...]:
    """All pages of a contour, in order; at least one.

    MailboxError: a value or ring that the layout cannot hold. ContourTooLarge: the ring table does not fit on page 1
    (2 · ring_count <= payload_capacity), or there are more rings, vertices or pages than their counters hold.
    """
    for number, ring in enumerate(message.rings_um):
        _check_ring(ring, number)
    common = _common_fields(message)
    table = words32([len(ring) for ring in message.rings_um], word_order)
    if len(table) > payload_capacity or common["ring_count"] > 0xFFFF:
        raise ContourTooLarge(
            f"{common['ring_count']} rings, a payload of {payload_capacity} registers holds "
            f"{min(payload_capacity // 2, 0xFFFF)}. Raise the recipe's tolerance or smallest hole"
        )
    pairs = words32(np.concatenate(message.rings_um), word_order)
    payloads = _split(table, pairs, payload_capacity)
    if len(payloads) > 0xFFFF:
        raise ContourTooLarge(f"{common['point_count']} vertices take {len(payloads)} pages, at most 65535 can be sent")
    common["page_count"] = len(payloads)
    return tuple(_page(common, number, payload, word_order) for number, payload in enumerate(payloads, start=1))


def withdrawal(job_id: int, session: int, word_order: WordOrder) -> Page:
    """The page that takes a job back: layout 0, nothing but `job_id`, `session` and its CRC."""
    _check_job(job_id)
    return _sealed({"job_id": job_id, "session": session}, (), word_order)


def crc32_of(header: Sequence[int], payload: Sequence[int]) -> int:
    """CRC-32 (IEEE 802.3, as zlib's) of a page: its header with the CRC's own two registers as 0, then its payload.

    header: 31 registers, offsets 1…31. Each register goes in big-endian, in address order.
    """
    if len(header) != HEADER_REGISTERS:
        raise MailboxError(f"a header has {len(header)} registers, expected {HEADER_REGISTERS} (offsets 1 to 31)")
    registers = np.asarray([*header, *payload], dtype=">u2")
    registers[_PLACES["crc32"]] = 0
    return zlib.crc32(registers.tobytes())


def decode_header(page: Page, word_order: WordOrder) -> dict[str, int]:
    """The values of a page's header by name."""
    return _UNPACK_HEADER((0, *page.header), word_order)


def with_registers(page: Page, changes: Mapping[int, int], word_order: WordOrder) -> Page:
    """The page with header registers changed, by offset (1…31), and its CRC made right."""
    header = list(page.header)
    for offset, value in changes.items():
        header[offset - 1] = value
    header[_PLACES["crc32"]] = words32([crc32_of(header, page.payload)], word_order)
    return Page(tuple(header), page.payload)


def header_value(header: Sequence[int], name: str) -> int:
    """The value of one register by its name, from a header that may be torn.

    header: 31 registers, offsets 1…31. ValueError: the value takes two registers, whose order is another matter.
    """
    (value,) = header[_PLACES[name]]
    return value


def _check_ring(ring: NDArray[np.integer], number: int) -> None:
    if ring.ndim != 2 or ring.shape[1] != 2 or len(ring) < 3 or not np.issubdtype(ring.dtype, np.integer):
        raise MailboxError(
            f"ring {number} has shape {ring.shape} and type {ring.dtype}, expected (N, 2) integers with N >= 3"
        )
    if ring.max() > LARGEST_COORDINATE_UM or ring.min() < -LARGEST_COORDINATE_UM - 1:
        raise MailboxError(f"ring {number} reaches beyond ±2147483647 µm. Check calibration and alignment")
    if np.any(np.all(ring == np.roll(ring, 1, axis=0), axis=1)):
        raise MailboxError(f"ring {number} repeats a vertex. Round it with micrometres(), which drops repeats")
    doubled = _doubled_area(ring)
    if (doubled > 0) != (number == 0) or doubled == 0:
        expected = "exterior, expected counter-clockwise" if number == 0 else "hole, expected clockwise"
        raise MailboxError(f"ring {number} has the signed area {doubled / 2e6:g} mm² as {expected}")


def _doubled_area(ring: NDArray[np.integer]) -> int:
    """Twice the signed area in µm², exact (Python integers: a product of two i32 differences needs 66 bits)."""
    xs, ys = ring[:, 0].tolist(), ring[:, 1].tolist()
    return sum(x * (after - before) for x, after, before in zip(xs, ys[1:] + ys[:1], ys[-1:] + ys[:-1], strict=True))


def _check_job(job_id: int) -> None:
    if job_id == 0:
        raise MailboxError("job_id is 0, expected 1 to 4294967295")


def _common_fields(message: ContourMessage) -> dict[str, int]:
    """Header fields that all pages of the job share; those that differ are set page by page."""
    _check_job(message.job_id)
    if not message.rings_um:
        raise MailboxError("a contour without rings, expected 1 exterior and its holes")
    uncertainty = UNKNOWN_UNCERTAINTY if message.uncertainty_um is None else message.uncertainty_um
    if message.uncertainty_um == UNKNOWN_UNCERTAINTY:
        raise MailboxError(f"uncertainty is {UNKNOWN_UNCERTAINTY} µm, which means unknown. Pass None for that")
    corners = np.stack([(ring.min(axis=0), ring.max(axis=0)) for ring in message.rings_um])
    (min_x, min_y), (max_x, max_y) = corners[:, 0].min(axis=0).tolist(), corners[:, 1].max(axis=0).tolist()
    return {
        "layout": 1,
        "job_id": message.job_id,
        "ring_count": len(message.rings_um),
        "point_count": sum(len(ring) for ring in message.rings_um),
        "min_x": min_x,
        "min_y": min_y,
        "max_x": max_x,
        "max_y": max_y,
        "area": message.area_mm2,
        "uncertainty": uncertainty,
        "captured_at": message.captured_at,
        "recipe": message.recipe,
        "flags": message.simulated * 1 | (len(message.rings_um) > 1) * 2 | message.aligned * 8,
        "valid_for": message.valid_for_ms,
        "session": message.session,
        "trigger": message.trigger,
    }


def _split(table: tuple[int, ...], pairs: tuple[int, ...], capacity: int) -> list[tuple[int, ...]]:
    """The pages' payloads: the ring table heads the first; every page ends on a whole x,y pair."""
    room = (capacity - len(table)) // REGISTERS_PER_POINT * REGISTERS_PER_POINT
    later_room = capacity // REGISTERS_PER_POINT * REGISTERS_PER_POINT
    rest = pairs[room:]
    return [
        table + pairs[:room],
        *(rest[start : start + later_room] for start in range(0, len(rest), later_room)),
    ]


def _page(common: Mapping[str, int], number: int, payload: tuple[int, ...], word_order: WordOrder) -> Page:
    last = 4 if number == common["page_count"] else 0
    return _sealed({**common, "page": number, "flags": common["flags"] | last}, payload, word_order)


def _sealed(values: Mapping[str, int], payload: tuple[int, ...], word_order: WordOrder) -> Page:
    """The page with its payload's length and its CRC set."""
    complete = {**dict.fromkeys(HEADER_NAMES, 0), **values, "payload_length": len(payload)}
    header = pack(HEADER_FIELDS, complete, 1 + HEADER_REGISTERS, word_order)[1:]
    complete["crc32"] = crc32_of(header, payload)
    return Page(tuple(pack(HEADER_FIELDS, complete, 1 + HEADER_REGISTERS, word_order)[1:]), payload)
