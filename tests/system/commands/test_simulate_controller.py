"""`combtrace simulate-controller` as a process: scenarios, verdict, events, and what it refuses at the start."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.processes.cell import Cell
from tests.support.processes.processes import Process, called, lines, until

SCENARIOS = Path(__file__).parents[3] / "docs" / "reference" / "scenarios"


def simulate(*arguments: str | Path):
    return called("simulate-controller", "--tcp", "127.0.0.1:0", *arguments)


def test_a_service_keeps_the_protocol_while_commits_are_in_doubt(tmp_path: Path) -> None:
    scenario = tmp_path / "in-doubt.yaml"  # the cell writes one of its own
    scenario.write_text((SCENARIOS / "commit-in-doubt.yaml").read_text().replace("every_s: 1}", "every_s: 0.2}"))
    cell = Cell(tmp_path, trigger_every_s=None)
    cell.controller.stop()
    cell.controller = Process(
        tmp_path / "controller.log",
        *("simulate-controller", "--tcp", f"127.0.0.1:{cell.port}", "--scenario", scenario),
        *("--log", cell.accepted, "--verdict", tmp_path / "verdict.json", "--events", tmp_path / "events.jsonl"),
    )
    try:
        until(lambda: len(lines(cell.accepted)) >= 4, 40, "four accepted jobs")
    finally:
        cell.stop()
    verdict = json.loads((tmp_path / "verdict.json").read_text())
    assert verdict["clean"], verdict["violations"]
    assert verdict["faults"].keys() & {"lost-reply", "late-write"}
    accepted = [contour["job_id"] for contour in lines(cell.accepted)]
    assert len(accepted) == len(set(accepted)) == verdict["accepted"]
    told = {event["event"] for event in lines(tmp_path / "events.jsonl")}
    assert told >= {"session", "event", "trigger", "acknowledged", "answer", "fault"}


@pytest.mark.parametrize("option", ["--verdict", "--log", "--events", "--memory"])
def test_a_path_that_cannot_be_written_is_told_at_the_start(tmp_path: Path, option: str) -> None:
    done = simulate(option, tmp_path / "nowhere" / "file.json")
    assert done.returncode == 2
    assert f"{option.removeprefix('--')} {tmp_path}/nowhere/file.json: cannot be written" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_scenario_with_a_mistake_is_told_with_its_place(tmp_path: Path) -> None:
    (tmp_path / "scenario.yaml").write_text("faults: [{fault: lost-reply, chance: 7}]\n")
    done = simulate("--scenario", tmp_path / "scenario.yaml")
    assert done.returncode == 2
    assert "faults[0].chance: seen 7" in done.stderr


def test_the_verdict_is_there_from_the_start_and_survives_a_kill(tmp_path: Path) -> None:
    verdict = tmp_path / "verdict.json"
    process = Process(tmp_path / "log", "simulate-controller", "--rtu-over-tcp", "127.0.0.1:0", "--verdict", verdict)
    until(lambda: "simulated controller on 127.0.0.1:" in process.text, what="the line that says where")
    process.kill()
    assert json.loads(verdict.read_text())["clean"]


def test_the_schema_of_a_scenario_is_printed() -> None:
    done = called("schema", "--scenario")
    assert done.returncode == 0
    assert set(json.loads(done.stdout)["properties"]) == {"seed", "machine", "events", "faults"}
