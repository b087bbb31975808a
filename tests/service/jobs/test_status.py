"""The status line fits the serial line, whatever is the matter."""

from __future__ import annotations

import pytest

from service.jobs.health import Fault, Health
from service.jobs.status import status_line
from service.reasons import Reason
from service.state import State, StateMachine


@pytest.mark.parametrize("reason", list(Reason))
@pytest.mark.parametrize("state", list(State))
def test_the_line_is_ascii_and_has_80_characters_at_most(state: State, reason: Reason) -> None:
    machine = StateMachine()
    machine.state = state
    health = Health(machine)
    health.executing(2**32 - 1)
    health.report("camera", Fault(reason, "ein schöner Grund"))
    line = status_line(health, 2**32 - 1, 65535)
    assert line.isascii()
    assert len(line) <= 80
    assert line.split() == ["STAT", state.label, "4294967295", "4294967295", "65535", str(int(reason)), reason.label]


def test_without_a_fault_the_reason_is_0_ok() -> None:
    health = Health(StateMachine())
    health.start()
    assert status_line(health, 3, 0) == "STAT Ready 0 3 0 0 ok"
