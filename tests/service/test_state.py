"""States are OPC 40100-1's, change by one table, and read as a sentence."""

from __future__ import annotations

import logging

import pytest

from service.jobs.health import Fault, Health
from service.reasons import Reason
from service.state import TRANSITIONS, IllegalTransition, State, StateMachine

CAMERA = Fault(Reason.NO_FRAME, "camera silent for 2.0 s")


def started() -> tuple[Health, StateMachine]:
    machine = StateMachine()
    health = Health(machine)
    health.start()
    return health, machine


def test_names_and_numbers_are_those_of_the_register() -> None:
    names = ["Preoperational", "Halted", "Error", "Initialized", "Ready", "SingleExecution", "ContinuousExecution"]
    assert [(state.label, int(state)) for state in State] == list(zip(names, range(1, 8), strict=True))


def test_every_state_can_be_left_and_reached() -> None:
    assert set(TRANSITIONS) == set(State)
    reachable = {State.PREOPERATIONAL}
    while True:
        further = reachable | {target for state in reachable for target in TRANSITIONS[state]}
        if further == reachable:
            break
        reachable = further
    assert reachable == set(State)
    assert all(TRANSITIONS.values())


def test_a_change_that_the_table_does_not_hold_is_an_error() -> None:
    with pytest.raises(IllegalTransition, match="Preoperational -> SingleExecution"):
        StateMachine().change(State.SINGLE_EXECUTION)


def test_a_change_reads_as_a_sentence(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    health, _ = started()
    health.executing(418)
    health.report("camera", CAMERA)
    assert 'state SingleExecution -> Error reason="camera silent for 2.0 s" job=418' in caplog.messages


def test_a_fault_leads_to_error_and_its_end_back_to_ready() -> None:
    health, machine = started()
    assert machine.state is State.READY
    health.report("camera", CAMERA)
    assert (machine.state, machine.reason) == (State.ERROR, "camera silent for 2.0 s")
    health.report("camera", None)
    assert (machine.state, machine.reason) == (State.READY, None)


def test_a_fault_that_ends_during_a_job_leads_back_to_execution() -> None:
    health, machine = started()
    health.executing(7)
    health.report("controller", Fault(Reason.CONTROLLER_LOST, "gone"))
    assert machine.state is State.ERROR
    health.report("controller", None)
    assert machine.state is State.SINGLE_EXECUTION
    health.executing(None)
    assert machine.state is State.READY


def test_of_several_faults_the_one_to_repair_first_is_told() -> None:
    health, machine = started()
    health.report("serial /dev/ttyUSB0", Fault(Reason.NOT_READY, "unplugged"))
    health.report("camera", CAMERA)
    health.report("controller", Fault(Reason.CONTROLLER_LOST, "gone"))
    assert machine.reason == "gone"


def test_halted_is_left_by_no_fault_and_no_job() -> None:
    health, machine = started()
    health.halt("stopped by hand")
    health.report("camera", CAMERA)
    health.executing(3)
    assert machine.state is State.HALTED


def test_faults_before_the_start_do_not_end_preoperational() -> None:
    machine = StateMachine()
    health = Health(machine)
    health.report("camera", CAMERA)
    assert machine.state is State.PREOPERATIONAL
    health.start()
    assert machine.state is State.ERROR
