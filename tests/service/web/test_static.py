"""The page's files fit together: every word is there in both languages, and every pair of colours can be read."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import get_args

import pytest

import service.judging
import service.web
from contour.camera_calibration.view_selection import SIDES
from service.config.recipe_keys import FILES, WRITTEN_ONLY
from service.config.recipes import Gcode, OneOfParts, PartToCut, Recipe
from service.state import State
from service.web.commission.endpoints import OPERATIONS
from service.web.html import KINDS
from service.web.recipes.models import TrialState

STATIC = Path(service.web.__file__).parent / "static"
TEXTS = json.loads((STATIC / "texts.json").read_text())
COMMISSION = json.loads((STATIC / "commission.json").read_text())
OF_RECIPES = json.loads((STATIC / "recipes.json").read_text())
RECIPE_SCRIPTS = ("recipes.js", "recipe-form.js", "tried.js")
SCRIPTS = {path.name: path.read_text() for path in STATIC.glob("*.js")}
PAGE = "".join((STATIC / f"{name}.html").read_text() for name in ("page", "dialogs"))
CSS = (STATIC / "page.css").read_text()
INK = ("ink", "dim", "good", "bad", "busy", "hold", "gone", "strong")


@pytest.mark.parametrize("texts", [TEXTS, COMMISSION, OF_RECIPES], ids=["page", "commission", "recipes"])
def test_both_languages_have_the_same_words_with_the_same_places(texts: dict[str, dict[str, str]]) -> None:
    assert texts["en"].keys() == texts["ru"].keys()
    for key, english in texts["en"].items():
        places = [sorted(re.findall(r"\{\w+\}", text)) for text in (english, texts["ru"][key])]
        assert places[0] == places[1], key


def test_every_word_that_setting_up_asks_for_is_there() -> None:
    script, page = SCRIPTS["commission.js"], (STATIC / "commission.html").read_text()
    asked = set(re.findall(r'data-[ta]="(\w+)"', page)) | set(re.findall(r'words\("(\w+)"', script))
    asked |= {f"{what}_{step}" for step in re.findall(r'data-step="(\w+)"', page) for what in ("step", "do")}
    asked |= {f"missing_{side}" for side in SIDES} | {f"part_{part}" for part in range(9)}
    asked |= {one.path.rpartition("/")[2] for one in OPERATIONS if one.method == "POST"} | {"begin"}
    known = TEXTS["en"].keys() | COMMISSION["en"].keys()
    assert len(asked) > 60
    assert asked - known == set()
    assert TEXTS["en"].keys() & COMMISSION["en"].keys() == set(), "a word of the page means one thing"


def test_every_word_that_is_asked_for_is_there() -> None:
    asked = set(re.findall(r'data-[ta]="(\w+)"', PAGE)) | {state.label for state in State}
    for script in (text for name, text in SCRIPTS.items() if name not in ("commission.js", *RECIPE_SCRIPTS)):
        asked |= set(re.findall(r'words\("(\w+)"', script))
        asked |= set(re.findall(r'(?:line\(|\[)"(\w+)", (?:camera|link|look|report|job|seen|size|sure|!)', script))
        asked |= set(re.findall(r'\["[^"]+", "(key_\w+)"\]', script))
        asked |= set(re.findall(r'\b\d{3}: "(\w+)"', script))
        asked |= {f"live_{wait}" for wait in ("start", "job", "camera", "source", "now", "not_taken")}
        stages = re.search(r"STAGES = \[(.*?)\]", script)
        asked |= set(re.findall(r'"(\w+)"', stages[1])) if stages else set()
    assert len(asked) > 60
    assert asked - TEXTS["en"].keys() == set()


def test_every_word_of_the_page_of_recipes_is_there_and_none_is_one_of_the_other_pages() -> None:
    asked = set(re.findall(r'data-[ta]="(\w+)"', (STATIC / "recipes.html").read_text()))
    for name in RECIPE_SCRIPTS:
        asked |= set(re.findall(r'words\("(\w+)"', SCRIPTS[name]))
    asked |= {f"trial_{state}" for state in get_args(TrialState.model_fields["state"].annotation)}
    assert asked - TEXTS["en"].keys() - OF_RECIPES["en"].keys() == set()
    assert OF_RECIPES["en"].keys() & TEXTS["en"].keys() == set()


def test_every_key_of_a_recipe_that_can_be_set_is_described_in_russian_too() -> None:
    described = set()
    for model in (Recipe, Gcode, PartToCut, OneOfParts):
        for name, field in model.model_fields.items():
            if name not in (*WRITTEN_ONLY, *FILES, "gcode"):
                described.add(field.description)
    assert OF_RECIPES["described"].keys() == described
    for text in OF_RECIPES["described"].values():
        assert re.search("[а-я]", text)


def test_the_server_and_the_script_tell_the_same_shape_of_each_state() -> None:
    told = re.search(r"const KINDS = \{(.*?)\};", SCRIPTS["now.js"], re.DOTALL)
    assert told is not None
    assert dict(re.findall(r'(\w+): "(\w+)"', told[1])) == KINDS
    assert KINDS.keys() == {state.label for state in State}
    symbols = set(re.findall(r'id="s-(\w+)"', (STATIC / "symbols.svg").read_text()))
    outcomes = {"accepted", "written", "refused", "failed", "none", "busy"}
    assert symbols >= {*KINDS.values(), "lost", "waiting", *outcomes}


@pytest.mark.parametrize("folder", [STATIC, Path(service.judging.__file__).parent / "static"])
def test_nothing_in_a_page_is_inline_or_from_elsewhere(folder: Path) -> None:
    texts = {path.name: path.read_text() for path in folder.iterdir() if path.suffix in (".html", ".js", ".css")}
    for name, text in texts.items():
        outside = [url for url in re.findall(r"(?:https?:)?//[\w.-]+\.\w+[^\s\"']*", text) if "www.w3.org" not in url]
        assert [url for url in outside if not url.startswith("//")] == [], name
        if name.endswith(".html"):
            assert re.findall(r"\sstyle=|\son\w+=|<style|javascript:", text) == []
            assert re.findall(r"<script(?![^>]*\ssrc=)", text) == []
        if name.endswith(".js"):
            assert re.findall(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(", text) == []


def themes() -> list[dict[str, str]]:
    blocks = re.findall(r":root(?:\[data-theme=\"(?:dark|auto)\"\])? \{(.*?)\}", CSS, re.DOTALL)
    return [dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", block)) for block in blocks]


@pytest.mark.parametrize("colours", themes(), ids=["light", "dark", "dark by the system"])
def test_every_pair_of_colours_has_the_contrast_of_aa(colours: dict[str, str]) -> None:
    for name in INK:
        for ground in ("panel", "ground"):
            assert contrast(colours[name], colours[ground]) >= 4.5, f"{name} on {ground}"
    assert contrast(colours["on-strong"], colours["strong"]) >= 4.5
    assert contrast(colours["focus"], colours["panel"]) >= 3


def contrast(one: str, other: str) -> float:
    """WCAG 2.1, contrast ratio of two colours #rrggbb."""
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
