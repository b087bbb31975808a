"""Gauge files: what each may say, and what is wrong with it told by name."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.certifying.gauge_file import GaugeFileError, read_gauge

HEAD = {
    "version": 1,
    "id": "PL-07",
    "calibrated_by": "length laboratory, 2026-118",
    "calibrated_on": "2026-10-02",
    "height_mm": 20.0,
    "height_uncertainty_mm": 0.05,
    "form_mm": 0.02,
    "expansion_um_per_m_k": 11.5,
}
BOARD = {"squares": [11, 8], "square_mm": 25.0}
LENGTHS = [
    {"name": "bottom", "length_mm": 225.03, "uncertainty_mm": 0.02, "between": [[1, 1], [10, 1]]},
    {"name": "rising", "length_mm": 270.4, "uncertainty_mm": 0.02, "between": [[1, 1], [10, 7]]},
]
SIDES = [
    {"name": "long", "length_mm": 240.1, "uncertainty_mm": 0.03},
    {"name": "short", "length_mm": 160.2, "uncertainty_mm": 0.03},
]
PLATE: dict[str, Any] = {**HEAD, "kind": "plate", "board": BOARD, "lengths": LENGTHS}
BLOCK: dict[str, Any] = {**HEAD, "kind": "block", "lengths": SIDES}


def written(path: Path, data: Any) -> Path:
    path.write_text(data if isinstance(data, str) else yaml.safe_dump(data), encoding="utf-8")
    return path


def test_a_plate_and_a_block_are_read_from_yaml_and_json(tmp_path: Path) -> None:
    plate = read_gauge(written(tmp_path / "plate.yaml", PLATE))
    assert [one.length_mm for one in plate.known] == [225.03, 270.4]
    assert plate.file.id == "PL-07"
    block = read_gauge(written(tmp_path / "block.json", json.dumps(BLOCK)))
    assert [one.name for one in block.known] == ["long", "short"]
    assert block.digest.startswith("sha256:")
    assert block.digest != plate.digest


def changed(data: dict[str, Any], place: int, **values: Any) -> dict[str, Any]:
    """The same with other values in one of its lengths; None takes a key out."""
    entry = {key: value for key, value in {**data["lengths"][place], **values}.items() if value is not None}
    return {**data, "lengths": [*data["lengths"][:place], entry, *data["lengths"][place + 1 :]]}


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({**BLOCK, "calibrated_on": "soon"}, "calibrated_on: seen 'soon', expected a date such as 2026-11-23"),
        (
            {**BLOCK, "calibrated_on": 5.5},
            "calibrated_on: seen 5.5, expected a date such as 2026-11-23, without a time",
        ),
        ({**BLOCK, "calibrated_on": True}, "calibrated_on: seen true, .*, expected a date such as"),
        (changed(PLATE, 0, length_mm=None, length_in=8.859), r"lengths\[0\]\.length_in: unknown key"),
        (
            changed(PLATE, 0, length_mm=22.503),
            r"length_mm: is 22\.503, expected about 225 mm .* looks like centimetres",
        ),
        (changed(PLATE, 0, length_mm=8.859), "looks like inches: give millimetres"),
        (changed(PLATE, 1, length_mm=0.2704), "looks like metres"),
        (changed(PLATE, 0, length_mm=250.0), r"length_mm: is 250, expected about 225 mm"),
        (changed(PLATE, 0, between=[[1, 1], [11, 1]]), r"corner \[11, 1\] is not on a board of 11x8 squares"),
        (changed(PLATE, 0, between=[[1, 1], [1, 1]]), "both ends are one corner"),
        (changed(PLATE, 0, name="rising"), "two are named 'rising'"),
        (changed(PLATE, 0, uncertainty_mm=-0.1), r"uncertainty_mm.*seen -0\.1, expected 0 or more"),
        (changed(PLATE, 0, length_mm="225 mm"), r"length_mm.*expected a number"),
        ({**PLATE, "board": {"squares": [5, 4], "square_mm": 25.0}}, r"board\.squares: are 5x4: expected 6 or more"),
        ({**PLATE, "unit": "inch"}, "unit: unknown key"),
        ({**PLATE, "lengths": LENGTHS[:1]}, "2 entries or more"),
        ({**PLATE, "board": {**BOARD, "dictionary": "DICT_9X9"}}, "dictionary is 'DICT_9X9'"),
        ({**BLOCK, "lengths": SIDES[::-1]}, "expected the longer one first"),
        ({**BLOCK, "lengths": [SIDES[0], {**SIDES[1], "length_mm": 238.0}]}, "5 % or more between them"),
        ({**PLATE, "kind": "bar"}, "kind is 'bar', expected plate or block"),
        ({key: value for key, value in PLATE.items() if key != "height_mm"}, "height_mm: is missing"),
        ("", "is empty, expected kind"),
        ("[1, 2]", "holds a list"),
        ("a: [", "gauge.yaml: line"),
    ],
)
def test_what_is_wrong_is_told_by_name(data: Any, expected: str, tmp_path: Path) -> None:
    with pytest.raises(GaugeFileError, match=expected):
        read_gauge(written(tmp_path / "gauge.yaml", data))


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(GaugeFileError, match=r"cannot be read: No such file.* another file with --gauge"):
        read_gauge(tmp_path / "none.yaml")
