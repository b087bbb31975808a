"""Two steps side by side give what they give one after the other, and leave nothing behind."""

from __future__ import annotations

import subprocess
import sys
import threading

import cv2
import numpy as np
import pytest

from contour.acceptance import trace_check
from contour.errors import NoBlockFound
from contour.image.side_by_side import side_by_side
from contour.material import closed_cells
from contour.walls import cell_scale
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from tests.support.processes.cell import SAMPLES
from tests.support.processes.processes import ROOT


def test_each_runs_while_the_other_does_and_their_thread_ends() -> None:
    met = threading.Barrier(2, timeout=30.0)
    threads = set(threading.enumerate())
    assert sorted(side_by_side(met.wait, met.wait)) == [0, 1]
    assert set(threading.enumerate()) == threads


def test_what_either_raises_comes_through_once_both_have_ended() -> None:
    ended: list[str] = []

    def fails() -> None:
        raise NoBlockFound("no cells")

    with pytest.raises(NoBlockFound, match="no cells"):
        side_by_side(fails, lambda: ended.append("other"))
    with pytest.raises(NoBlockFound, match="no cells"):
        side_by_side(lambda: ended.append("one"), fails)
    assert ended == ["other", "one"]


def test_a_process_that_keeps_to_one_thread_starts_none() -> None:
    told = (
        "import threading, cv2; from contour.image.side_by_side import *; keep_to_one_thread();"
        "one, other = side_by_side(threading.get_ident, threading.get_ident);"
        "print(one == other, cv2.getNumThreads())"
    )
    ran = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True, cwd=ROOT)
    assert ran.stdout.split() == ["True", "1"]


@pytest.mark.parametrize("sample", ["1-rectangle.jpg", "4-with-holes.jpg"])
def test_a_picture_is_measured_alike_by_one_thread_and_by_two(sample: str, monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.asarray(cv2.imread(str(SAMPLES / sample)), np.uint8)
    two = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    for module in (trace_check, closed_cells, cell_scale):
        monkeypatch.setattr(module, "side_by_side", lambda one, other: (one(), other()))
    one = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert one.findings == two.findings
    assert one.uncertainty_px == two.uncertainty_px
    assert one.pixels is not None
    assert two.pixels is not None
    for alone, beside in zip(one.pixels.rings, two.pixels.rings, strict=True):
        np.testing.assert_array_equal(alone, beside)
