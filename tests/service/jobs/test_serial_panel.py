"""A panel at the serial line: which end is its own, and how long it waits for it. Time is the test's."""

from __future__ import annotations

import pytest

from service.jobs.serial_panel import ANSWER_WITHIN_S, GONE_AFTER_S, NoEnd, ask


class Line:
    """Says lines at their times; answers PING where the daemon lives by then."""

    def __init__(self, *said: tuple[float, str], lives: tuple[float, float] = (0, 1e9)) -> None:
        self.time = 0.0
        self._said = list(said)
        self._lives = lives
        self.asked: list[str] = []

    def open(self) -> None:
        pass

    def close(self) -> None:
        pass

    def write_line(self, text: str) -> None:
        self.asked.append(text)
        if text == "PING" and self._lives[0] <= self.time < self._lives[1]:
            self._said.insert(0, (self.time, "PONG"))

    def read_line(self, timeout_s: float) -> bytes | None:
        if self._said and self._said[0][0] <= self.time + timeout_s:
            self.time = max(self.time, self._said[0][0])
            return self._said.pop(0)[1].encode()
        self.time += timeout_s
        return None


def asked(line: Line, timeout_s: float = 130.0) -> tuple[str, list[str]]:
    told: list[str] = []
    return ask(line, None, timeout_s, told.append, lambda: line.time), told


def test_the_end_of_its_own_job_ends_it() -> None:
    assert asked(Line((0.1, "ACK 19"), (3, "DONE 19 4 5000"))) == ("DONE 19 4 5000", ["ACK 19", "DONE 19 4 5000"])
    assert asked(Line((0.1, "NAK 120 busy"))) == ("NAK 120 busy", ["NAK 120 busy"])


def test_the_end_that_comes_after_a_minute_without_the_daemon_is_heard() -> None:
    line = Line((0.1, "ACK 19"), (50, "FAIL 19 154 service_restarted"), lives=(45, 1e9))
    assert asked(line)[0] == "FAIL 19 154 service_restarted"


def test_ends_of_other_jobs_and_others_triggers_end_nothing() -> None:
    line = Line((0.1, "DONE 18 4 5000"), (0.2, "ACK 19"), (0.3, "FAIL 1 154 service_restarted"), (5, "DONE 19 4 5000"))
    assert asked(line)[0] == "DONE 19 4 5000"


def test_a_trigger_that_nobody_acknowledges_is_given_up_soon_though_an_older_end_is_told() -> None:
    line = Line((2, "DONE 18 4 5000"))
    with pytest.raises(NoEnd, match=r"no ACK within 10 s"):
        asked(line)
    assert line.time == pytest.approx(ANSWER_WITHIN_S, abs=1)


def test_a_daemon_that_never_comes_back_is_given_up_after_a_stated_silence() -> None:
    line = Line((1.0, "ACK 19"), lives=(0, 1))
    with pytest.raises(NoEnd, match=r"job 19: the daemon has been silent for 60 s.*combtrace jobs show 19"):
        asked(line)
    assert line.time == pytest.approx(1 + GONE_AFTER_S, abs=5)


def test_a_daemon_that_lives_is_waited_for_until_the_timeout() -> None:
    line = Line((1.0, "ACK 19"))
    with pytest.raises(NoEnd, match=r"job 19 has not ended within 130 s"):
        asked(line)
    assert line.time == pytest.approx(130, abs=1)
    line = Line((1.0, "WAIT 1"))
    with pytest.raises(NoEnd, match=r"the trigger that waits has not ended within 20 s"):
        asked(line, 20)
    with pytest.raises(NoEnd, match=r"no ACK within 3 s"):
        asked(Line(), 3)
