"""The simulated controller's reading of the contour block: written from the protocol's text, not from the codec.

It shares nothing with `pages` but the layout's addresses, so that both ends cannot make the same mistake.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivers.controller.mailbox.words import WordOrder

HEADER = 32
UNKNOWN = 0xFFFFFFFF
# Header offsets that all pages of a job share: all but transfer 0, page 4, payload_length 7, crc32 8 and 9, flags 27.
COMMON_OFFSETS = tuple(offset for offset in range(1, HEADER) if offset not in (4, 7, 8, 9, 27))

Point = tuple[int, int]
Ring = tuple[Point, ...]


class Contradiction(Exception):
    """Counts, ring table or bounding box contradict the points; the message says which."""


@dataclass(frozen=True)
class AcceptedPart:
    """A part that lies in an accepted contour. Millimetres, degrees; rings exterior first."""

    number: int
    x_mm: float
    y_mm: float
    angle_deg: float
    margin_mm: float
    needed_mm: float
    rings: tuple[tuple[tuple[float, float], ...], ...]

    def as_json(self) -> dict[str, object]:
        """The part as the controller's log has it."""
        exterior, *holes = ([list(point) for point in ring] for ring in self.rings)
        pose = {"x_mm": self.x_mm, "y_mm": self.y_mm, "angle_deg": self.angle_deg}
        margins = {"margin_mm": self.margin_mm, "needed_mm": self.needed_mm}
        return {"part": self.number, **pose, **margins, "millimetres": {"exterior": exterior, "holes": holes}}

    @classmethod
    def from_json(cls, kept: dict[str, Any]) -> AcceptedPart:
        """The part of a log line; KeyError, TypeError or ValueError where it is none."""
        millimetres = kept["millimetres"]
        rings = (millimetres["exterior"], *millimetres["holes"])
        return cls(
            int(kept["part"]),
            float(kept["x_mm"]),
            float(kept["y_mm"]),
            float(kept["angle_deg"]),
            float(kept["margin_mm"]),
            float(kept["needed_mm"]),
            tuple(tuple((float(x), float(y)) for x, y in ring) for ring in rings),
        )


@dataclass(frozen=True)
class AcceptedContour:
    """A contour that the controller took. Millimetres; rings exterior first, first vertex not repeated.

    flags: bit 0 frame not from a live camera, 1 holes present, 2 last page, 3 machine frame aligned. parts: None where
    the controller has no part block.
    """

    job_id: int
    recipe: int
    flags: int
    rings: tuple[tuple[tuple[float, float], ...], ...]
    area_mm2: int
    uncertainty_mm: float | None
    parts: tuple[AcceptedPart, ...] | None = None

    def as_json(self) -> dict[str, object]:
        """The line of the controller's log for this contour."""
        exterior, *holes = ([list(point) for point in ring] for ring in self.rings)
        return {
            "job_id": self.job_id,
            "recipe": self.recipe,
            "flags": self.flags,
            "millimetres": {"exterior": exterior, "holes": holes},
            "area_mm2": self.area_mm2,
            "uncertainty_mm": self.uncertainty_mm,
            **({} if self.parts is None else {"parts": [part.as_json() for part in self.parts]}),
        }

    @classmethod
    def from_json(cls, line: dict[str, Any]) -> AcceptedContour:
        """The contour of a log line; KeyError, TypeError or ValueError where it is none."""
        millimetres = line["millimetres"]
        if not isinstance(millimetres, dict):
            raise TypeError("millimetres is not an object")
        rings = [millimetres["exterior"], *millimetres["holes"]]
        uncertainty = line["uncertainty_mm"]
        return cls(
            job_id=int(str(line["job_id"])),
            recipe=int(str(line["recipe"])),
            flags=int(str(line["flags"])),
            rings=tuple(tuple((float(x), float(y)) for x, y in ring) for ring in rings),
            area_mm2=int(str(line["area_mm2"])),
            uncertainty_mm=None if uncertainty is None else float(str(uncertainty)),
            parts=tuple(AcceptedPart.from_json(part) for part in line["parts"]) if "parts" in line else None,
        )


def u32(registers: Sequence[int], offset: int, word_order: WordOrder) -> int:
    """The unsigned 32-bit value at `offset`."""
    first, second = registers[offset], registers[offset + 1]
    return first * 65536 + second if word_order == "big" else second * 65536 + first


def i32(registers: Sequence[int], offset: int, word_order: WordOrder) -> int:
    """The signed 32-bit value at `offset`, two's complement."""
    value = u32(registers, offset, word_order)
    return value - 2**32 if value >= 2**31 else value


