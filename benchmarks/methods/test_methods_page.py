"""docs/reports/methods.md shows what the methods do: its figures and tables are drawn again, and compared.

Not byte by byte: another OpenCV draws other letters, and a last bit of a float may move a pixel of a rendered block.
A contour that lies elsewhere by a pixel changes ten times what is allowed here.
"""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest

from benchmarks.methods.__main__ import PAGE, PICTURES
from benchmarks.methods.figures import figures, panels
from benchmarks.methods.tables import tables
from benchmarks.page_section import section

NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?")
OTHERWISE_LEVELS = 40
OTHERWISE_SHARE = 0.001
NUMBERS_OFF = 0.2
ANEW = "Run `make methods`, and read the page again: its sentences may no longer be true"


def test_the_figures_are_what_is_drawn_now() -> None:
    drawn = figures()
    named = set(re.findall(r"\(\.\./pictures/([^)]+)\)", PAGE.read_text(encoding="utf-8")))
    assert named == set(drawn) == {path.name for path in PICTURES.glob("methods-*")}
    for name, figure in drawn.items():
        shown = cv2.imread(str(PICTURES / name))
        assert shown.shape == figure.shape, f"{name}: {ANEW}"
        for number, (there, now) in enumerate(zip(panels(shown), panels(figure), strict=True), 1):
            otherwise = cv2.absdiff(there, now).max(axis=2) > OTHERWISE_LEVELS
            assert otherwise.mean() <= OTHERWISE_SHARE, f"{name}, panel {number}: {ANEW}"


def test_the_tables_are_what_is_measured_now() -> None:
    for name, measured in tables().items():
        shown = section(name, PAGE)
        assert NUMBER.sub("#", shown) == NUMBER.sub("#", measured), f"table {name}: {ANEW}"
        there, now = ([float(found) for found in NUMBER.findall(text)] for text in (shown, measured))
        assert there == pytest.approx(now, rel=0.01, abs=NUMBERS_OFF), f"table {name}: {ANEW}"


def test_the_sentence_on_core_and_step_is_true() -> None:
    rows = re.findall(r"core (\d+), step (\d+) \| ([\d.]+) \| ([+-][\d.]+) \|", section("core-and-step", PAGE))
    share = {(int(core), int(step)): float(area) for core, step, _, area in rows}
    assert share[5, 5] < share[10, 10] < share[25, 25]
    assert share[10, 20] < 0 < share[10, 10] < share[10, 5] < share[10, 1]


def test_a_figure_with_a_contour_elsewhere_would_be_found() -> None:
    first, second, *_ = panels(cv2.imread(str(PICTURES / "methods-core-and-step.png")))
    otherwise = cv2.absdiff(first, np.roll(first, 1, axis=0)).max(axis=2) > OTHERWISE_LEVELS
    assert otherwise.mean() > 10 * OTHERWISE_SHARE
    otherwise = cv2.absdiff(first, second).max(axis=2) > OTHERWISE_LEVELS
    assert otherwise.mean() > 10 * OTHERWISE_SHARE
