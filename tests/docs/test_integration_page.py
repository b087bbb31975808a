"""The page for integrators: every register as the code has it."""

from __future__ import annotations

import json
import re
from pathlib import Path

from drivers.controller.mailbox.blocks import LINK_FIELDS, SERVICE_FIELDS
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import HEADER_FIELDS, crc32_of
from service.commissioning.given_shapes import SHAPES
from service.link.register_map import MEANINGS, register_map

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "integrating-a-controller.md").read_text(encoding="utf-8")


def rows(page: str, name_column: int) -> list[tuple[str, str, str]]:
    """Address, name and type of each register in a page's tables."""
    found = []
    for line in page.splitlines():
        cells = [cell.strip().strip("`") for cell in line.strip("|").split("|")]
        if re.match(r"^\d+(–\d+)?$", cells[0]):
            found.append((cells[0], cells[name_column], cells[name_column + 1]))
    return found


def test_every_register_is_there_once_with_its_address_and_type() -> None:
    assert rows(PAGE, 1) == rows(register_map(MailboxLayout()), 2)
    named = {field.name for field in (*LINK_FIELDS, *SERVICE_FIELDS, *HEADER_FIELDS)}
    assert named | {"transfer", "payload", "reserved"} == {name for _, name, _ in rows(PAGE, 1)}


def test_names_in_code_marks_that_look_like_registers_are_registers() -> None:
    settings = {"payload_capacity", "link_address", "longest_read", "longest_write"}
    known = MEANINGS.keys() | settings | {"take_simulated", "take_unaligned", "bad_crc"}
    named = set(re.findall(r"`([a-z]+(?:_[a-z]+)+)`", PAGE))
    assert named <= known, named - known


def test_the_shapes_that_it_names_are_there_and_the_crc_is_the_first_vectors() -> None:
    assert set(re.findall(r"--shape (\w+)", PAGE)) <= SHAPES.keys()
    page = json.loads((DOCS / "reference" / "golden-vectors.json").read_text())["contours"][0]["pages"][0]
    assert f"{crc32_of(page['header'], page['payload']):08X}" in PAGE