class PageCopy:
    """The controller's own copy of header and payload; nobody writes to it while it is looked at."""

    def __init__(self, block: Sequence[int], word_order: WordOrder) -> None:
        self.registers = tuple(block)
        self.word_order = word_order
        self.transfer, self.layout, self.job_id = block[0], block[1], u32(block, 2, word_order)
        self.page, self.page_count, self.ring_count, self.payload_length = block[4:8]
        self.crc32 = u32(block, 8, word_order)
        self.point_count = u32(block, 10, word_order)
        self.bounding_box = tuple(i32(block, offset, word_order) for offset in (12, 14, 16, 18))
        self.area = u32(block, 20, word_order)
        self.uncertainty = u32(block, 22, word_order)
        self.captured_at = u32(block, 24, word_order)
        self.recipe, self.flags = block[26], block[27]
        self.valid_for = u32(block, 28, word_order)
        self.session, self.trigger = block[30], block[31]

    @property
    def payload(self) -> tuple[int, ...]:
        """The registers of this page's payload."""
        return self.registers[HEADER : HEADER + self.payload_length]

    @property
    def content(self) -> tuple[int, ...]:
        """All that a repeat must repeat: everything but the commit register."""
        return self.registers[1 : HEADER + self.payload_length]

    @property
    def common(self) -> tuple[int, ...]:
        """The header's registers that all pages of a job share."""
        return tuple(self.registers[offset] for offset in COMMON_OFFSETS)

    def crc_is_right(self) -> bool:
        """Compare the page's CRC with the one computed over the copy."""
        checked = list(self.registers[: HEADER + self.payload_length])
        checked[8] = checked[9] = 0
        return zlib.crc32(struct.pack(f">{len(checked) - 1}H", *checked[1:])) == self.crc32


class Assembly:
    """Pages of one job in their order, until the contour is whole."""

    def __init__(self) -> None:
        self._pages: list[PageCopy] = []

    def drop(self) -> None:
        """Forget what is held."""
        self._pages = []

    def place(self, copy: PageCopy) -> str:
        """Where the page belongs: "first", "held" (it is there already), "next" or "missing" (pages before it are)."""
        if copy.page == 1:
            return "first"
        if not self._pages or self._pages[0].job_id != copy.job_id:
            return "missing"
        if 1 <= copy.page <= len(self._pages):
            return "held"
        return "next" if copy.page == len(self._pages) + 1 else "missing"

    def take(self, copy: PageCopy) -> AcceptedContour | None:
        """Add the page; the contour where it was the last one. Contradiction: it is not added."""
        if copy.page == 1:
            self.drop()
        pages = [*self._pages, copy]
        rings = _rings_so_far(pages)
        self._pages = pages
        if copy.page < copy.page_count:
            return None
        return AcceptedContour(
            job_id=copy.job_id,
            recipe=copy.recipe,
            flags=copy.flags,
            rings=tuple(tuple((x / 1000, y / 1000) for x, y in ring) for ring in rings),
            area_mm2=copy.area,
            uncertainty_mm=None if copy.uncertainty == UNKNOWN else copy.uncertainty / 1000,
        )


def _rings_so_far(pages: Sequence[PageCopy]) -> list[Ring]:
    """The contour's rings, of the last page; raise Contradiction, also on what a page before the last one shows."""
    first, last = pages[0], pages[-1]
    if last.common != first.common:
        raise Contradiction(f"page {last.page} differs from page 1 in the header's common part")
    if not 1 <= last.page <= last.page_count or not last.ring_count:
        raise Contradiction(f"page {last.page} of {last.page_count}, {last.ring_count} rings")
    sizes = _ring_table(first)
    points = [point for page in pages for point in _points(page)]
    whole = last.page == last.page_count
    if len(points) > first.point_count or (whole and len(points) != first.point_count):
        raise Contradiction(f"{len(points)} points on {last.page} of {last.page_count} pages of {first.point_count}")
    _check_box(points, first, whole=whole)
    rings, start = [], 0
    for size in sizes:
        rings.append(tuple(points[start : start + size]))
        start += size
    return rings


def _ring_table(first: PageCopy) -> list[int]:
    if 2 * first.ring_count > first.payload_length:
        raise Contradiction(f"{first.ring_count} rings in a payload of {first.payload_length} registers")
    sizes = [u32(first.payload, 2 * ring, first.word_order) for ring in range(first.ring_count)]
    if min(sizes) < 3 or sum(sizes) != first.point_count:
        raise Contradiction(f"the ring table says {sizes}, point_count {first.point_count}")
    return sizes


def _points(page: PageCopy) -> list[Point]:
    registers = page.payload[2 * page.ring_count :] if page.page == 1 else page.payload
    if len(registers) % 4:
        raise Contradiction(f"page {page.page} ends within an x,y pair")
    return [
        (i32(registers, start, page.word_order), i32(registers, start + 2, page.word_order))
        for start in range(0, len(registers), 4)
    ]


def _check_box(points: Sequence[Point], first: PageCopy, *, whole: bool) -> None:
    if not points:
        return
    xs, ys = [x for x, _ in points], [y for _, y in points]
    seen = (min(xs), min(ys), max(xs), max(ys))
    said = first.bounding_box
    inside = seen[0] >= said[0] and seen[1] >= said[1] and seen[2] <= said[2] and seen[3] <= said[3]
    if not inside or (whole and seen != said):
        raise Contradiction(f"the points span {seen} µm, the bounding box says {said}")


def signed_area_mm2(ring: Sequence[tuple[float, float]]) -> float:
    """Area within the ring, counter-clockwise positive."""
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)) / 2
