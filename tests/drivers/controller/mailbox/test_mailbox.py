"""The codec: against the protocol's worked example, and against a decoder that others wrote from its text."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drivers.controller import ContourTooLarge, ControllerError, MailboxError
from drivers.controller.mailbox.blocks import (
    LINK_FIELDS,
    SERVICE_FIELDS,
    Answer,
    LinkBlock,
    ServiceBlock,
    decode_link,
    decode_service,
    encode_link,
    encode_service,
)
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import (
    HEADER_FIELDS,
    ContourMessage,
    Page,
    crc32_of,
    encode_pages,
    micrometres,
    withdrawal,
)
from tests.support.controller import protocol_decoder

EXAMPLE_HEADER = (
    "0003 0001 0000 0007 0001 0001 0001 0012 B6B0 0A39 0000 0004 0000 0000 0000 0000 0001 86A0 0000 C350 "
    "0000 1388 0000 00C8 0000 EA60 0001 0004 0000 7530 0009 0005"
)
EXAMPLE_PAYLOAD = (
    "0000 0004 0000 0000 0000 0000 0001 86A0 0000 0000 0001 86A0 0000 C350 0000 0000 0000 C350"
)  # fmt: skip
RECTANGLE = np.array([[0, 0], [100_000, 0], [100_000, 50_000], [0, 50_000]])
ORDERS = st.sampled_from(["big", "little"])
U16 = st.integers(0, 0xFFFF)
U32 = st.integers(0, 0xFFFFFFFF)
COORDINATE = st.integers(-(2**31), 2**31 - 1)


def words(text: str) -> tuple[int, ...]:
    return tuple(int(word, 16) for word in text.split())


def message(**changes: object) -> ContourMessage:
    example = ContourMessage(
        job_id=7,
        rings_um=(RECTANGLE,),
        area_mm2=5000,
        uncertainty_um=200,
        captured_at=60_000,
        recipe=1,
        simulated=False,
        aligned=False,
        valid_for_ms=30_000,
        session=9,
        trigger=5,
    )
    return replace(example, **changes)


@st.composite
def rings(draw: st.DrawFn, clockwise: bool = False) -> np.ndarray:
    """A ring of neighbours that differ, turned as asked; it may cross itself, which is not the codec's affair."""
    points = draw(st.lists(st.tuples(COORDINATE, COORDINATE), min_size=3, max_size=40))
    doubled = protocol_decoder.doubled_area(points)
    assume(doubled != 0)
    assume(all(a != b for a, b in zip(points, [*points[1:], points[0]], strict=True)))
    return np.array(points if (doubled < 0) == clockwise else points[::-1], dtype=np.int64)


def test_the_worked_example_is_encoded_register_by_register() -> None:
    (page,) = encode_pages(message(), 1984, "big")
    assert page.header == words(EXAMPLE_HEADER)[1:]
    assert page.payload == words(EXAMPLE_PAYLOAD)


def test_the_crc_of_the_worked_example_is_the_protocols() -> None:
    assert crc32_of(words(EXAMPLE_HEADER)[1:], words(EXAMPLE_PAYLOAD)) == 0xB6B00A39


def test_the_withdrawal_of_the_worked_example_has_the_protocols_crc_and_nothing_but_job_and_session() -> None:
    page = withdrawal(7, 9, "big")
    expected = [0] * 31
    expected[2], expected[29] = 7, 9
    expected[7], expected[8] = 0x59E1, 0xA3D2
    assert page == Page(tuple(expected), ())


def test_little_word_order_swaps_the_halves_of_each_value_and_nothing_else() -> None:
    (big,), (little,) = encode_pages(message(), 1984, "big"), encode_pages(message(), 1984, "little")
    assert little.payload[:6] == (4, 0, 0, 0, 0, 0)
    assert little.payload[6:8] == (0x86A0, 0x0001)
    assert little.header[1:3] == (7, 0)
    assert little.header[3:7] == big.header[3:7]


@given(
    ORDERS,
    st.lists(U16, min_size=16, max_size=16),
)
def test_the_link_block_reads_as_another_reader_of_the_protocol_reads_it(order: str, registers: list[int]) -> None:
    assert asdict(decode_link(registers, order)) == asdict(protocol_decoder.decode_link(registers, order))
    assert encode_link(decode_link(registers, order), order) == tuple(registers)


@given(ORDERS, st.lists(U16, min_size=14, max_size=14))
def test_the_service_block_is_written_as_another_reader_of_the_protocol_reads_it(order: str, some: list[int]) -> None:
    registers = (*some, 0, 0)
    block = decode_service(registers, order)
    assert encode_service(block, order) == registers
    assert {**asdict(block), "reserved": 0} == asdict(protocol_decoder.decode_service(registers, order))


def test_fields_a_service_block_starts_with_are_the_protocols() -> None:
    assert encode_service(ServiceBlock(), "big") == (1, 1, 0, 0, 0, 0, 0, 0, 0x0102, 0x0304, 0, 0, 0, 0, 0, 0)


