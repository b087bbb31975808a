"""The golden vectors, read by a decoder that shares no line with what made them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivers.controller.mailbox.golden_vectors import as_text
from tests.support.controller.protocol_decoder import (
    decode_contour,
    decode_header,
    decode_link,
    decode_service,
    page_crc,
)

FILE = Path(__file__).parents[4] / "docs" / "reference" / "golden-vectors.json"
VECTORS: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
CONTOURS = VECTORS["contours"]
UNKNOWN = 0xFFFFFFFF
TRANSFER = 3  # the commit register, which no page holds


def rings(contour: dict[str, Any]) -> tuple[tuple[tuple[int, int], ...], ...]:
    return tuple(tuple(map(tuple, ring)) for ring in (contour["exterior"], *contour["holes"]))


def test_the_file_is_what_the_codec_makes_now() -> None:
    assert FILE.read_text(encoding="utf-8") == as_text(), (
        "write it anew: python -m drivers.controller.mailbox.golden_vectors docs/reference/golden-vectors.json"
    )


@pytest.mark.parametrize("contour", CONTOURS, ids=lambda contour: f"{contour['name'][:30]}-{contour['word_order']}")
def test_an_independent_decoder_reads_each_contour_out_of_its_registers(contour: dict[str, Any]) -> None:
    pages = [((TRANSFER, *page["header"]), page["payload"]) for page in contour["pages"]]
    decoded = decode_contour(pages, contour["word_order"])
    assert decoded.rings == rings(contour)
    header = decoded.header
    assert (header.job_id, header.session, header.trigger) == (
        contour["job_id"],
        contour["session"],
        contour["trigger"],
    )
    assert (header.recipe, header.area, header.captured_at) == (
        contour["recipe"],
        contour["area"],
        contour["captured_at"],
    )
    assert header.valid_for == contour["valid_for"]
    assert header.uncertainty == (UNKNOWN if contour["uncertainty"] is None else contour["uncertainty"])
    assert header.flags & 1 == (not contour["from_a_live_camera"])
    assert bool(header.flags & 8) == contour["aligned"]
    assert all(len(page["payload"]) <= contour["payload_capacity"] for page in contour["pages"])


@pytest.mark.parametrize("withdrawal", VECTORS["withdrawals"])
def test_an_independent_decoder_reads_each_withdrawal(withdrawal: dict[str, Any]) -> None:
    registers = (TRANSFER, *withdrawal["header"])
    header = decode_header(registers, withdrawal["word_order"])
    assert (header.layout, header.job_id, header.session) == (0, withdrawal["job_id"], withdrawal["session"])
    assert header.crc32 == page_crc(registers, withdrawal["payload"])
    assert withdrawal["payload"] == []


@pytest.mark.parametrize("block", VECTORS["blocks"])
def test_an_independent_decoder_reads_each_block(block: dict[str, Any]) -> None:
    decode = decode_link if block["block"] == "link" else decode_service
    decoded = vars(decode(block["registers"], block["word_order"]))
    assert decoded.pop("reserved", 0) == 0
    assert decoded == block["values"]


def test_they_show_all_that_there_is() -> None:
    assert {contour["word_order"] for contour in CONTOURS} == {"big", "little"}
    assert {len(contour["pages"]) > 1 for contour in CONTOURS} == {True, False}
    assert {bool(contour["holes"]) for contour in CONTOURS if len(contour["pages"]) > 1} == {True, False}
    assert {contour["uncertainty"] is None for contour in CONTOURS} == {True, False}
    assert any(value < 0 for contour in CONTOURS for vertex in contour["exterior"] for value in vertex)


def test_the_first_is_the_protocols_worked_example() -> None:
    (page,) = CONTOURS[0]["pages"]
    worked = (
        "0003 0001 0000 0007 0001 0001 0001 0012 B6B0 0A39 0000 0004 0000 0000 0000 0000 0001 86A0 0000 C350 0000 1388 "
        "0000 00C8 0000 EA60 0001 0004 0000 7530 0009 0005"
    )
    assert [TRANSFER, *page["header"]] == [int(word, 16) for word in worked.split()]
    assert decode_header((0, *VECTORS["withdrawals"][0]["header"])).crc32 == 0x59E1A3D2
