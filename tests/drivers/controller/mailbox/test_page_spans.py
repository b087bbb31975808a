"""Where a page is cut into requests."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.mailbox.page_spans import page_starts, spans
from drivers.controller.modbus.requests import LONGEST_READ, LONGEST_WRITE

HEADER_PAIRS = [(2, 4), (8, 10), (10, 12), (12, 16), (16, 20), (20, 22), (22, 24), (24, 26), (28, 30)]


def header(page: int, rings: int) -> list[int]:
    registers = [0] * 31
    registers[3], registers[5] = page, rings
    return registers


@given(
    page=st.integers(1, 3),
    rings=st.integers(1, 200),
    pairs=st.integers(0, 500),
    longest=st.sampled_from([LONGEST_WRITE, LONGEST_READ]) | st.integers(4, 40),
)
def test_requests_cover_the_page_once_and_split_no_value(page: int, rings: int, pairs: int, longest: int) -> None:
    table = 2 * rings if page == 1 else 0
    end = 32 + table + 4 * pairs
    requests = spans(page_starts(header(page, rings), end - 32), longest)
    assert [register for start, count in requests for register in range(start, start + count)] == list(range(1, end))
    assert all(1 <= count <= longest for _, count in requests)
    values = [
        *HEADER_PAIRS,
        *((start, start + 2) for start in range(32, 32 + table, 2)),
        *((start, start + 4) for start in range(32 + table, end, 4)),
    ]
    cuts = {start for start, _ in requests}
    assert not any(first < cut < after for first, after in values for cut in cuts)


@given(page=st.integers(1, 2), rings=st.integers(1, 100), pairs=st.integers(0, 450))
def test_no_other_cut_needs_fewer_requests(page: int, rings: int, pairs: int) -> None:
    length = (2 * rings if page == 1 else 0) + 4 * pairs
    starts = page_starts(header(page, rings), length)
    fewest = {starts[0]: 0}
    for index, stop in enumerate(starts[1:], start=1):
        fewest[stop] = 1 + min(fewest[start] for start in starts[:index] if stop - start <= LONGEST_WRITE)
    assert len(spans(starts, LONGEST_WRITE)) == fewest[starts[-1]]


def test_a_full_page_of_the_default_layout_takes_17_writes() -> None:
    assert len(spans(page_starts(header(1, 1), 2 + 4 * 495), LONGEST_WRITE)) == 17


def test_header_and_a_short_payload_share_one_request() -> None:
    assert spans(page_starts(header(1, 1), 2 + 4 * 4), LONGEST_WRITE) == [(1, 49)]


@given(st.lists(st.integers(0, 0xFFFF), min_size=31, max_size=31), st.integers(0, 1984))
def test_a_torn_header_is_read_back_in_requests_that_end_with_the_page(torn: list[int], length: int) -> None:
    starts = [start for start in page_starts(torn, length) if start >= 32]
    requests = spans(starts, LONGEST_READ)
    assert sum(count for _, count in requests) == length
