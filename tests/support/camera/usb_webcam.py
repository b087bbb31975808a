"""A webcam of the USB Video Class, to be plugged into the kernel: `uvcvideo` drives it as it drives a shop's camera.

It has Motion-JPEG and YUYV, exposure with an automatic, gain with none, and a serial number. Its frames are exposed,
then read out, then sent; what each shows and when it was exposed is known to the test. Descriptors and requests: USB
Device Class Definition for Video Devices 1.1.
"""

from __future__ import annotations

import queue
import struct
import threading
import time
from collections.abc import Callable

from tests.support.camera.usb_over_ip import Setup, UsbDevice

WIDTH, HEIGHT = 320, 240
RATES = (30, 10)
SERIAL = "CT-0042"
MJPG, YUYV = 1, 2
ENDPOINT = 0x81
PAYLOAD = 16384  # bytes of one transfer, its header among them
SET_CUR, GET_CUR, GET_MIN, GET_MAX, GET_RES, GET_LEN, GET_INFO, GET_DEF = 1, *range(0x81, 0x88)
TERMINAL, UNIT = 1, 2
MANUAL, AUTOMATIC = 1, 8  # of the exposure: aperture priority is the automatic that webcams have
YUY2_GUID = b"YUY2\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71"

Encode = Callable[[int], tuple[bytes, bool]]


