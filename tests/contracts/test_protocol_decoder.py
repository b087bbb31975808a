"""The decoder that tests trust is itself held against the protocol's own numbers."""

from __future__ import annotations

import zlib
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.controller import played_controller as pc
from tests.support.controller import protocol_decoder as pd

EXAMPLE = """
0003 0001 0000 0007 0001 0001 0001 0012 B6B0 0A39 0000 0004 0000 0000 0000 0000 0001 86A0 0000 C350
0000 1388 0000 00C8 0000 EA60 0001 0004 0000 7530 0009 0005
0000 0004 0000 0000 0000 0000 0001 86A0 0000 0000 0001 86A0 0000 C350 0000 0000 0000 C350
"""
REGISTERS = [int(word, 16) for word in EXAMPLE.split()]
HEADER, PAYLOAD = REGISTERS[:32], REGISTERS[32:]
RECTANGLE = ((0, 0), (100_000, 0), (100_000, 50_000), (0, 50_000))


def page_of(rings, word_order="big", payload=None, withdrawal=False, **header):
    """(header, payload) registers of a page, built field by field for these tests."""
    points = [point for ring in rings for point in ring]
    numbers = [len(ring) for ring in rings] + [number for point in points for number in point]
    if payload is None:
        payload = [word for number in numbers for word in pd.words_of(number, word_order)]
    payload = [] if withdrawal else payload
    values = dict.fromkeys(pd.HEADER_FIELDS, 0) | {"transfer": 3, "job_id": 7, "session": 9}
    if not withdrawal:
        xs, ys = [x for x, _ in points], [y for _, y in points]
        values |= {"layout": 1, "page": 1, "page_count": 1, "ring_count": len(rings), "payload_length": len(payload)}
        values |= {"point_count": len(points), "min_x": min(xs), "min_y": min(ys), "max_x": max(xs), "max_y": max(ys)}
        values |= {"area": sum(pd.doubled_area(ring) for ring in rings) // 2_000_000, "uncertainty": 200}
        values |= {"captured_at": 60_000, "recipe": 1, "flags": 4 | 2 * (len(rings) > 1), "valid_for": 30_000}
        values |= {"trigger": 5}
    values |= header

    def registers(values):
        built = pd.Header(**values)
        return [
            word
            for name, (_, kind) in pd.HEADER_FIELDS.items()
            for word in ([getattr(built, name)] if kind == "u16" else pd.words_of(getattr(built, name), word_order))
        ]

    if "crc32" not in header:
        values["crc32"] = pd.page_crc(registers(values), payload)
    return registers(values), payload


def played(**state):
    """A controller in session 9 that waits for a contour for its trigger 5."""
    controller = pc.PlayedController([0] * 2048, session=9, clock=61_000, trigger_counter=5, **state)
    controller.publish()
    return controller


def put(controller, page):
    """Write a page into the controller's memory, as a service does."""
    header, payload = page
    at = controller.layout.contour_address
    controller.memory[at + 32 : at + 32 + len(payload)] = payload
    controller.memory[at : at + 32] = header


def two_pages():
    """A rectangle cut into two pages: ring table and two points, then two points."""
    _, payload = page_of([RECTANGLE])
    first = page_of([RECTANGLE], payload=payload[:10], page_count=2, flags=0)
    second = page_of([RECTANGLE], payload=payload[10:], page_count=2, page=2, transfer=4)
    return first, second


def test_the_crc_is_the_one_of_ieee_802_3():
    assert pd.crc32(b"123456789") == 0xCBF43926


@given(st.binary(max_size=64))
def test_the_crc_agrees_with_zlib(data):
    assert pd.crc32(data) == zlib.crc32(data)


def test_the_worked_example_decodes_to_its_words():
    contour = pd.decode_contour([(HEADER, PAYLOAD)])
    header = contour.header
    assert contour.rings == (RECTANGLE,)
    assert contour.millimetres[0][2] == (100.0, 50.0)
    assert (header.job_id, header.transfer, header.session, header.trigger, header.recipe) == (7, 3, 9, 5, 1)
    assert (header.uncertainty, header.captured_at, header.valid_for, header.area) == (200, 60_000, 30_000, 5_000)
    assert header.crc32 == pd.page_crc(HEADER, PAYLOAD) == 0xB6B00A39


def test_the_page_builder_of_these_tests_gives_the_worked_example():
    assert page_of([RECTANGLE]) == (HEADER, PAYLOAD)


def test_the_withdrawal_of_job_7_in_session_9_has_the_told_crc():
    header, payload = page_of([], withdrawal=True)
    assert pd.decode_header(header).crc32 == 0x59E1A3D2
    assert pd.page_faults(header, payload) == []


def test_a_withdrawal_that_carries_anything_else_is_told():
    header, payload = page_of([], withdrawal=True, recipe=1)
    assert pd.page_faults(header, payload) == ["a withdrawal carries recipe"]


@given(
    st.builds(pd.Link, **{name: st.integers(0, 0xFFFF) for name in pd.LINK_FIELDS}), st.sampled_from(["big", "little"])
)
def test_a_link_block_survives_the_way_there_and_back(link, word_order):
    registers = pd.encode_link(link, word_order)
    assert len(registers) == 16
    assert pd.decode_link(registers, word_order) == link


def test_word_orders_differ_in_32_bit_values_only():
    link = pd.Link(controller_state=1, clock=0x01020304)
    assert pd.encode_link(link, "big")[14:] == [0x0102, 0x0304]
    assert pd.encode_link(link, "little")[14:] == [0x0304, 0x0102]
    assert pd.encode_link(link, "big")[:14] == pd.encode_link(link, "little")[:14]


def test_a_service_block_has_each_field_at_its_offset():
    service = pd.decode_service([1, 5, 2, 3, 4, 121, 0, 7, 0x0102, 0x0304, 9, 42, 0, 6, 0, 0])
    assert service == pd.Service(1, 5, 2, 3, 4, 121, 7, 0x01020304, 9, 42, 6)
    assert pd.decode_service(pd.encode_service(service, "little"), "little") == service


coordinates = st.integers(-(2**31), 2**31 - 1)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=20), st.sampled_from(["big", "little"]))
def test_rings_survive_the_way_there_and_back_in_both_word_orders(points, word_order):
    header, payload = page_of([tuple(points)], word_order, area=0)
    assert pd.page_faults(header, payload, word_order=word_order) == []
    assert pd.rings_of(pd.decode_header(header, word_order), payload, word_order) == (tuple(points),)


