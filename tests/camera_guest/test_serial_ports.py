"""Triggers at ports that a real kernel drives: a UART's inputs, and a USB adapter that is pulled out and put back.

The UART is in loop-back (TIOCM_LOOP): its RTS feeds its own CTS and its DTR its own DSR, behind the driver and in front
of the plug. So what the test does to an output is what a contact does to an input.
"""

from __future__ import annotations

import fcntl
import os
import re
import struct
import subprocess
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivers.trigger.pulses import SerialSignal
from tests.support.camera.daemon import Daemon
from tests.support.camera.vivid import PATIENT_S

UART, CABLE = "/dev/ttyS3", "/dev/ttyS2"
TIOCM_LOOP = 0x8000  # asm-generic/termios.h; Python's termios does not name it
FEEDS = {"cts": termios.TIOCM_RTS, "dsr": termios.TIOCM_DTR}
SAMPLE = Path(__file__).parents[2] / "service" / "samples" / "1-rectangle.jpg"
CONFIG = f"""
camera: {{kind: files, path: {SAMPLE}}}
controller: {{kind: none}}
recipes: [{{number: 1, name: default, thickness_mm: 20, method: find-contours}}]
triggers: [{{kind: serial, %s}}]
"""


class Contact:
    """What is wired to the UART's inputs."""

    def __init__(self) -> None:
        self._port = os.open(UART, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._set(termios.TIOCMBIS, TIOCM_LOOP)

    def close_contact(self, signal: str) -> None:
        """The input is asserted."""
        self._set(termios.TIOCMBIS, FEEDS[signal])

    def open_contact(self, signal: str) -> None:
        """The input is not asserted."""
        self._set(termios.TIOCMBIC, FEEDS[signal])

    def leave(self) -> None:
        """Wire it off."""
        self._set(termios.TIOCMBIC, TIOCM_LOOP)
        os.close(self._port)

    def _set(self, request: int, lines: int) -> None:
        fcntl.ioctl(self._port, request, struct.pack("I", lines))


@pytest.fixture
def contact() -> Iterator[Contact]:
    wired = Contact()
    yield wired
    wired.leave()


def next_pulse(port: SerialSignal) -> bool:
    """Whether a pulse comes within a few waits."""
    return any(port.wait(0.1) for _ in range(600))


@pytest.mark.parametrize("signal", ["cts", "dsr"])
def test_an_edge_of_a_uarts_input_is_a_pulse_and_a_level_is_none(contact: Contact, signal: str) -> None:
    rising = SerialSignal(UART, signal, "rising", 0.02)
    rising.open()  # asserts RTS and DTR: the contact is closed
    assert not rising.wait(0.3), "held down at the start"
    contact.open_contact(signal)
    assert not rising.wait(0.3)
    contact.close_contact(signal)
    assert next_pulse(rising)
    assert not rising.wait(0.3), "one edge, one pulse"
    contact.open_contact("dsr" if signal == "cts" else "cts")
    assert not rising.wait(0.3), "the other input"
    rising.close()


def test_a_level_that_does_not_hold_is_no_pulse(contact: Contact) -> None:
    port = SerialSignal(UART, "cts", "falling", 0.5)
    port.open()
    assert not port.wait(0.8), "the level at the opening, until it has held"
    for _ in range(20):
        contact.open_contact("cts")
        assert not port.wait(0.02)
        contact.close_contact("cts")
        assert not port.wait(0.02)
    contact.open_contact("cts")
    assert next_pulse(port)
    port.close()


def test_a_pedal_at_a_uart_begins_a_job_of_the_daemon(tmp_path: Path, contact: Contact) -> None:
    daemon = Daemon(tmp_path, CONFIG % f"port: {UART}, mode: signal, signal: cts, edge: falling")
    try:
        daemon.wait_for("-> Ready")
        time.sleep(2)  # the level at the opening has been seen
        contact.open_contact("cts")
        daemon.wait_for(r"job 1 (refused|written).* trigger=signal")
        contact.close_contact("cts")
        time.sleep(2)
        contact.open_contact("cts")
        daemon.wait_for(r"job 2 (refused|written).* trigger=signal")
    finally:
        daemon.stop()


# --- a USB adapter ---------------------------------------------------------------------------------------------------


class Adapter:
    """The FTDI adapter of the guest: by the kernel's own switch it is pulled out and put back."""

    def __init__(self) -> None:
        for module in ("xhci_pci", "ftdi_sio"):
            subprocess.run(["/bin/busybox", "modprobe", module], check=True)
        self.port()
        (self._authorized,) = (
            path.parent / "authorized"
            for path in Path("/sys/bus/usb/devices").glob("*/idVendor")
            if path.read_text().strip() == "0403"
        )

    def port(self, bound_s: float = PATIENT_S) -> Path:
        """Its device, once it is there; the number may change from one time to the next."""
        give_up_at = time.monotonic() + bound_s
        while not (found := list(Path("/dev").glob("ttyUSB*"))):
            assert time.monotonic() < give_up_at, "no adapter"
            time.sleep(0.05)
        return found[0]

    def unplug(self) -> None:
        self._authorized.write_text("0")

    def plug_in(self) -> Path:
        self._authorized.write_text("1")
        return self.port()


class FarEnd:
    """Who types at the other end of the cable."""

    def __init__(self) -> None:
        self._port = os.open(CABLE, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._port)
        self._heard = b""

    def type(self, text: bytes) -> None:
        os.write(self._port, text)

    def hear(self, pattern: bytes, bound_s: float = PATIENT_S) -> None:
        """Wait for it."""
        give_up_at = time.monotonic() + bound_s
        while not re.search(pattern, self._heard):
            assert time.monotonic() < give_up_at, self._heard
            try:
                self._heard += os.read(self._port, 4096)
            except BlockingIOError:
                time.sleep(0.05)

    def close(self) -> None:
        os.close(self._port)


@contextmanager
def far_end() -> Iterator[FarEnd]:
    made = FarEnd()
    try:
        yield made
    finally:
        made.close()


def test_a_usb_adapter_that_is_pulled_out_leads_to_error_and_put_back_to_ready_again(tmp_path: Path) -> None:
    adapter = Adapter()
    name = tmp_path / "by-id"  # what udev would keep below /dev/serial/by-id
    name.symlink_to(adapter.port())
    daemon = Daemon(tmp_path, CONFIG % f"port: {name}, mode: text")
    try:
        with far_end() as panel:
            daemon.wait_for("-> Ready")
            panel.type(b"TRIG\n")
            panel.hear(rb"ACK 1\r?\n(.*\n)*?(DONE|FAIL) 1 ")
            adapter.unplug()
            lost = daemon.wait_for(rf"-> Error reason=\S?{name}")
            name.unlink()
            daemon.wait_for("No such file", after=lost.start())
            name.symlink_to(adapter.plug_in())
            daemon.wait_for("-> Ready", after=lost.end())
            panel.type(b"TRIG\n")
            panel.hear(rb"ACK 2\r?\n(.*\n)*?(DONE|FAIL) 2 ")
    finally:
        daemon.stop()
    assert "Traceback" not in daemon.said()
