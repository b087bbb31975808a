"""Any byte, or an edge of an input line: on pseudo-terminals, and on a serial server in the network (RFC 2217)."""

from __future__ import annotations

import contextlib
import os
import tty

import pytest

from drivers.trigger import TriggerUnavailable, pulses
from drivers.trigger.pulses import SerialBytes, SerialSignal
from tests.support.controller.serial_over_network import SerialServer

# pyserial's client for RFC 2217 names its thread the old way.
pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name)\\(:DeprecationWarning")


class Line:
    """A pseudo-terminal; what is said comes to the port `name`."""

    def __init__(self):
        self._far, self._near = os.openpty()
        tty.setraw(self._near)
        self.name = os.ttyname(self._near)

    def say(self, data):
        os.write(self._far, data)

    def unplug(self):
        for descriptor in (self._far, self._near):
            os.close(descriptor)


@pytest.fixture
def line():
    made = Line()
    yield made
    with contextlib.suppress(OSError):
        made.unplug()


@pytest.fixture
def server():
    with SerialServer() as made:
        yield made


def next_pulse(port, bound=40):
    """Whether a pulse comes within a few waits."""
    return any(port.wait(0.05) for _ in range(bound))


def test_any_byte_is_a_pulse_a_nul_too_and_what_follows_closely_belongs_to_it(line):
    port = SerialBytes(line.name, 9600, 0.3)
    port.open()
    assert not port.wait(0.0)
    line.say(b"\x00")
    assert port.wait(60.0)
    line.say(b"4006381333931\r\n" * 500)
    assert not port.wait(0.0)
    assert not port.wait(0.4)  # silence
    line.say(b"\xff")
    assert port.wait(60.0)
    port.close()


def test_what_was_sent_before_the_port_was_opened_is_no_pulse(line):
    line.say(b"typed hours ago")
    port = SerialBytes(line.name, 9600, 0.1)
    port.open()
    assert not port.wait(0.0)
    port.close()


def test_a_port_that_was_pulled_out_is_told_and_opens_again_elsewhere(line):
    port = SerialBytes(line.name, 9600, 0.1)
    port.open()
    line.unplug()
    with pytest.raises(TriggerUnavailable, match="was lost"):
        next_pulse(port)
    with pytest.raises(TriggerUnavailable, match="not open"):
        port.wait(0.0)
    with pytest.raises(TriggerUnavailable, match="cannot be opened"):
        port.open()
    port.close()


def test_a_port_without_input_lines_says_so(line):
    port = SerialSignal(line.name, "cts", "rising", 0.01)
    with pytest.raises(TriggerUnavailable, match="CTS cannot be read"):
        port.open()
    port.close()


@pytest.mark.parametrize("signal", ["cts", "dsr"])
def test_an_edge_of_a_line_of_a_serial_server_is_a_pulse(server, signal):
    output = {"cts": "rts", "dsr": "dtr"}[signal]
    setattr(server.device, output, False)
    port = SerialSignal(server.url, signal, "rising", 0.02)
    port.open()  # which asserts both outputs, as pyserial does
    setattr(server.device, output, False)
    assert not port.wait(0.3)
    setattr(server.device, output, True)
    assert next_pulse(port)
    assert not port.wait(0.1), "a level that stays is no second edge"
    port.close()


def test_a_falling_edge_is_one_only_where_it_was_asked_for(server):
    port = SerialSignal(server.url, "cts", "falling", 0.02)
    port.open()
    assert not port.wait(0.2)
    server.device.rts = False
    assert next_pulse(port)
    server.device.rts = True
    assert not port.wait(0.2)
    port.close()


def test_bytes_come_from_a_serial_server_too(server):
    port = SerialBytes(server.url, 9600, 0.1)
    port.open()
    server.say(b"\xff")
    assert next_pulse(port)
    port.close()


def test_a_serial_server_that_hangs_up_is_told_and_comes_back(server):
    port = SerialSignal(server.url, "cts", "falling", 0.02)
    port.open()
    server.hang_up()
    with pytest.raises(TriggerUnavailable, match="was lost"):
        next_pulse(port)
    port.open()
    port.wait(0.1)
    server.device.rts = False
    assert next_pulse(port)
    port.close()


def test_a_serial_server_is_made_to_answer_now_and_then(server, monkeypatch):
    """One that lost its power closes no connection; here it still stands and answers, and RTS stays as it was."""
    monkeypatch.setattr(pulses, "ASK_SERVER_S", 0.0)
    port = SerialSignal(server.url, "cts", "falling", 0.02)
    port.open()
    asked = []
    monkeypatch.setattr(type(server.device), "rts", property(lambda _: True, lambda _, value: asked.append(value)))
    assert not port.wait(0.0)
    assert asked == [True]
    port.close()
