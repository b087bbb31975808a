"""What was measured is told in Russian too: each sentence that code makes is known, with all that stands in it."""

from __future__ import annotations

import ast
import json
import re
import string
from importlib.resources import files
from pathlib import Path

import pytest

from service.details import PLACE, russian

ROOT = Path(__file__).parents[2]
TOLD: dict[str, str] = json.loads((files("service") / "details_ru.json").read_text(encoding="utf-8"))
SAID_IN = (
    *(f"contour/acceptance/{name}" for name in ("block_findings", "edge_findings", "picture_findings", "quality")),
    "contour/acceptance/polygon_findings",
    "contour/acceptance/error_budget",
    "contour/camera_calibration/board_detection",
    "contour/camera_calibration/view_selection",
    "contour/length_test/block",
    "contour/length_test/plate",
    "service/calibrating/teaching",
    "service/certifying/sight",
    "service/measuring/calibration_guard",
    "service/measuring/looks/outcome",
    "contour/ribbon/ribbon",
    *(f"service/web/commission/{name}_actions" for name in ("board", "cell", "machine")),
    *(f"service/web/commission/{name}" for name in ("bench", "board_shots", "score")),
    "service/measuring/part_trial",
)
LEAST = 12  # characters of a sentence; below are units and marks


def fragments(module: str) -> set[str]:
    """The words of the sentences that a module makes, between what is filled in."""
    tree = ast.parse((ROOT / f"{module}.py").read_text(encoding="utf-8"))
    skipped = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and isinstance(node.body[0], ast.Expr)
    }
    skipped |= {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    texts = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in skipped}
    return {text for text in texts if isinstance(text, str) and len(text) >= LEAST and " " in text}


@pytest.mark.parametrize("module", SAID_IN)
def test_every_sentence_of_a_refusal_is_known(module: str) -> None:
    known = "\n".join(TOLD)
    assert len(fragments(module)) > 0
    assert {text for text in fragments(module) if text.strip() not in known} == set()


@pytest.mark.parametrize("english", TOLD)
def test_what_is_filled_in_comes_out_in_its_place(english: str) -> None:
    names = PLACE.findall(english)
    assert sorted(names) == sorted(PLACE.findall(TOLD[english]))
    values = {name: f"{number + 1}7.25" for number, name in enumerate(names)}
    expected = TOLD[english].format(**{name: value.replace(".", ",") for name, value in values.items()})
    assert russian(english.format(**values)) == expected


@pytest.mark.parametrize(
    ("english", "expected"),
    [
        (
            "The contour's area is 12 mm², the recipe expects 100 to 4000 mm². Check that the block is the recipe's, "
            "and the lighting.; The contour cannot be cut: meets itself.",
            "Площадь контура 12 мм², по рецепту от 100 до 4000 мм². Проверьте, та ли это заготовка, и свет.; Контур "
            "нельзя раскроить: meets itself.",
        ),
        (
            "An object lies over 31.4 mm (84 px) of the block's edge near (120, 88) px, (45.2, 33.1) mm, and 2 more: "
            "how it runs below cannot be told. Take it away.",
            "Лежит предмет на кромке: 31,4 мм (84 пикс), край заготовки, возле (120, 88) пикс, (45,2, 33,1) мм, и ещё "
            "2: как кромка идёт под ним, сказать нельзя. Уберите его.",
        ),
        (
            "repeat with more tilt: 95 % of positions are within 0.018 mm on the table and 0.141 mm at 60 mm; 0.1 mm "
            "are allowed. Tilt tells distance from focal length: 20 degrees to all four sides, in more views where it "
            "was that already.",
            "повторите с большим наклоном: 95 % положений верны с точностью 0,018 мм на столе и 0,141 мм на высоте "
            "60 мм; допускается 0,1 мм. Наклон отличает расстояние от фокусного: 20 градусов во все четыре стороны, а "
            "если так и было — на большем числе снимков.",
        ),
        ("halted: blade (anna from 127.0.0.1)", "остановлено: blade (anna, адрес 127.0.0.1)"),
    ],
)
def test_sentences_within_sentences_are_told_too(english: str, expected: str) -> None:
    assert russian(english) == expected


@pytest.mark.parametrize("text", ["", "/dev/video0: is not there", "blade", "{x} {0} %s", "a; b.; c", "5 px of what"])
def test_what_is_not_known_stays_as_it_is(text: str) -> None:
    assert russian(text) == text


def test_no_sentence_is_left_half_in_english() -> None:
    allowed = re.compile(
        r"`combtrace board`|table\.file|calibration\.file|controller\.(?:kind|mode)|\bnone\b|observe|"
        r"\{\w+\}|[a-z]+(_[a-z0-9]+)+|wall-tips|pieces: largest|`combtrace confirm`|max_\w+|edge|\bx\b|\by\b"
    )
    left = {ru for ru in TOLD.values() if set(allowed.sub("", ru)) & set(string.ascii_letters)}
    assert left == set()
