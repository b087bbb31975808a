"""The rehearsal goes all the way of a trace, and stops nothing where it fails."""

from __future__ import annotations

import logging

import pytest

from service.config.plain_recipe import PlainRecipe
from service.jobs.rehearsal import drawn_comb, rehearse
from service.measuring.measure import Measurer


def test_its_picture_is_traced_and_judged_to_the_end() -> None:
    measurement = Measurer(None).measure(drawn_comb(), PlainRecipe(), 0.0)
    assert measurement.texts == ()
    assert {"mask", "trace", "quality", "simplify", "judge"} <= set(measurement.timings_ms)


def test_a_failure_is_told_and_goes_no_further(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def measure(*_: object) -> None:
        raise MemoryError("none left")

    monkeypatch.setattr(Measurer, "measure", measure)
    with caplog.at_level(logging.WARNING):
        rehearse()
    assert caplog.messages == ["rehearsal: MemoryError: none left"]
