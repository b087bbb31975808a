"""The serial trigger on real pseudo-terminals."""

from __future__ import annotations

import os
import threading
import tty

import pytest

from drivers.trigger import TriggerUnavailable
from drivers.trigger.serial import SILENCE_ENDS_LINE_S, SerialLineTrigger


class Wire:
    """The far end of a serial line, and the name of the near one."""

    def __init__(self):
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.name = os.ttyname(self._slave)

    def send(self, data):
        while data:
            data = data[os.write(self._master, data) :]

    def receive(self, count):
        data = b""
        while len(data) < count:
            data += os.read(self._master, count - len(data))
        return data

    def unplug(self):
        for descriptor in (self._master, self._slave):
            if descriptor is not None:
                os.close(descriptor)
        self._master = self._slave = None


@pytest.fixture
def wire():
    made = Wire()
    yield made
    made.unplug()


@pytest.fixture
def port(wire):
    opened = SerialLineTrigger(wire.name, 9600)
    opened.open()
    yield opened
    opened.close()


@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n"])
def test_lines_arrive_without_their_ends(wire, port, end):
    wire.send(b"TRIG recipe=3" + end + b"PING" + end)
    assert [port.read_line(5.0), port.read_line(5.0)] == [b"TRIG recipe=3", b"PING"]
    assert port.read_line(0.0) is None


def test_a_line_may_come_in_pieces(wire, port):
    wire.send(b"TR")
    assert port.read_line(0.02) is None
    wire.send(b"IG\r")
    assert port.read_line(5.0) == b"TRIG"


def test_silence_gives_none(port):
    assert port.read_line(0.0) is None
    assert port.read_line(0.02) is None


def test_noise_gives_short_pieces_and_the_line_behind_it(wire, port):
    noise = bytes(byte for byte in os.urandom(3000) + bytes(500) if byte not in b"\r\n")
    wire.send(noise + b"\rPING\r")
    lines = [port.read_line(5.0), port.read_line(5.0)]
    assert lines == [noise[:81], b"PING"]


def test_endless_noise_does_not_hold_a_reader(wire, port):
    stop = threading.Event()

    def babble():
        while not stop.is_set():
            wire.send(b"\x00" * 200)

    talker = threading.Thread(target=babble)
    talker.start()
    try:
        assert port.read_line(0.2) == b"\x00" * 81
        assert port.read_line(0.2) is None
    finally:
        stop.set()
        while talker.is_alive():
            port.read_line(0.01)
        talker.join()


def test_noise_from_long_ago_does_not_spoil_the_next_line(wire):
    clock = [100.0]
    port = SerialLineTrigger(wire.name, 9600, now=lambda: clock[0])
    port.open()
    for noise in (b"\xff", b"x" * 100):
        wire.send(noise)
        port.read_line(0.0)
        clock[0] += SILENCE_ENDS_LINE_S + 1
        wire.send(b"TRIG\r")
        lines = [port.read_line(0.0) for _ in range(3)]
        assert [line for line in lines if line] == [b"TRIG"]
    port.close()


def test_a_reply_goes_out_with_cr_lf(wire, port):
    port.write_line("ACK 7")
    assert wire.receive(7) == b"ACK 7\r\n"


@pytest.mark.parametrize("text", ["two\rlines", "two\nlines", "m²", "bell\a"])
def test_a_text_that_is_no_line_of_ascii_is_the_callers_mistake(port, text):
    with pytest.raises(ValueError, match="no line of printable ASCII"):
        port.write_line(text)


def test_a_peer_that_never_reads_makes_the_port_unavailable(wire):
    port = SerialLineTrigger(wire.name, 9600, write_timeout_s=0.05)
    port.open()

    def fill():
        for _ in range(10_000):
            port.write_line("x" * 80)

    with pytest.raises(TriggerUnavailable, match="was lost"):
        fill()
    with pytest.raises(TriggerUnavailable, match="not open"):
        port.write_line("PONG")
    port.close()


def test_an_unplugged_line_is_an_error_for_reader_and_writer(wire):
    port = SerialLineTrigger(wire.name, 9600)
    port.open()
    wire.unplug()
    with pytest.raises(TriggerUnavailable, match=f"{wire.name}: was lost"):
        port.read_line(5.0)
    port.close()


def test_an_unplugged_line_is_an_error_for_a_writer(wire):
    port = SerialLineTrigger(wire.name, 9600)
    port.open()
    wire.unplug()
    with pytest.raises(TriggerUnavailable, match="was lost"):
        port.write_line("PONG")
    port.close()


def test_unplugging_wakes_a_reader_that_waits(wire, port):
    found = []

    def read():
        try:
            port.read_line(60.0)
        except TriggerUnavailable as error:
            found.append(str(error))

    reader = threading.Thread(target=read)
    reader.start()
    wire.unplug()
    reader.join(30.0)
    assert not reader.is_alive()
    assert "was lost" in found[0]


def test_closing_wakes_a_reader_that_waits(port):
    found = []

    def read():
        try:
            port.read_line(60.0)
        except TriggerUnavailable as error:
            found.append(str(error))

    reader = threading.Thread(target=read)
    reader.start()
    port.close()
    reader.join(30.0)
    assert not reader.is_alive()
    assert "closed" in found[0] or "not open" in found[0]


def test_a_lost_port_opens_again_on_the_line_that_came_back(tmp_path):
    link = tmp_path / "by-id"
    first, second = Wire(), Wire()
    link.symlink_to(first.name)
    port = SerialLineTrigger(str(link), 9600)
    port.open()
    first.unplug()
    with pytest.raises(TriggerUnavailable):
        port.read_line(5.0)
    link.unlink()
    link.symlink_to(second.name)
    port.open()
    second.send(b"PING\r")
    assert port.read_line(5.0) == b"PING"
    port.close()
    second.unplug()


def test_what_was_sent_before_opening_does_not_count(wire):
    wire.send(b"TRIG\r")
    port = SerialLineTrigger(wire.name, 9600)
    port.open()
    assert port.read_line(0.02) is None
    wire.send(b"PING\r")
    assert port.read_line(5.0) == b"PING"
    port.close()


def test_a_port_in_use_is_told_as_such(wire, port):
    with pytest.raises(TriggerUnavailable, match="in use by another program"):
        SerialLineTrigger(wire.name, 9600).open()


@pytest.mark.parametrize("name", ["/dev/nowhere", "/dev/null", "/", "nul\0byte", ""])
def test_a_name_that_is_no_serial_port_is_told(name):
    with pytest.raises(TriggerUnavailable, match="cannot be opened at 9600 baud"):
        SerialLineTrigger(name, 9600).open()


def test_a_device_that_is_no_serial_port_is_told_in_words():
    with pytest.raises(TriggerUnavailable, match=r"/dev/null: cannot be opened at 9600 baud \(it is no serial port\)"):
        SerialLineTrigger("/dev/null", 9600).open()


def test_a_rate_that_the_port_refuses_is_told(wire):
    with pytest.raises(TriggerUnavailable, match="cannot be opened at -1 baud"):
        SerialLineTrigger(wire.name, -1).open()


def test_no_descriptor_is_left_behind(wire):
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        port = SerialLineTrigger(wire.name, 9600)
        port.open()
        port.close()
        with pytest.raises(TriggerUnavailable):
            SerialLineTrigger("/dev/null", 9600).open()
    assert len(os.listdir("/proc/self/fd")) == before