@given(st.integers(2, 49), st.integers(0, 15))
def test_any_flipped_bit_breaks_the_crc(register, bit):
    registers = [*HEADER, *PAYLOAD]
    if register in (8, 9):
        return
    registers[register] ^= 1 << bit
    faults = pd.page_faults(registers[:32], registers[32:])
    assert any(fault.startswith("crc32") for fault in faults)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"crc32": 1}, "crc32"),
        ({"payload_length": 22}, "payload_length"),
        ({"job_id": 0}, "job_id"),
        ({"layout": 2}, "layout 2"),
        ({"page": 2}, "page 2 of 1"),
        ({"flags": 6}, "with 1 rings"),
        ({"flags": 0}, "on page 1 of 1"),
        ({"flags": 0x14}, "unknown flags"),
        ({"ring_count": 2}, "ring table"),
        ({"point_count": 5}, "counts ask for"),
        ({"min_x": -1}, "bounding box"),
        ({"max_y": 49_999}, "bounding box"),
        ({"area": 5_002}, "area 5002"),
    ],
)
def test_a_header_that_contradicts_its_points_is_told(change, fault):
    header, payload = page_of([RECTANGLE], **change)
    with pytest.raises(ValueError, match=fault):
        pd.decode_contour([(header, payload)])


def test_a_clockwise_exterior_is_told():
    with pytest.raises(ValueError, match="ring 0 has signed area -5000"):
        pd.decode_contour([page_of([RECTANGLE[::-1]], area=5_000)])


