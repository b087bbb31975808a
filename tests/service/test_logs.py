"""The log: one line a record, structured where it counts, floods held back and counted, no secrets."""

from __future__ import annotations

import io
import json
import logging
from collections.abc import Callable
from pathlib import Path

import pytest

from service.jobs.job_log import log_end
from service.logs import BURST, WINDOW_S, Format, LineFormatter, LogHandler, event, journald_reads
from service.reasons import Outcome, Reason
from service.records.job import Job, Terms, TriggerStamp
from service.state import State, StateMachine


class Log:
    """combtrace's loggers, written to a string, by a clock that the test sets."""

    def __init__(self, form: Format = "text", *, under_journald: bool = False) -> None:
        self.now = 0.0
        self.stream = io.StringIO()
        self.handler = LogHandler(self.stream, now=lambda: self.now)
        self.handler.setFormatter(LineFormatter(form, under_journald=under_journald))
        self.logger = logging.getLogger("combtrace")

    @property
    def lines(self) -> list[str]:
        return self.stream.getvalue().splitlines()


@pytest.fixture
def make_log():
    made: list[Log] = []

    def make(form: Format = "text", *, under_journald: bool = False) -> Log:
        log = Log(form, under_journald=under_journald)
        log.logger.addHandler(log.handler)
        log.logger.setLevel(logging.INFO)
        made.append(log)
        return log

    yield make
    for log in made:
        log.logger.removeHandler(log.handler)
        log.handler.close()


JOB = Job(
    418,
    "2026-11-21T06:00:00.000+00:00",
    TriggerStamp("controller", 0, 0, 9, 5),
    outcome=Outcome.ACCEPTED,
    report={
        "vertices": 7,
        "area_mm2": 79203.4,
        "uncertainty_mm": 0.21,
        "timings_ms": {"total": 61.04},
        "total_ms": 80.0,
    },
    terms=Terms({"number": 3}, "sha256:ab"),
)


def test_a_job_is_one_record_with_its_figures(make_log: Callable[..., Log]) -> None:
    log = make_log()
    log_end(log.logger, JOB)
    (line,) = log.lines
    assert line.endswith(
        "job 418 accepted: 7 vertices, 79203 mm² trigger=controller recipe=3 uncertainty_mm=0.21"
        " measure_ms=61.0 total_ms=80.0"
    )


def test_as_json_a_job_and_a_change_of_state_carry_fields(make_log: Callable[..., Log]) -> None:
    log = make_log("json")
    log_end(log.logger, JOB)
    StateMachine().change(State.ERROR, reason="camera silent for 2.0 s", job=418)
    job, state = (json.loads(line) for line in log.lines)
    assert (job["event"], job["job"], job["outcome"], job["recipe"], job["level"]) == (
        "job",
        418,
        "accepted",
        3,
        "info",
    )
    assert (state["event"], state["before"], state["state"]) == ("state", "Preoperational", "Error")
    assert (state["reason"], state["job"], state["level"]) == ("camera silent for 2.0 s", 418, "warning")


def test_under_journald_a_line_begins_with_its_priority(make_log: Callable[..., Log]) -> None:
    log = make_log(under_journald=True)
    log.logger.warning("disk slow")
    try:
        raise ZeroDivisionError("a defect")
    except ZeroDivisionError:
        log.logger.exception("internal error")
    assert log.lines[0] == "<4>combtrace: disk slow"
    assert all(line.startswith("<3>") for line in log.lines[1:])
    assert len(log.lines) > 3


def test_journald_is_known_by_the_stream_that_it_names(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as stream:
        found = (tmp_path / "log").stat()
        assert journald_reads(stream, {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"})
        assert not journald_reads(stream, {"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino + 1}"})
        assert not journald_reads(stream, {})
    assert not journald_reads(io.StringIO(), {"JOURNAL_STREAM": "1:2"})


def test_of_records_alike_some_are_written_and_the_rest_are_counted(make_log: Callable[..., Log]) -> None:
    log = make_log()
    for number in range(100):
        log.logger.warning("serial: not understood: %r", f"noise {number}")
    assert len(log.lines) == BURST
    log.now = WINDOW_S + 1
    log.logger.info("something else")
    assert len(log.lines) == BURST + 2
    assert log.lines[BURST].endswith("held back 95 records like this: serial: not understood: 'noise 99'")


def test_records_that_differ_in_numbers_only_are_alike(make_log: Callable[..., Log]) -> None:
    log = make_log()
    for number in range(20):
        log.logger.warning(f"link: no answer for {number} s")
    assert len(log.lines) == BURST
    log.handler.close()
    assert "held back 15 records" in log.lines[-1], "told at the end too"


def test_jobs_and_states_are_never_held_back(make_log: Callable[..., Log]) -> None:
    log = make_log()
    for _ in range(50):
        log_end(log.logger, JOB)
    assert len(log.lines) == 50


def test_a_flood_of_different_records_is_remembered_within_a_bound(make_log: Callable[..., Log]) -> None:
    log = make_log()
    for number in range(5000):
        log.logger.warning("x" * number)
    assert len(log.handler._kinds) <= 257


@pytest.mark.parametrize("form", ["text", "json"])
def test_secrets_are_not_written(make_log: Callable[..., Log], form: Format) -> None:
    log = make_log(form)
    log.logger.warning("opening rtsp://operator:hunter2@10.0.0.9/stream, password=hunter2 token: 'hunter2'")
    log.logger.info("set", extra=event("config", password="hunter2", where="tcp://a:hunter2@b"))
    try:
        raise ValueError("smb://u:hunter2@host")
    except ValueError:
        log.logger.exception("no")
    assert "hunter2" not in log.stream.getvalue()
    assert "operator" in log.stream.getvalue()


def test_what_a_device_sent_does_not_begin_a_line_of_its_own(make_log: Callable[..., Log]) -> None:
    log = make_log()
    job = Job(
        1, "", TriggerStamp("serial"), outcome=Outcome.FAILED, reason=Reason.NO_FRAME, detail="a\n<0>forged\x1b[2J"
    )
    log_end(log.logger, job)
    (line,) = log.lines
    assert "a\\n<0>forged\\x1b[2J" in line
