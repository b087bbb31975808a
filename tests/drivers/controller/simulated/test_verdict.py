"""What the simulated controller says of a client that breaks the protocol's rules."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable

import pytest

from drivers.controller.mailbox.blocks import ServiceBlock, encode_service
from drivers.controller.mailbox.pages import Page
from drivers.controller.simulated.verdict import KINDS, Verdict
from tests.support.controller.raw_client import SESSION, Client, page, simulated
from tests.support.controller.simulated_bench import sealed
from tests.support.service.waiting import until

# --- the verdict ------------------------------------------------------------------------------------------------------


async def _commit_by_fc16(client: Client) -> None:
    await client.write(32, 1, *page().header, *page().payload)


async def _write_while_valid(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write(33, *page().header, *page().payload)


async def _no_clearing(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write_one(32, 2)


async def _same_transfer_again(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write_one(32, 0)
    await client.write_one(32, 1)


async def _same_transfer_other_content(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write_one(32, 0)
    await client.write(33, *page(job_id=2).header)
    await client.write_one(32, 1)


async def _job_down(client: Client) -> None:
    await client.write_page(page(job_id=2), 1)
    await client.write_page(page(job_id=1), 2)


async def _other_content(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write_page(sealed(page(), at26=2), 2)


async def _other_session(client: Client) -> None:
    await client.write_page(page(), 1)
    await client.write_page(page(session=SESSION + 1), 2)


async def _written_in_parts(client: Client, *cuts: int) -> None:
    """A page in requests that begin at the header's first register and at `cuts`, offsets in the contour block."""
    registers = [*page().header, *page().payload]
    await client.write_one(32, 0)
    for start, stop in zip([1, *cuts], [*cuts, 1 + len(registers)], strict=True):
        await client.write(32 + start, *registers[start - 1 : stop - 1])
    await client.write_one(32, 1)


async def _split_box(client: Client) -> None:
    await _written_in_parts(client, 14)


async def _split_ring_table(client: Client) -> None:
    await _written_in_parts(client, 33)


async def _split_pair(client: Client) -> None:
    await _written_in_parts(client, 32, 36)


async def _single_registers(client: Client) -> None:
    await client.write_one(32, 0)
    await client.write_one(33, 1)


async def _service_in_part(client: Client) -> None:
    await client.write(18, 7)


async def _service_content(client: Client) -> None:
    await client.write(16, *encode_service(ServiceBlock(protocol_version=2), "big"))


async def _filled_withdrawal(client: Client) -> None:
    withdrawal = Page(page().header, ())
    await client.write_page(sealed(withdrawal, at1=0, at7=0), 1)


async def _area_in_another_unit(client: Client) -> None:
    await client.write_page(page(area_mm2=100), 1)


async def _wrong_flags(client: Client) -> None:
    await client.write_page(sealed(page(), at27=0), 1)


CRIMES: dict[Callable, set[str]] = {
    _commit_by_fc16: {"transfer-not-alone"},
    _write_while_valid: {"written-while-valid"},
    _no_clearing: {"commit-without-clearing"},
    _same_transfer_again: {"transfer-not-new"},
    _same_transfer_other_content: {"transfer-reused"},
    _job_down: {"job-went-down"},
    _other_content: {"content-changed"},
    _other_session: {"job-in-two-sessions", "content-changed"},
    _split_box: {"value-split"},
    _split_ring_table: {"value-split"},
    _split_pair: {"value-split"},
    _single_registers: {"page-by-single-registers"},
    _service_in_part: {"service-block-partial"},
    _service_content: {"service-block-content"},
    _filled_withdrawal: {"withdrawal-not-empty"},
    _area_in_another_unit: {"contradictory-page"},
    _wrong_flags: {"contradictory-page"},
}


@pytest.mark.parametrize(("crime", "kinds"), CRIMES.items(), ids=lambda value: getattr(value, "__name__", None))
async def test_what_a_client_does_against_the_protocol_stands_in_the_verdict(crime: Callable, kinds: set[str]) -> None:
    async with simulated() as controller, Client(controller.port) as client:
        await client.until_started()
        await crime(client)
        assert set(controller.verdict.counts) == kinds


async def test_a_page_that_is_cut_between_its_values_is_in_order() -> None:
    async with simulated() as controller, Client(controller.port) as client:
        await client.until_started()
        await _written_in_parts(client, 2, 12, 16, 32, 34, 38)
        assert controller.verdict.clean, controller.verdict


async def test_a_heartbeat_that_stands_still_on_an_open_connection_is_noted_once() -> None:
    now = 100.0
    async with simulated(now=lambda: now) as controller, Client(controller.port) as client:
        for beat, seconds in ((1, 0.9), (2, 1.0), (2, 0.3), (2, 5.0), (3, 0.0)):
            await client.write(16, *encode_service(ServiceBlock(service_heartbeat=beat), "big"))
            now += seconds
            await asyncio.sleep(0.01)
        assert dict(controller.verdict.counts) == {"heartbeat-stalled": 1}
        assert controller.verdict.longest_heartbeat_gap_s == pytest.approx(6.3)


async def test_a_client_that_went_away_and_came_back_had_no_stalled_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    now, seen = 100.0, list[bool]()
    async with simulated(now=lambda: now) as controller:
        told = controller.connection
        monkeypatch.setattr(controller, "connection", lambda up: (told(up), seen.append(up)))
        for times in (1, 2):
            async with Client(controller.port) as client:
                await client.write(16, *encode_service(ServiceBlock(service_heartbeat=1), "big"))
            await until(lambda count=times: seen == [True, False] * count)
            now += 60
        assert controller.verdict.clean


def test_a_verdict_counts_on_but_keeps_a_bounded_number_of_texts() -> None:
    verdict = Verdict()
    for number in range(1000):
        verdict.note("value-split", f"text {number}")
    written = json.loads(json.dumps(verdict.as_json()))
    assert written["violations"][0]["count"] == 1000
    assert len(written["violations"][0]["seen"]) == 20
    assert not written["clean"]


def test_a_kind_of_violation_that_has_no_rule_is_a_mistake() -> None:
    with pytest.raises(KeyError):
        Verdict().note("something", "else")
    assert all(rule and not rule.endswith(".") for rule in KINDS.values())
