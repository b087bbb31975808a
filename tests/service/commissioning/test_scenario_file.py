"""Scenario files: the examples are loaded, and every mistake is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.controller.simulated.faults import LineFault
from drivers.controller.simulated.scenario import EVENT_KINDS, Event, MachineSettings
from service.commissioning.scenario_file import load_scenario
from service.commissioning.scenario_reference import with_tables
from service.config.config_file import ConfigError

REFERENCE = Path(__file__).parents[3] / "docs" / "reference"
EXAMPLES = sorted((REFERENCE / "scenarios").glob("*.yaml"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_every_example_is_loaded_and_told_of(example: Path) -> None:
    scenario = load_scenario(example)
    assert scenario.events
    assert example.name in (REFERENCE / "simulated-controller.md").read_text()
    assert example.read_text().startswith("# ")


def test_the_examples_show_every_event_and_the_faults_that_were_asked_for() -> None:
    scenarios = [load_scenario(example) for example in EXAMPLES]
    shown = {event.do for scenario in scenarios for event in scenario.events}
    assert set(EVENT_KINDS) - shown <= {"machine-fault", "foreign-service"}
    faults = [fault for scenario in scenarios for fault in scenario.faults]
    wanted = {"lost-request", "lost-reply", "late-reply", "repeated-reply", "garbled-reply", "half-open", "late-write"}
    assert wanted <= {fault.kind for fault in faults}
    assert {fault.code for fault in faults if fault.kind == "exception"} == {2, 3, 4, 5, 6}


def load(tmp_path: Path, text: str):
    path = tmp_path / "scenario.yaml"
    path.write_text(text)
    return load_scenario(path)


def test_what_stands_in_the_file_is_what_is_played(tmp_path: Path) -> None:
    scenario = load(
        tmp_path,
        "seed: 5\nmachine: {scan_ms: 20, clock: false, sessions: [7, 8]}\n"
        "events: [{do: refuse, at_s: [1, 2.5], answer: 4, count: 3}]\n"
        "faults: [{fault: exception, request: commit, every: 3, code: 6, after_s: 1, before_s: 9}]\n",
    )
    assert scenario.seed == 5
    assert scenario.machine == MachineSettings(scan_ms=20, clock=False, sessions=(7, 8))
    assert scenario.events == (Event("refuse", at_s=(1.0, 2.5), answer=4, count=3),)
    assert scenario.faults == (LineFault("exception", "commit", every=3, code=6, after_s=1.0, before_s=9.0),)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is empty, expected keys such as"),
        ("[]", "holds a list"),
        ("evnts: []", "evnts: unknown key; did you mean events?"),
        ("faults: [{fault: lost-repply, chance: 1}]", r"faults\[0\].fault: seen 'lost-repply'"),
        ("faults: [{fault: lost-reply}]", "strikes no request, expected chance, every or at"),
        ("faults: [{fault: lost-reply, chance: 2}]", r"faults\[0\].chance: seen 2"),
        ("faults: [{fault: lost-reply, chance: 1, request: everything}]", r"faults\[0\].request: seen 'everything'"),
        ("faults: [{fault: lost-reply, chance: 1, code: 5}]", "code is of fault: exception"),
        ("faults: [{fault: exception, chance: 1, code: 7}]", r"faults\[0\].code: seen 7"),
        ("faults: [{fault: lost-reply, chance: 1, after_s: 5, before_s: 5}]", "expected more than after_s"),
        ("events: [{do: trigger}]", "trigger never happens, expected at_s or every_s"),
        ("events: [{do: dance, every_s: 1}]", r"events\[0\].do: seen 'dance'"),
        ("events: [{do: refuse, every_s: 1, answer: 5}]", r"events\[0\].answer: seen 5"),
        ("events: [{do: busy, every_s: 9, answer: 7}]", "answer is of do: refuse, seen with busy"),
        ("events: [{do: restart, at_s: [1], for_s: 2}]", "for_s is of do: busy, .*, seen with restart"),
        ("machine: {scan_ms: 0}", "machine.scan_ms: seen 0"),
        ("machine: {clock: 1.5}", "machine.clock"),
        ("machine: {sessions: [0]}", r"machine.sessions\[0\]: seen 0"),
        ("seed: yes", "seed: seen true, as yes and on are read, expected a whole number"),
        ("a: [", "line 1"),
    ],
)
def test_each_mistake_is_told_with_its_place(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told) as error:
        load(tmp_path, text)
    assert "scenario.yaml" in str(error.value)


def test_a_file_that_is_not_there_names_the_option(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--scenario"):
        load_scenario(tmp_path / "none.yaml")


def test_the_tables_of_the_page_are_fresh() -> None:
    page = (REFERENCE / "simulated-controller.md").read_text()
    assert page == with_tables(page), (
        "run python -m service.commissioning.scenario_reference docs/reference/simulated-controller.md"
    )
