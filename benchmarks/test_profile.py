"""The profile counts what it says."""

from __future__ import annotations

import importlib

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.profile import REST, STEPS, measured, run


def test_every_step_is_a_function_of_the_engine() -> None:
    for places in STEPS.values():
        for place in places:
            module, name = place.split(":")
            assert callable(getattr(importlib.import_module(module), name)), place


def test_every_step_is_one_of_a_trace() -> None:
    row, steps = measured(2, 1)
    assert row[0] == "2 MP"
    assert all(f"| {name} |" in steps for name in STEPS)


def test_every_array_made_of_a_picture_is_counted_with_its_bytes() -> None:
    picture = np.zeros((20, 30), np.uint8)

    def work(seen: NDArray[np.uint8]) -> None:
        wide = np.asarray(cv2.blur(seen[::2], (3, 3))).astype(np.float32)
        wide += 1.0

    told = run(work, picture, told=True).took[REST]
    assert (told.calls, told.total, told.largest) == (2, 300 + 1200, 1200)
    assert type(np.asarray(cv2.blur(picture, (3, 3)))) is np.ndarray
