"""Where a page may be cut into requests: a 32-bit value, and an x,y pair, is never split over two."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

from drivers.controller.mailbox.pages import HEADER_FIELDS, HEADER_REGISTERS, REGISTERS_PER_POINT, header_value

PAYLOAD_OFFSET = 1 + HEADER_REGISTERS
_HEADER_STARTS = [field.offset for field in HEADER_FIELDS if field.name not in ("min_y", "max_y")]


def page_starts(header: Sequence[int], payload_length: int) -> list[int]:
    """Offsets in the contour block at which a request may begin, ascending, then the page's end.

    header: offsets 1…31. Where it contradicts itself, as a torn one that was read back does, the payload rules.
    """
    end = PAYLOAD_OFFSET + payload_length
    table_length = 2 * header_value(header, "ring_count") if header_value(header, "page") == 1 else 0
    table_end = min(end, PAYLOAD_OFFSET + table_length)
    table = range(PAYLOAD_OFFSET, table_end, 2)
    return [*_HEADER_STARTS, *table, *range(table_end, end, REGISTERS_PER_POINT), end]


def header_spans(longest: int) -> list[tuple[int, int]]:
    """Offset and count of the requests that read the header, `transfer` with it; every count is even.

    `late_replies.py` tells its own reads from these by their odd counts.
    """
    return spans([0, *_HEADER_STARTS, PAYLOAD_OFFSET], longest // 2 * 2)


def spans(starts: Sequence[int], longest: int) -> list[tuple[int, int]]:
    """Offset and count of the fewest requests of at most `longest` registers that cover `starts[0]` to `starts[-1]`."""
    cut = []
    begin = starts[0]
    while begin < starts[-1]:
        stop = starts[bisect_right(starts, begin + longest) - 1]
        cut.append((begin, stop - begin))
        begin = stop
    return cut
