"""SIGTERM in each stage of a job: what can end in time ends properly, what cannot is settled by the next start."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import jobs, lines, until
from tests.support.processes.terminal import Terminal

PICTURE = SAMPLES / "1-rectangle.jpg"
NEVER_ANSWERS = "machine: {check_scans: 10000}"  # not within 100 s


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.close()


class Stage:
    """A cell in which a person at `terminal` triggers; pictures are handed over one by one where `by_hand`."""

    def __init__(
        self, folder: Path, terminal: Terminal, *, by_hand: bool = False, scenario: str = "", **more: str
    ) -> None:
        self.terminal = terminal
        self.number = 0
        self.pictures = folder / "pictures"
        self.done = folder / "done"
        for path in (self.pictures, self.done):
            path.mkdir()
        hand = f"{{kind: files, path: {self.pictures}, loop: false, watch: true, timeout_s: 60, move_to: {self.done}}}"
        self.cell = Cell(
            folder,
            triggers=f"[{{kind: serial, port: {terminal.name}}}]",
            trigger_every_s=None,
            camera=hand if by_hand else f"{{kind: files, path: {PICTURE}}}",
            scenario=scenario,
            **more,
        )

    def triggered(self) -> None:
        """A job is begun."""
        self.cell.ready()
        self.terminal.type(b"TRIG\n")
        self.number = self.terminal.acknowledged()

    def hand_over(self) -> None:
        """The picture comes."""
        shutil.copy(PICTURE, self.pictures / "next.tmp")
        (self.pictures / "next.tmp").rename(self.pictures / "next.jpg")

    def terminate(self) -> None:
        """SIGTERM, heard."""
        self.cell.service.send(signal.SIGTERM)
        until(lambda: "-> Halted" in self.cell.service.text, what="Halted")

    def ended(self) -> dict[str, object]:
        """The job, after an orderly end of the daemon."""
        assert self.cell.service.ended() == 0
        assert "Traceback" not in self.cell.service.text
        return self.job()

    def job(self) -> dict[str, object]:
        """The one job."""
        (job,) = jobs(self.cell.journal)
        return job

    def sent(self) -> None:
        """Wait until the job is with the controller, which has not answered."""
        until(lambda: self.job()["pages"] is not None, what="a transfer")
        assert self.job()["outcome"] is None


@pytest.fixture
def made() -> Iterator[list[Stage]]:
    stages: list[Stage] = []
    yield stages
    for stage in stages:
        stage.cell.stop()


def test_while_waiting_it_ends_at_once_and_answers_what_is_typed_no_more(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal))
    stage.cell.ready()
    stage.terminate()
    assert stage.cell.service.ended() == 0
    assert jobs(stage.cell.journal) == []


def test_during_the_frame_the_job_is_accepted_where_the_picture_comes_in_time(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal, by_hand=True))
    stage.triggered()
    stage.terminate()
    terminal.type(b"TRIG\n")
    assert terminal.line() == "NAK 120 busy"
    stage.hand_over()
    assert terminal.line().startswith(f"DONE {stage.number} ")
    assert stage.ended()["outcome"] == "accepted"
    assert [contour["job_id"] for contour in lines(stage.cell.accepted)] == [stage.number]


def test_during_the_frame_the_job_is_aborted_where_no_picture_comes(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal, by_hand=True))
    stage.triggered()
    stage.terminate()
    job = stage.ended()
    assert (job["outcome"], job["reason"], job["pages"]) == ("failed", 161, None)
    assert lines(stage.cell.accepted) == []


def test_during_tracing_the_job_is_brought_to_its_end(tmp_path: Path, terminal: Terminal, made: list[Stage]) -> None:
    slow = "{number: 1, name: slow, method: sliding-matrix, max_disagreement_pitches: 0, parameters: {step_px: 1}}"
    made.append(stage := Stage(tmp_path, terminal, by_hand=True, more=f"recipes: [{slow}]\n"))
    stage.triggered()
    stage.hand_over()
    until(lambda: list(stage.done.iterdir()), what="the picture, read")
    assert stage.job()["pages"] is None, "not traced yet"
    stage.terminate()
    assert stage.ended()["outcome"] == "accepted"
    assert len(lines(stage.cell.accepted)) == 1


def test_during_the_transfer_the_job_is_accepted_where_the_controller_answers_in_time(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal, scenario="machine: {check_scans: 70}"))
    stage.triggered()
    stage.sent()
    stage.terminate()
    assert stage.ended()["outcome"] == "accepted"
    assert len(lines(stage.cell.accepted)) == 1


def test_during_the_transfer_a_job_that_nobody_decides_stays_in_flight_for_the_next_start(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal, scenario=NEVER_ANSWERS, link=", max_repeats: 100"))
    stage.triggered()
    stage.sent()
    stage.terminate()
    assert stage.ended()["outcome"] is None
    assert f"job {stage.number} stays in flight; the next start settles it" in stage.cell.service.text
    stage.cell.controller.kill()
    stage.cell.scenario = ""
    stage.cell.controller = stage.cell.start_controller()
    stage.cell.service = stage.cell.start_service()
    until(lambda: stage.job()["outcome"], 30, "the settlement")
    assert lines(stage.cell.accepted) == [], "a controller that restarted never accepts the job of before"
    assert (stage.job()["outcome"], stage.job()["reason"]) == ("failed", 153)


@pytest.mark.parametrize("in_time", [True, False])
def test_during_a_withdrawal_only_the_controllers_word_ends_the_job_in_time_or_after_the_next_start(
    tmp_path: Path, terminal: Terminal, made: list[Stage], in_time: bool
) -> None:
    made.append(stage := Stage(tmp_path, terminal, scenario=NEVER_ANSWERS, link=", max_repeats: 1"))
    stage.triggered()
    until(lambda: stage.job()["withdraw_reason"], what="a withdrawal")
    assert stage.job()["outcome"] is None
    stage.terminate()
    if not in_time:
        assert stage.ended()["outcome"] is None
        stage.cell.service = stage.cell.start_service()
        until(lambda: "was in flight when the service ended" in stage.cell.service.text, what="the next start")
    stage.cell.controller.kill()
    stage.cell.scenario = ""
    stage.cell.controller = stage.cell.start_controller()
    until(lambda: stage.job()["outcome"], 30, "the settlement")
    assert (stage.job()["outcome"], stage.job()["reason"]) == ("failed", 153), "its program began a new session"
    if in_time:
        assert stage.cell.service.ended() == 0
    assert lines(stage.cell.accepted) == []


def test_during_a_withdrawal_a_job_that_was_accepted_before_it_is_accepted(
    tmp_path: Path, terminal: Terminal, made: list[Stage]
) -> None:
    made.append(stage := Stage(tmp_path, terminal, scenario="machine: {check_scans: 200}", link=", max_repeats: 1"))
    stage.triggered()
    until(lambda: stage.job()["withdraw_reason"], what="a withdrawal")
    stage.terminate()
    assert stage.ended()["outcome"] == "accepted"
    assert len(lines(stage.cell.accepted)) == 1