class Webcam:
    """A webcam that sends what `encode` gives, for the chosen format, when a frame's exposure begins: its bytes, and
    whether the camera flags it as damaged. A frame is exposed for one period and sent at the end of it.

    lag_s: how much later it is sent, as by a camera that reads out slowly or packs; the host cannot see that.
    """

    def __init__(self, encode: Encode, *, lag_s: float = 0.0) -> None:
        self.encode = encode
        self.lag_s = lag_s
        self.silent = False
        self.late_s = 0.0  # the latest that a frame was sent after its time: an emulated processor is slow at times
        self.controls = {
            (TERMINAL, 0x02): [1, AUTOMATIC, MANUAL, AUTOMATIC, MANUAL | AUTOMATIC],
            (TERMINAL, 0x04): [4, 333, 1, 5000, 1],  # exposure in 0.1 ms: length, now, least, most, step
            (UNIT, 0x04): [2, 10, 0, 100, 1],  # gain
        }
        self.defaults = {key: values[1] for key, values in self.controls.items()}
        self.chosen = self._agreed(MJPG, 10_000_000 // RATES[0])
        self._device = UsbDevice(self._control)
        self._streaming = threading.Event()
        self._exposed: queue.Queue[tuple[float, bytes, bool]] = queue.Queue()

    def plug_in(self) -> None:
        """Plug it in, with the settings of its power-up."""
        for key, value in self.defaults.items():
            self.controls[key][1] = value
        self._device.plug_in()
        for part in (self._expose, self._send):
            threading.Thread(target=part, daemon=True).start()

    def pull_out(self) -> None:
        """Pull it out."""
        self._streaming.clear()
        self._device.pull_out()

    # --- its picture -----------------------------------------------------------------------------------------------

    def _expose(self) -> None:
        begins_s = 0.0
        while self._device.is_plugged_in:
            if not self._streaming.wait(0.05):
                continue
            period_s = struct.unpack_from("<I", self.chosen, 4)[0] / 1e7
            begins_s = max(begins_s + period_s, time.monotonic())
            time.sleep(max(begins_s - time.monotonic(), 0))
            data, damaged = self.encode(self.chosen[2])
            self._exposed.put((begins_s + period_s + self.lag_s, data, damaged))

    def _send(self) -> None:
        toggle, step = 0, PAYLOAD - 2
        while self._device.is_plugged_in:
            try:
                at_s, data, damaged = self._exposed.get(timeout=0.05)
            except queue.Empty:
                continue
            time.sleep(max(at_s - time.monotonic(), 0))
            if self.silent or not self._streaming.is_set():
                continue
            toggle ^= 1
            self.late_s = max(self.late_s, time.monotonic() - at_s)
            for start in range(0, len(data), step):
                last = start + step >= len(data)
                flags = 0x80 | toggle | (2 if last else 0) | (0x40 if damaged else 0)
                if not self._device.give(bytes([2, flags]) + data[start : start + step]):
                    break  # the host no longer reads

    # --- its control endpoint --------------------------------------------------------------------------------------

    def _control(self, setup: Setup, data: bytes) -> bytes | None:
        if setup.kind & 0x60 == 0x20:
            return self._class_request(setup, data)
        if setup.request == 6:
            return descriptor(setup.value >> 8, setup.value & 0xFF)
        if setup.request == 8:
            return b"\x01"
        if setup.request == 0:
            return b"\x00\x00"
        if setup.request == 1 and setup.kind == 2:  # the host clears the endpoint when it ends the stream
            self._streaming.clear()
        return b""

    def _class_request(self, setup: Setup, data: bytes) -> bytes | None:
        entity, interface, selector = setup.index >> 8, setup.index & 0xFF, setup.value >> 8
        if interface == 1:
            return self._negotiated(selector, setup.request, data)
        if (entity, selector) not in self.controls:
            return None
        values = self.controls[entity, selector]
        size = values[0]
        if setup.request == SET_CUR:
            values[1] = int.from_bytes(data, "little")
            return b""
        if setup.request == GET_LEN:
            return struct.pack("<H", size)
        if setup.request == GET_INFO:
            return b"\x03"
        order = {GET_CUR: 1, GET_MIN: 2, GET_MAX: 3, GET_RES: 4}
        number = self.defaults[entity, selector] if setup.request == GET_DEF else values[order[setup.request]]
        return number.to_bytes(size, "little")

    def _negotiated(self, selector: int, request: int, data: bytes) -> bytes | None:
        if request == SET_CUR:
            kind = data[2] if data[2] in (MJPG, YUYV) else MJPG
            asked = struct.unpack_from("<I", data, 4)[0]
            nearest = min((10_000_000 // rate for rate in RATES), key=lambda interval: abs(interval - asked))
            self.chosen = self._agreed(kind, nearest)
            if selector == 2:  # committed: it begins
                self._streaming.set()
            return b""
        if request == GET_LEN:
            return struct.pack("<H", 34)
        return b"\x03" if request == GET_INFO else self.chosen

    @staticmethod
    def _agreed(kind: int, interval: int) -> bytes:
        size = WIDTH * HEIGHT * 2
        return struct.pack("<HBBIHHHHHIIIBBBB", 1, kind, 1, interval, 0, 0, 0, 0, 0, size, PAYLOAD, 0, 0, 0, 0, 0)


# --- descriptors -----------------------------------------------------------------------------------------------------


def descriptor(kind: int, number: int) -> bytes | None:
    """The device, configuration or string descriptor; None where there is none."""
    if kind == 1:
        return struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0xEF, 2, 1, 64, 0x1209, 1, 0x0100, 1, 2, 3, 1)
    if kind == 2:
        body = _interfaces()
        return struct.pack("<BBHBBBBB", 9, 2, 9 + len(body), 2, 1, 0, 0x80, 250) + body
    if kind == 3:
        text = ["", "combtrace", "Test webcam", SERIAL]
        raw = b"\x09\x04" if number == 0 else text[number].encode("utf-16-le")
        return bytes([2 + len(raw), 3]) + raw
    return None


def _interfaces() -> bytes:
    camera = struct.pack("<BBBBHBBHHHB3s", 18, 0x24, 2, TERMINAL, 0x0201, 0, 0, 0, 0, 0, 3, b"\x0a\0\0")
    unit = struct.pack("<BBBBBHBHBB", 12, 0x24, 5, UNIT, TERMINAL, 0, 2, 0x0200, 0, 0)
    output = struct.pack("<BBBBHBBB", 9, 0x24, 3, 3, 0x0101, 0, UNIT, 0)
    entities = camera + unit + output
    control = struct.pack("<BBBHHIBB", 13, 0x24, 1, 0x0110, 13 + len(entities), 48_000_000, 1, 1) + entities
    jpeg = struct.pack("<BBBBBBBBBBB", 11, 0x24, 6, MJPG, 1, 1, 1, 0, 0, 0, 0) + _frame(7)
    plain = struct.pack("<BBBBB16sBBBBBB", 27, 0x24, 4, YUYV, 1, YUY2_GUID, 16, 1, 0, 0, 0, 0) + _frame(5)
    formats = jpeg + plain
    stream = struct.pack("<BBBBHBBBBBBBBB", 15, 0x24, 1, 2, 15 + len(formats), ENDPOINT, 0, 3, 0, 0, 0, 1, 0, 0)
    return b"".join(
        [
            struct.pack("<BBBBBBBB", 8, 11, 0, 2, 0x0E, 3, 0, 0),
            struct.pack("<BBBBBBBBB", 9, 4, 0, 0, 0, 0x0E, 1, 0, 0),
            control,
            struct.pack("<BBBBBBBBB", 9, 4, 1, 0, 1, 0x0E, 2, 0, 0),
            stream + formats,
            struct.pack("<BBBBHB", 7, 5, ENDPOINT, 2, 512, 0),
        ]
    )


def _frame(kind: int) -> bytes:
    intervals = [10_000_000 // rate for rate in RATES]
    bits = WIDTH * HEIGHT * 16 * RATES[0]
    head = struct.pack("<BBBBBHHIIIIB", 26 + 4 * len(intervals), 0x24, kind, 1, 0, WIDTH, HEIGHT, bits, bits,
                       WIDTH * HEIGHT * 2, intervals[0], len(intervals))  # fmt: skip
    return head + struct.pack(f"<{len(intervals)}I", *intervals)
