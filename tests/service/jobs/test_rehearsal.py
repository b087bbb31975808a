"""The rehearsal goes all the way of a trace, and stops nothing where it fails."""

from __future__ import annotations

import logging
import subprocess
import sys

import pytest

from service.config.plain_recipe import PlainRecipe
from service.jobs.rehearsal import drawn_comb, rehearse
from service.measuring.measure import Measurer
from tests.support.processes.cell import SAMPLES


def test_its_picture_is_traced_and_judged_to_the_end() -> None:
    measurement = Measurer(None).measure(drawn_comb(), PlainRecipe(), 0.0)
    assert measurement.texts == ()
    assert {"mask", "trace", "quality", "simplify", "judge"} <= set(measurement.timings_ms)


LATE = """
import sys
from pathlib import Path

import cv2
from service.config.plain_recipe import PlainRecipe
from service.jobs.rehearsal import rehearse
from service.measuring.calibration_file import load_record
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer

guard = CalibrationGuard(load_record(Path(sys.argv[1])), GuardLimits())
measurer = Measurer(guard.record.calibration, guard=guard)
pictures = [cv2.imread(name, cv2.IMREAD_UNCHANGED) for name in sys.argv[2:]]
rehearse()
known = set(sys.modules)
assert all(measurer.measure(picture, PlainRecipe(), 20.0).pixels is not None for picture in pictures)
print(*sorted(set(sys.modules) - known))
"""


def test_a_job_after_it_loads_nothing_more() -> None:
    files = [SAMPLES / "calibration.yaml", *sorted(SAMPLES.glob("*.jpg"))]
    late = subprocess.run([sys.executable, "-c", LATE, *files], check=True, capture_output=True, text=True)
    assert late.stdout.split() == []


def test_a_failure_is_told_and_goes_no_further(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def measure(*_: object) -> None:
        raise MemoryError("none left")

    monkeypatch.setattr(Measurer, "measure", measure)
    with caplog.at_level(logging.WARNING):
        rehearse()
    assert caplog.messages == ["rehearsal: MemoryError: none left"]
