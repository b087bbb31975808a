"""The register map says what the codec does, and where the configuration puts it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from drivers.controller.mailbox.blocks import LINK_FIELDS, SERVICE_FIELDS
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import HEADER_FIELDS
from drivers.controller.mailbox.part_block import PART_HEADER_FIELDS
from service.cli.main import main
from service.link.register_map import MEANINGS, register_map

ROOT = Path(__file__).parents[3]
ROW = re.compile(r"^\| (\d+)(?:–(\d+))? \| (\d+)(?:–(\d+))? \| (\w+) \|", re.MULTILINE)


def rows(page: str) -> dict[tuple[int, str], tuple[int, int, int]]:
    """Last address, and the 4xxxxx numbers of both ends, by first address and name."""
    return {
        (int(first), name): (int(last or first), int(first4), int(last4 or first4))
        for first, last, first4, last4, name in ROW.findall(page)
    }


def test_the_page_is_what_the_codec_makes_now() -> None:
    page = (ROOT / "docs" / "reference" / "register-map.md").read_text(encoding="utf-8")
    assert page == register_map(MailboxLayout()), (
        "write it anew: python -m service.link.register_map docs/reference/register-map.md"
    )


def test_every_register_of_the_layout_has_one_row_and_no_other_has() -> None:
    layout = MailboxLayout(1000, 200, 5000, 502, "little", 6000, 300)
    shown = rows(register_map(layout))
    covered = sorted(address for (first, _), (last, _, _) in shown.items() for address in range(first, last + 1))
    assert covered == sorted(address for start, end in layout.blocks.values() for address in range(start, end))
    assert all(
        (first4, last4) == (first + 400001, last + 400001) for (first, _), (last, first4, last4) in shown.items()
    )


def test_each_name_stands_at_its_offset() -> None:
    layout = MailboxLayout(1000, 200, 5000, part_address=8000, part_capacity=24)
    shown = rows(register_map(layout))
    tables = ((LINK_FIELDS, 1000), (SERVICE_FIELDS, 200), (HEADER_FIELDS, 5000), (PART_HEADER_FIELDS, 8000))
    for fields, start in tables:
        for field in fields:
            assert shown[start + field.offset, field.name][0] == start + field.offset + field.width - 1
            assert MEANINGS[field.name]


def test_the_command_prints_it_at_the_configured_addresses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "config.yaml"
    sample = ROOT / "service" / "samples"
    config.write_text(
        f"camera: {{kind: files, path: {sample}}}\ncalibration: {{file: {sample / 'calibration.yaml'}}}\n"
        "controller: {kind: modbus-tcp, link_address: 3000, word_order: little}\n"
    )
    assert main(["register-map", "--config", str(config)]) == 0
    assert capsys.readouterr().out == register_map(MailboxLayout(link_address=3000, word_order="little"))


def test_without_a_controller_there_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(f"camera: {{kind: files, path: {ROOT / 'service' / 'samples'}}}\ncontroller: {{kind: none}}\n")
    assert main(["register-map", "--config", str(config)]) == 2
    assert "there are no registers" in capsys.readouterr().err