@given(
    order=ORDERS,
    exterior=rings(),
    holes=st.lists(rings(clockwise=True), max_size=3),
    capacity=st.integers(4, 60).map(lambda half: 2 * half),
    numbers=st.tuples(st.integers(1, 0xFFFFFFFF), U32, U32, U16, U32, U16, U16),
    uncertainty=st.none() | st.integers(0, 0xFFFFFFFE),
    simulated=st.booleans(),
    aligned=st.booleans(),
)
def test_pages_hold_what_another_reader_of_the_protocol_finds_in_them(
    order: str,
    exterior: np.ndarray,
    holes: list[np.ndarray],
    capacity: int,
    numbers: tuple[int, ...],
    uncertainty: int | None,
    simulated: bool,
    aligned: bool,
) -> None:
    job_id, area, captured_at, recipe, valid_for, session, trigger = numbers
    head = (job_id, (exterior, *holes), area, uncertainty, captured_at, recipe)
    sent = ContourMessage(*head, simulated, aligned, valid_for, session, trigger)
    pages = encode_pages(sent, capacity, order)
    blocks = [((0, *page.header), page.payload) for page in pages]
    headers = [protocol_decoder.decode_header(header, order) for header, _ in blocks]
    first = headers[0]

    for header, payload in blocks:
        assert protocol_decoder.page_faults(header, payload, capacity, order) == []
        assert protocol_decoder.foreign_page(blocks[0][0], header) == []
    assert [header.page for header in headers] == list(range(1, first.page_count + 1))
    assert all(len(page.payload) > capacity - 4 for page in pages[1:-1])
    whole = [register for _, payload in blocks for register in payload]
    received = protocol_decoder.rings_of(first, whole, order)
    assert [list(map(tuple, ring.tolist())) for ring in sent.rings_um] == [list(ring) for ring in received]
    assert protocol_decoder.contradictions(first, received) == []
    assert (first.job_id, first.area, first.captured_at, first.recipe) == (job_id, area, captured_at, recipe)
    assert (first.valid_for, first.session, first.trigger, first.layout) == (valid_for, session, trigger, 1)
    assert first.uncertainty == (0xFFFFFFFF if uncertainty is None else uncertainty)
    assert first.flags & 9 == simulated + 8 * aligned


def test_a_contour_as_large_as_one_page_stays_on_one_page_and_one_vertex_more_takes_two() -> None:
    angles = np.linspace(0, 2 * np.pi, 496, endpoint=False)
    circle = micrometres(np.stack([500 * np.cos(angles), 500 * np.sin(angles)], axis=1))
    assert len(encode_pages(message(rings_um=(circle[:495],)), 1984, "big")) == 1
    assert len(encode_pages(message(rings_um=(circle,)), 1984, "big")) == 2


def test_more_rings_than_page_1_can_table_are_too_large() -> None:
    hole = np.array([[10, 10], [10, 20], [20, 10]])
    assert encode_pages(message(rings_um=(RECTANGLE, hole, hole)), 6, "big")
    with pytest.raises(ContourTooLarge, match="4 rings, a payload of 6 registers holds 3"):
        encode_pages(message(rings_um=(RECTANGLE, hole, hole, hole)), 6, "big")


@pytest.mark.parametrize(
    ("changes", "seen"),
    [
        ({"job_id": 0}, "job_id is 0"),
        ({"job_id": 2**32}, "job_id is 4294967296, expected 0 to 4294967295"),
        ({"area_mm2": -1}, "area is -1"),
        ({"recipe": 65536}, "recipe is 65536"),
        ({"session": 65536}, "session is 65536"),
        ({"trigger": -1}, "trigger is -1"),
        ({"captured_at": 2**32}, "captured_at is 4294967296"),
        ({"valid_for_ms": 2**32}, "valid_for is 4294967296"),
        ({"uncertainty_um": 2**32 - 1}, "means unknown"),
        ({"rings_um": ()}, "without rings"),
        ({"rings_um": (RECTANGLE[::-1],)}, "ring 0 has the signed area -5000 mm² as exterior, expected counter-clock"),
        ({"rings_um": (RECTANGLE, RECTANGLE)}, "ring 1 has the signed area 5000 mm² as hole, expected clockwise"),
        ({"rings_um": (RECTANGLE[:2],)}, "ring 0 has shape"),
        ({"rings_um": (RECTANGLE / 1000,)}, "float64"),
        ({"rings_um": (RECTANGLE * 100_000,)}, "reaches beyond"),
        ({"rings_um": (RECTANGLE[[0, 1, 1, 2]],)}, "ring 0 repeats a vertex"),
        ({"rings_um": (RECTANGLE[[0, 1, 2, 0]],)}, "ring 0 repeats a vertex"),
    ],
)
def test_what_the_layout_cannot_hold_is_refused_by_name(changes: dict[str, object], seen: str) -> None:
    with pytest.raises(MailboxError, match=seen):
        encode_pages(message(**changes), 1984, "big")