def test_a_counter_clockwise_hole_is_told_and_a_clockwise_one_is_right():
    hole = ((10_000, 10_000), (10_000, 20_000), (20_000, 20_000), (20_000, 10_000))
    assert pd.decode_contour([page_of([RECTANGLE, hole])]).header.area == 4_900
    with pytest.raises(ValueError, match="ring 1"):
        pd.decode_contour([page_of([RECTANGLE, hole[::-1]], area=4_900)])


def test_a_ring_that_repeats_its_first_vertex_is_told():
    with pytest.raises(ValueError, match="repeats a vertex"):
        pd.decode_contour([page_of([(*RECTANGLE, RECTANGLE[0])])])


def test_two_pages_join_to_the_contour_of_one():
    assert pd.decode_contour(two_pages()).rings == (RECTANGLE,)


def test_pages_of_one_job_that_differ_elsewhere_are_told():
    first, _ = two_pages()
    second = page_of([RECTANGLE], payload=PAYLOAD[10:], page_count=2, page=2, recipe=2)
    with pytest.raises(ValueError, match=r"differ in header offsets \[26\]"):
        pd.decode_contour([first, second])


def test_a_layout_finds_the_blocks_where_it_says():
    memory = [0xFFFF] * 5000
    memory[100:116] = pd.encode_link(pd.Link(clock=70_000), "little")
    memory[300:316] = pd.encode_service(pd.Service(job_id=70_001), "little")
    header, payload = page_of([RECTANGLE], "little")
    memory[2000:2050] = header + payload
    layout = pd.Layout(100, 300, 2000, 100, "little")
    assert layout.link(memory).clock == 70_000
    assert layout.service(memory).job_id == 70_001
    assert (
        pd.decode_contour([(layout.header_registers(memory), layout.payload(memory))], "little").rings[0] == RECTANGLE
    )


def test_a_block_of_the_wrong_length_is_an_error():
    with pytest.raises(ValueError, match="seen 15 registers, expected 16"):
        pd.decode_link([0] * 15)


def test_the_played_controller_accepts_the_worked_example_once():
    controller = played(own_trigger_open=True)
    put(controller, (HEADER, PAYLOAD))
    assert controller.scan() == pc.ACCEPTED
    assert controller.scan() is None
    link = controller.layout.link(controller.memory)
    assert (link.ack_transfer, link.ack_result, link.last_job, link.last_result) == (3, 1, 7, 1)
    assert not controller.own_trigger_open
    put(controller, page_of([RECTANGLE], transfer=4))
    assert controller.scan() == pc.ACCEPTED_BEFORE
    assert [contour.rings for contour in controller.contours] == [(RECTANGLE,)]
    assert controller.faults == []


@pytest.mark.parametrize(
    ("state", "page", "answer", "last_job"),
    [
        ({}, {"payload_length": 2000}, pc.BAD_LAYOUT, 0),
        ({}, {"crc32": 5}, pc.BAD_CRC, 0),
        ({}, {"layout": 9}, pc.BAD_LAYOUT, 0),
        ({}, {"session": 8}, pc.OUTDATED, 0),
        ({"last_job": 8, "last_result": 1}, {}, pc.OUTDATED, 8),
        ({"last_job": 7, "last_result": 5}, {}, pc.EXPIRED, 7),
        ({"last_job": 7, "last_result": 1}, {"withdrawal": True}, pc.ACCEPTED_BEFORE, 7),
        ({}, {"withdrawal": True}, pc.WITHDRAWN, 7),
        ({"controller_state": 2}, {"withdrawal": True}, pc.WITHDRAWN, 7),
        ({}, {"captured_at": 31_009}, pc.EXPIRED, 7),
        ({}, {"captured_at": 31_010}, pc.ACCEPTED, 7),
        ({}, {"captured_at": 31_009, "valid_for": 0}, pc.ACCEPTED, 7),
        ({}, {"captured_at": 62_000}, pc.EXPIRED, 7),
        ({}, {"trigger": 4}, pc.EXPIRED, 7),
        ({}, {"trigger": 0}, pc.ACCEPTED, 7),
        ({"own_trigger_open": True}, {"trigger": 0}, pc.EXPIRED, 7),
        ({"controller_state": 0}, {}, pc.NOT_READY, 0),
        ({}, {"page": 2, "page_count": 2}, pc.PAGE_MISSING, 0),
        ({}, {"min_y": 1}, pc.BAD_LAYOUT, 0),
        ({}, {"area": 4_000}, pc.GEOMETRY_REFUSED, 7),
        ({"judge": lambda _contour: pc.OPERATOR_REFUSED}, {}, pc.OPERATOR_REFUSED, 7),
    ],
)
def test_the_played_controller_gives_the_first_answer_that_holds(state, page, answer, last_job):
    controller = played(**state)
    put(controller, page_of([RECTANGLE], **page))
    assert controller.scan() == answer
    link = controller.layout.link(controller.memory)
    assert (link.ack_result, link.ack_transfer, link.last_job) == (answer, 3, last_job)


