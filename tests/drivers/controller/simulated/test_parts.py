"""The simulated controller's dealing with the part block: what is torn, stale or of another job is never acted upon."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import Page
from drivers.controller.mailbox.part_block import PlacedPart, part_crc32_of, with_parts
from drivers.controller.simulated.contour import AcceptedContour
from drivers.controller.simulated.program import Pace
from tests.support.controller.simulated_bench import Bench, pages

AT = 2048
LAYOUT = MailboxLayout(part_address=AT, part_capacity=400)
SQUARE = np.array([[10_000, 10_000], [30_000, 10_000], [30_000, 30_000], [10_000, 30_000]])
PART = PlacedPart(1, 10_000, 10_000, 0, 5_000, 3_000, (SQUARE,))


def page_with(*parts: PlacedPart, **changes: object) -> Page:
    return with_parts(pages(**changes), parts, LAYOUT.part_capacity, "big")[-1]


def lay(bench: Bench, block: tuple[int, ...]) -> None:
    bench.registers[AT : AT + len(block)] = block


def test_an_accepted_contour_brings_its_part() -> None:
    bench, page = Bench(layout=LAYOUT), page_with(PART)
    lay(bench, page.part)
    assert bench.send(page).ack_result == 1
    ((part,),) = (contour.parts for contour in bench.taken)
    assert (part.number, part.x_mm, part.margin_mm, part.rings) == (
        1,
        10.0,
        5.0,
        (((10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0)),),
    )
    (taken,) = bench.taken
    assert AcceptedContour.from_json(taken.as_json()) == taken
    assert bench.verdict.clean, bench.verdict


def test_a_job_without_a_part_is_accepted_with_none() -> None:
    bench, page = Bench(layout=LAYOUT), page_with()
    lay(bench, page.part)
    assert bench.send(page).ack_result == 1
    assert bench.taken[0].parts == ()


def test_a_controller_that_does_not_know_the_block_takes_the_contour_as_ever() -> None:
    bench, page = Bench(), page_with(PART)
    lay(bench, page.part)
    assert bench.send(page).ack_result == 1
    assert bench.taken[0].parts is None


@pytest.mark.parametrize("place", range(38))
def test_a_block_with_any_register_torn_is_answered_2_and_the_repeat_accepted(place: int) -> None:
    bench, page = Bench(layout=LAYOUT), page_with(PART)
    torn = list(page.part)
    torn[place] ^= 1
    lay(bench, tuple(torn))
    assert bench.send(page).ack_result == 2
    assert (bench.taken, bench.link.last_job) == ([], 0)
    lay(bench, page.part)
    assert bench.send(page).ack_result == 1
    assert len(bench.taken) == 1


@pytest.mark.parametrize(
    "other",
    [
        page_with(PART, job_id=2),
        page_with(PART, session=8),
        page_with(PART, area_mm2=4951),
        Page((), (), (0,) * 38),
    ],
    ids=["of another job", "of another session", "of another page", "never written"],
)
def test_a_block_that_is_whole_but_not_this_page_s_is_answered_2(other: Page) -> None:
    bench = Bench(layout=LAYOUT)
    lay(bench, other.part)
    assert bench.send(page_with(PART)).ack_result == 2
    assert bench.taken == []


@pytest.mark.parametrize(
    "changes",
    [{0: 2}, {1: 2}, {12: 2}, {17: 2}, {29: 3}],
    ids=["layout", "parts", "rings", "the part's rings", "the ring table"],
)
def test_a_block_that_contradicts_itself_is_answered_3(changes: dict[int, int]) -> None:
    bench, page = Bench(layout=LAYOUT), page_with(PART)
    wrong = list(page.part)
    for place, value in changes.items():
        wrong[place] = value
    crc = part_crc32_of(wrong)
    wrong[6:8] = crc >> 16, crc & 0xFFFF
    lay(bench, tuple(wrong))
    assert bench.send(page).ack_result == 3
    assert bench.taken == []


def test_a_block_that_is_overwritten_while_it_is_copied_is_not_acted_upon() -> None:
    bench, page = Bench(layout=LAYOUT), page_with(PART)
    bench.program.pace = Pace(copy_scans=6)
    lay(bench, page.part)
    bench.send(page)
    bench.scan(3)
    lay(bench, page_with(replace(PART, x_um=99_000), job_id=2).part)
    assert bench.scan(4).ack_result == 2
    assert bench.taken == []


def test_only_the_last_page_is_held_against_the_block() -> None:
    layout = replace(LAYOUT, payload_capacity=16)
    bench = Bench(layout=layout)
    first, last = with_parts(pages(capacity=16), [PART], LAYOUT.part_capacity, "big")
    assert bench.send(first).ack_result == 1
    lay(bench, last.part)
    assert bench.send(last).ack_result == 1
    assert bench.taken[0].parts is not None


def test_a_withdrawal_asks_for_no_part_block() -> None:
    from drivers.controller.mailbox.pages import withdrawal

    bench = Bench(layout=LAYOUT)
    assert bench.send(withdrawal(1, bench.session, "big")).ack_result == 11
