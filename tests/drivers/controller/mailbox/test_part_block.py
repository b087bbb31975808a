"""The part block's codec: against the simulated controller's reading, which is written from part-block.md alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller import ContourTooLarge, MailboxError, Page
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.page_spans import spans
from drivers.controller.mailbox.page_text import pages_from_text, pages_to_text
from drivers.controller.mailbox.part_block import PlacedPart, part_starts, with_parts
from drivers.controller.mailbox.words import WordOrder
from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.simulated.contour import AcceptedPart, PageCopy
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.parts import PartCopy, may_be_cut
from tests.support.controller.simulated_bench import pages

VECTORS: dict[str, Any] = json.loads(
    (Path(__file__).parents[4] / "docs" / "reference" / "golden-vectors.json").read_text(encoding="utf-8")
)
I32 = st.integers(-(2**31), 2**31 - 1)
PARTS = st.lists(
    st.builds(
        PlacedPart,
        st.integers(1, 0xFFFF),
        I32,
        I32,
        st.integers(-180_000_000, 180_000_000),
        I32,
        st.integers(0, 2**32 - 1),
        st.lists(st.lists(st.tuples(I32, I32), min_size=3, max_size=9).map(np.array), min_size=1, max_size=3).map(
            tuple
        ),
    ),
    max_size=3,
)
ORDERS = st.sampled_from(["big", "little"])


def read(page: Page, block: tuple[int, ...], order: WordOrder) -> tuple[AcceptedPart, ...]:
    """What the simulated controller reads of the block behind its page."""
    copy = PartCopy(block, order)
    assert copy.belongs_to(PageCopy((1, *page.header, *page.payload), order))
    return copy.parts()


def as_sent(part: PlacedPart) -> AcceptedPart:
    rings = tuple(tuple((x / 1000, y / 1000) for x, y in ring.tolist()) for ring in part.rings_um)
    lengths = (part.margin_um / 1000, part.needed_um / 1000)
    return AcceptedPart(part.number, part.x_um / 1000, part.y_um / 1000, part.angle_udeg / 1e6, *lengths, rings)


@given(parts=PARTS, order=ORDERS)
def test_what_is_laid_is_what_another_reader_finds(parts: list[PlacedPart], order: WordOrder) -> None:
    *_, page = with_parts(pages(word_order=order), parts, 4000, order)
    assert read(page, page.part, order) == tuple(as_sent(part) for part in parts)
    assert len(page.part) % 2 == 0, "odd counts are those of reads that tell late replies apart"


@given(parts=PARTS, order=ORDERS, longest=st.integers(16, 123))
def test_no_request_splits_a_value_or_a_pair(parts: list[PlacedPart], order: WordOrder, longest: int) -> None:
    *_, page = with_parts(pages(word_order=order), parts, 4000, order)
    cut = spans(part_starts(page.part), longest)
    assert sum(count for _, count in cut) == len(page.part)
    assert all(count <= longest and may_be_cut(offset, page.part) for offset, count in cut)


@given(parts=PARTS, order=ORDERS)
def test_pages_that_were_kept_as_text_have_their_part_block_again(parts: list[PlacedPart], order: WordOrder) -> None:
    sent = with_parts(pages(8, order), parts, 4000, order)
    assert pages_from_text(pages_to_text(sent)) == sent
    assert all(not page.part for page in sent[:-1])


@pytest.mark.parametrize("vector", VECTORS["parts"], ids=lambda vector: f"{vector['name'][:20]}-{vector['word_order']}")
def test_each_golden_part_block_says_what_stands_beside_it(vector: dict[str, Any]) -> None:
    page = Page(tuple(vector["page"]["header"]), tuple(vector["page"]["payload"]))
    found = read(page, tuple(vector["part_block"]), vector["word_order"])
    names = ("x", "y", "angle", "margin", "needed")
    assert [
        {
            "part": part.number,
            **dict(zip(names, (round(value) for value in in_registers(part)), strict=True)),
            "exterior": [[round(x * 1000), round(y * 1000)] for x, y in part.rings[0]],
            "holes": [[[round(x * 1000), round(y * 1000)] for x, y in ring] for ring in part.rings[1:]],
        }
        for part in found
    ] == vector["parts"]


def in_registers(part: AcceptedPart) -> tuple[float, ...]:
    return (part.x_mm * 1e3, part.y_mm * 1e3, part.angle_deg * 1e6, part.margin_mm * 1e3, part.needed_mm * 1e3)


def test_a_part_that_does_not_fit_into_the_block_is_told_with_both_sizes() -> None:
    part = PlacedPart(1, 0, 0, 0, 1, 1, (np.array([[0, 0], [9, 0], [0, 9]]),))
    with pytest.raises(
        ContourTooLarge, match=r"1 part\(s\) of 3 vertices take 26 registers, part_block.capacity is 24"
    ):
        with_parts(pages(), [part], 24, "big")


async def test_a_page_with_its_part_block_goes_over_the_wire_and_reads_back() -> None:
    layout = MailboxLayout(part_address=2048, part_capacity=200)
    part = PlacedPart(1, -1, 2, -3, 4, 5, (np.array([[0, 0], [900, 0], [0, 900]]),) * 5)
    (page,) = with_parts(pages(), [part], 200, "big")
    async with SimulatedController(layout=layout) as simulated:
        controller = ModbusTcpController("127.0.0.1", simulated.port, layout=layout)
        await controller.connect()
        try:
            await controller.write_transfer(0)
            await controller.write_page(page)
            assert await controller.read_page(len(page.payload), len(page.part)) == page
            assert simulated.registers(2048, len(page.part)) == page.part
            assert simulated.verdict.clean, simulated.verdict
        finally:
            await controller.close()


async def test_a_part_block_is_an_error_where_the_layout_has_none() -> None:
    (page,) = with_parts(pages(), [], 200, "big")
    async with SimulatedController() as simulated:
        controller = ModbusTcpController("127.0.0.1", simulated.port)
        await controller.connect()
        try:
            with pytest.raises(MailboxError, match="a part block of 16 registers, the layout has none"):
                await controller.write_page(page)
        finally:
            await controller.close()