def test_the_played_controller_keeps_the_order_of_pages():
    first, second = two_pages()
    controller = played()
    assert controller.answer(*second) == pc.PAGE_MISSING
    assert controller.answer(*first) == pc.ACCEPTED
    assert controller.answer(*first) == pc.ACCEPTED
    assert (controller.last_job, controller.contours) == (0, [])
    assert controller.answer(*second) == pc.ACCEPTED
    assert controller.last_job == 7
    assert controller.contours[0].rings == (RECTANGLE,)


def test_a_page_already_held_is_answered_1_and_not_added():
    payload = PAYLOAD
    cuts = [payload[:6], payload[6:10], payload[10:]]
    first, second, third = (
        page_of([RECTANGLE], payload=cut, page_count=3, page=number, flags=4 * (number == 3))
        for number, cut in enumerate(cuts, 1)
    )
    controller = played()
    assert [controller.answer(*page) for page in (first, second, second, third)] == [1, 1, 1, 1]
    assert controller.contours[0].rings == (RECTANGLE,)
    controller = played()
    changed = page_of([RECTANGLE], payload=[2, *cuts[1][1:]], page_count=3, page=2, flags=0)
    assert [controller.answer(*page) for page in (first, second, changed)] == [1, 1, 1]
    assert controller.faults == ["page 2 of job 7 was repeated with other content"]


def test_a_page_of_another_job_does_not_join():
    first, _ = two_pages()
    foreign = page_of([RECTANGLE], payload=PAYLOAD[10:], page_count=2, page=2, job_id=8)
    controller = played()
    assert [controller.answer(*page) for page in (first, foreign)] == [pc.ACCEPTED, pc.PAGE_MISSING]


def test_a_restart_begins_a_session_and_keeps_or_loses_the_last_job():
    controller = played()
    put(controller, (HEADER, PAYLOAD))
    controller.scan()
    controller.start(10)
    link = controller.layout.link(controller.memory)
    assert (link.session, link.last_job, link.last_result, link.ack_transfer) == (10, 7, 1, 0)
    assert controller.scan() == pc.OUTDATED
    controller.start(11, memory_lost=True)
    assert controller.layout.link(controller.memory).last_job == 0


def test_a_trigger_counts_from_65535_on_to_1_and_closes_when_the_job_has_ended():
    controller = played()
    controller.trigger_counter = 0xFFFF
    assert controller.trigger(recipe=3, block_thickness=20_000) == 1
    link = controller.layout.link(controller.memory)
    assert (link.trigger_counter, link.recipe, link.block_thickness) == (1, 3, 20_000)
    service = pd.Service(trigger_ack=1, session_ack=9, job_id=4, settled_job=3, test_value=0x01020304)
    controller.memory[16:32] = pd.encode_service(service)
    controller.scan()
    assert controller.own_trigger_open
    assert controller.layout.link(controller.memory).test_echo == 0x01020305
    controller.memory[16:32] = pd.encode_service(replace(service, settled_job=4))
    controller.scan()
    assert not controller.own_trigger_open
