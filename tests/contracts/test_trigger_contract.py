"""What every line trigger promises. A new driver joins by one entry in LINES."""

from __future__ import annotations

import os
import tty

import pytest

from drivers.trigger import TriggerUnavailable
from drivers.trigger.serial import SerialLineTrigger


class PseudoTerminal:
    """A serial driver on a pseudo-terminal, and the far end of its line."""

    def __init__(self):
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        self.trigger = SerialLineTrigger(os.ttyname(self._near), 9600)

    def send(self, data):
        os.write(self._far, data)

    def received(self):
        return os.read(self._far, 1000)

    def finish(self):
        os.close(self._far)
        os.close(self._near)


LINES = {"serial": PseudoTerminal}


@pytest.fixture(params=LINES.values(), ids=LINES.keys())
def line(request):
    made = request.param()
    yield made
    made.trigger.close()
    made.finish()


def test_a_line_arrives_without_its_end_and_a_reply_goes_out_with_one(line):
    line.trigger.open()
    line.send(b"TRIG\r\n")
    assert line.trigger.read_line(5.0) == b"TRIG"
    line.trigger.write_line("ACK 1")
    assert line.received() == b"ACK 1\r\n"


def test_silence_gives_none(line):
    line.trigger.open()
    assert line.trigger.read_line(0.0) is None


def test_a_closed_line_neither_reads_nor_writes(line):
    for use in (lambda: line.trigger.read_line(0.0), lambda: line.trigger.write_line("PONG")):
        with pytest.raises(TriggerUnavailable, match="not open"):
            use()
    line.trigger.open()
    line.trigger.close()
    with pytest.raises(TriggerUnavailable, match="not open"):
        line.trigger.read_line(0.0)


def test_opening_and_closing_twice_does_nothing_more(line):
    line.trigger.close()
    line.trigger.open()
    line.send(b"PING\r")
    line.trigger.open()
    assert line.trigger.read_line(5.0) == b"PING"
    line.trigger.close()
    line.trigger.close()


def test_a_line_can_be_opened_again_and_begins_afresh(line):
    line.trigger.open()
    line.send(b"TRIG\rSTAT\rhalf a li")
    assert line.trigger.read_line(5.0) == b"TRIG"
    line.trigger.close()
    line.trigger.open()
    line.send(b"PING\r")
    assert line.trigger.read_line(5.0) == b"PING"
