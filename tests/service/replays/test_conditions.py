"""Conditions say what a run fails on, and a mistyped one what was expected."""

from __future__ import annotations

import pytest

from service.replays.errors import ReplayError
from service.replays.report.conditions import condition
from service.replays.report.summary import Summary


@pytest.mark.parametrize(
    ("text", "value", "met"),
    [
        ("flips>0", 0.0, False),
        ("flips>0", 1.0, True),
        ("flips >= 0", 0.0, True),
        ("p99_shift_mm>0.1", 0.1, False),
        ("p99_shift_mm>=1e-1", 0.1, True),
        ("left_out>0", None, True),
    ],
)
def test_a_condition_is_met_beyond_its_limit_or_where_nothing_can_be_told(
    text: str, value: float | None, met: bool
) -> None:
    one = condition(text)
    assert one.met({**Summary().figures(), one.name: value}) is met


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("flip>0", "did you mean flips"),
        ("colour>0", "there are jobs, left_out"),
        ("", "is no figure of a run"),
        ("flips", "expected flips>NUMBER"),
        ("flips<3", "expected flips>NUMBER"),
        ("flips>>3", "expected flips>NUMBER"),
        ("flips>many", "'many' is no number"),
        ("flips>", "'' is no number"),
        ("flips>-1", "'-1' is no number from 0 on"),
        ("p99_shift_mm>nan", "'nan' is no number"),
        ("p99_shift_mm>0.1mm", "'0.1mm' is no number"),
    ],
)
def test_a_mistyped_condition_is_refused_with_what_was_expected(text: str, told: str) -> None:
    with pytest.raises(ReplayError) as refused:
        condition(text)
    assert told in str(refused.value)
    assert str(refused.value).startswith(f"--fail-on {text}: ")
