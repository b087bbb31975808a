"""Remnants are kept of what the controller took, and of nothing else; a list that fails costs no evidence."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.camera import Frame
from service.config.config import RemnantsSettings
from service.reasons import Outcome
from service.records.evidence import Evidence
from service.records.remnants import Remnants
from service.wiring.remnants import remnants_keeper
from tests.support.service.cut_block import measured


class AJob:
    """As much of a job as is asked for."""

    job_id = 7

    def __init__(self, outcome: Outcome) -> None:
        self.outcome = outcome


def evidence(outcome: Outcome) -> Evidence:
    job: Any = AJob(outcome)
    frame = Frame(np.zeros((40, 60), np.uint8), 0.0, True, "a.png", 1)
    return Evidence(job, None, frame=frame, measurement=measured())


@pytest.mark.parametrize(
    ("outcome", "numbers"),
    [(Outcome.ACCEPTED, [1, 2]), (Outcome.WRITTEN, [1, 2]), (Outcome.REFUSED, []), (Outcome.FAILED, [])],
)
def test_only_what_was_taken_leaves_a_remnant(tmp_path: Path, outcome: Outcome, numbers: list[int]) -> None:
    settings = RemnantsSettings(path=tmp_path / "remnants.sqlite")
    keep = remnants_keeper(settings)
    keep(evidence(outcome))
    keep(evidence(outcome))
    keep(replace(evidence(outcome), measurement=None))
    assert [one.number for one in Remnants(settings.path).all()] == numbers
    if numbers:
        assert Remnants(settings.path).picture(1)[:2] == b"\xff\xd8"


def test_a_list_that_cannot_be_written_is_told_and_not_raised(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "remnants.sqlite"
    path.mkdir()
    with caplog.at_level(logging.WARNING):
        remnants_keeper(RemnantsSettings(path=path))(evidence(Outcome.ACCEPTED))
    assert "job 7: its remnants are not kept" in caplog.text