@pytest.mark.parametrize("block", [LinkBlock(clock=2**32), ServiceBlock(job_id=-1), ServiceBlock(owner=65536)])
def test_a_block_with_a_value_out_of_range_is_refused(block: LinkBlock | ServiceBlock) -> None:
    with pytest.raises(MailboxError, match="expected 0 to"):
        encode_link(block, "big") if isinstance(block, LinkBlock) else encode_service(block, "big")


@pytest.mark.parametrize("registers", [[0] * 15, [0] * 17, [0] * 15 + [65536]])
def test_a_block_of_other_than_16_registers_is_refused(registers: list[int]) -> None:
    with pytest.raises(MailboxError, match="expected 16 registers"):
        decode_link(registers, "big")


def test_a_withdrawal_of_job_0_is_refused() -> None:
    with pytest.raises(MailboxError, match="job_id is 0"):
        withdrawal(0, 9, "big")


@given(st.lists(st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)), min_size=3, max_size=30))
def test_micrometres_are_the_nearest_ones_in_order_without_repeats(ring_mm: list[tuple[float, float]]) -> None:
    nearest = [tuple(round(value * 1000) for value in point) for point in np.array(ring_mm)]
    kept = [point for index, point in enumerate(nearest) if point != nearest[(index + 1) % len(nearest)]]
    assume(len(kept) >= 3)
    rounded = [tuple(point) for point in micrometres(np.array(ring_mm)).tolist()]
    assert rounded == kept
    assert all(a != b for a, b in zip(rounded, [*rounded[1:], rounded[0]], strict=True))


def test_a_closed_ring_loses_its_repeated_end_and_keeps_its_first_vertex() -> None:
    ring = micrometres(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]))
    assert ring.tolist() == [[0, 0], [1000, 0], [1000, 1000]]


@pytest.mark.parametrize(
    ("ring", "seen"),
    [
        (np.full((3, 2), np.nan), "not finite"),
        (np.array([[0, 0], [np.inf, 0], [0, 1]]), "not finite"),
        (np.array([[0, 0], [2_147_483.648, 0], [0, 1]]), "beyond ±2147483.647 mm"),
        (np.array([[0, 0], [1, 0], [1.0001, 0.0001], [0.0001, 0]]), "keeps 2 vertices"),
        (np.zeros((5, 2)), "keeps 0 vertices"),
        (np.zeros((5, 3)), r"shape \(5, 3\)"),
    ],
)
def test_a_ring_that_micrometres_cannot_hold_is_refused(ring: np.ndarray, seen: str) -> None:
    with pytest.raises(MailboxError, match=seen):
        micrometres(ring)


@pytest.mark.parametrize(
    ("layout", "seen"),
    [
        ({"service_address": 15}, "link_address 0 to 15 runs into service_address at 15"),
        ({"contour_address": 31}, "service_address 16 to 31 runs into contour_address at 31"),
        ({"link_address": 2000}, "contour_address 32 to 2047 runs into link_address at 2000"),
        ({"contour_address": 65000}, "runs into the end at 65536"),
        ({"link_address": -1}, "link_address -1"),
        ({"payload_capacity": 1983}, "even number"),
        ({"payload_capacity": 2}, "even number from 4 on"),
        ({"word_order": "middle"}, "'big' or 'little'"),
        ({"part_address": 2047}, "contour_address 32 to 2047 runs into part_address at 2047"),
        ({"part_address": 65_000, "part_capacity": 521}, "part_address 65000 to 65536 runs into the end"),
    ],
)
def test_a_layout_whose_blocks_overlap_or_end_nowhere_is_refused(layout: dict[str, object], seen: str) -> None:
    with pytest.raises(MailboxError, match=seen):
        MailboxLayout(**layout)


def test_the_default_layout_ends_at_register_2048() -> None:
    assert max(end for _, end in MailboxLayout().blocks.values()) == 2048


@pytest.mark.parametrize(
    ("mine", "theirs"),
    [
        (LINK_FIELDS, protocol_decoder.LINK_FIELDS),
        (SERVICE_FIELDS, protocol_decoder.SERVICE_FIELDS),
        (HEADER_FIELDS, protocol_decoder.HEADER_FIELDS),
    ],
)
def test_the_field_tables_are_those_of_another_reader_of_the_protocol(mine: tuple, theirs: dict) -> None:
    left_out = {"transfer", "reserved"}
    assert {field.name: (field.offset, field.kind) for field in mine} == {
        name: row for name, row in theirs.items() if name not in left_out
    }


def test_final_answers_are_the_starred_ones_of_the_protocol() -> None:
    assert {answer.value for answer in Answer if answer.final} == {1, 4, 5, 7, 11}


def test_every_mailbox_error_is_a_controller_error() -> None:
    assert issubclass(MailboxError, ControllerError)


def test_the_codec_is_imported_without_the_modbus_library() -> None:
    program = "import sys, drivers.controller.mailbox.mailbox; sys.exit('pymodbus' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
