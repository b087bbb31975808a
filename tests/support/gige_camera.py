"""A GigE Vision camera on loopback: Aravis' fake, which answers real GVCP and GVSP, serving pictures of ours.

`python -m tests.support.gige_camera --serial S --pictures FILE.npy` hosts one until its standard input ends; FILE holds
the bytes of its frames, (N, bytes). Tests use `GigeCamera`, which runs that as a process, as a camera that is killed is
to be a process that is killed. One camera can be on loopback at a time, as each listens on GVCP's port.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from drivers.camera import CameraRefused
from drivers.camera.genicam.binding import INSTALL, aravis
from tests.support.real_parts import missing

ROOT = Path(__file__).resolve().parents[2]
READY_S = 120.0
WIDTH, TRIGGER_SOFTWARE, USER_NAME = 0x100, 0x30C, 0x00E8
# Value of PixelFormat: GenICam's Pixel Format Naming Convention.
EXTRA_FORMATS = {
    "Mono10": 0x01100003,
    "Mono12": 0x01100005,
    "Mono10Packed": 0x010C0004,
    "Mono12Packed": 0x010C0006,
    "Mono10p": 0x010A0046,
    "Mono12p": 0x010C0047,
    "BayerRG10": 0x0110000D,
    "BayerRG12": 0x01100011,
    "BayerRG12Packed": 0x010C002B,
    "BayerRG12p": 0x010C0059,
}
EXTRA_CHOICES = {  # an enumeration's entries, and where its value lies
    "BalanceWhiteAuto": (("Off", "Continuous"), 0x400),
    "BalanceRatioSelector": (("Red", "Green", "Blue"), 0x404),
    "LineSelector": (("Line1", "Line2"), 0x408),
    "LineMode": (("Input", "Output"), 0x440),
    "LineSource": (("Off", "ExposureActive"), 0x460),
}
EXTRA_NUMBERS = {"BlackLevelRaw": 0x40C, "BalanceRatioRaw": 0x420}  # 0 to 255
SELECTED = {"BalanceRatioRaw": "BalanceRatioSelector", "LineMode": "LineSelector", "LineSource": "LineSelector"}


def need_aravis():
    """Skip the test where Aravis is not installed; fail it where everything must be."""
    try:
        aravis()
    except CameraRefused as error:
        missing(f"{error} Install it: {INSTALL}")


@pytest.fixture(scope="module", autouse=True)
def aravis_is_loaded():
    """What Aravis opens once and for all, of USB's, is no test's to close."""
    with contextlib.suppress(CameraRefused):
        aravis().update_device_list()


class GigeCamera:
    """The process that hosts the camera, and its wires. pictures: (N, bytes) uint8, served in turn for ever."""

    def __init__(self, folder, pictures, *, serial="GV7", line=False, loss=0.0):
        self._folder, self._serial, self._line, self.loss = Path(folder), serial, line, loss
        np.save(self._folder / "pictures.npy", np.asarray(pictures, np.uint8).reshape(len(pictures), -1))
        self._process = None
        self._place = _take_the_port()

    def start(self):
        """Switch it on; it answers when this returns."""
        command = [
            sys.executable,
            "-m",
            "tests.support.gige_camera",
            "--serial",
            self._serial,
            "--folder",
            self._folder,
        ]
        command += ["--loss", str(self.loss), *(["--line"] if self._line else [])]
        self._process = subprocess.Popen(
            [str(part) for part in command], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        readable, _, _ = select.select([self._process.stdout], [], [], READY_S)
        said = self._process.stdout.readline() if readable else ""
        assert said == "ready\n", f"the camera does not start: {said!r}"
        return self

    def tell(self, word):
        """`edge`: the line's edge. `loss R`: lose a share of packets. `width W`: send frames that nobody asked for."""
        assert self._asked(word) == "done\n"

    def made(self):
        """How many frames it has exposed since it was switched on."""
        return int(self._asked("made"))

    def at(self, place):
        """What the register at this place holds."""
        return int(self._asked(f"at {place}"))

    def _asked(self, line):
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()
        return self._process.stdout.readline()

    def kill(self):
        """Pull its plug."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def freeze(self):
        """Its processor hangs: the port stays, nothing answers."""
        self._process.send_signal(signal.SIGSTOP)

    def close(self):
        """Away with it, and let another test have the port."""
        self.kill()
        self._place.close()

    def __enter__(self):
        try:
            return self.start()
        except BaseException:
            self.close()
            raise

    def __exit__(self, *_):
        self.close()


def _take_the_port():
    """Wait until no other test has a camera on loopback: the name is the kernel's, and goes with the process."""
    place = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    give_up_at = time.monotonic() + 600
    while True:
        with contextlib.suppress(OSError):
            place.bind("\0combtrace-test-gige")
            return place
        assert time.monotonic() < give_up_at, "another test keeps the GigE camera's port"
        time.sleep(0.1)


def started_at_s(frame):
    """When the camera began to expose it, on the monotonic clock: it writes that into the first eight bytes."""
    return struct.unpack("<q", np.ascontiguousarray(frame.pixels).tobytes()[:8])[0] / 1e9


# --- the host ---------------------------------------------------------------------------------------------------------


def description(line):
    """Aravis' own description of its fake, with the pixel formats and trigger line of a camera that has them."""
    text = aravis().FakeCamera.new("X").get_genicam_xml()
    text = text[0] if isinstance(text, tuple) else text
    text = text[: text.index("</RegisterDescription>")] + "</RegisterDescription>"
    entries = "".join(
        f'<EnumEntry Name="{name}" NameSpace="Standard"><Value>{value}</Value></EnumEntry>'
        for name, value in EXTRA_FORMATS.items()
    )
    text = text.replace("<pValue>PixelFormatRegister</pValue>", entries + "<pValue>PixelFormatRegister</pValue>")
    more = more_features()
    listed = "".join(f"<pFeature>{name}</pFeature>" for name in ("TestBoolean", *more))
    text = text.replace("<pFeature>TestRegister</pFeature>", "<pFeature>TestRegister</pFeature>" + listed)
    text = text.replace("</RegisterDescription>", "".join(more.values()) + "</RegisterDescription>")
    if line:  # the fake exposes on the register of its software trigger alone, which is this line here
        text = re.sub(r'<EnumEntry Name="Line0".*?</EnumEntry>', "", text, flags=re.DOTALL)
        text = text.replace('<EnumEntry Name="Software"', '<EnumEntry Name="Line0"')
    return text


def more_features():
    """Descriptions of what cells set and the fake has not, by name: black level, white balance, a line for a strobe."""
    places = {name: place for name, (_, place) in EXTRA_CHOICES.items()} | EXTRA_NUMBERS
    described = {name: f'<Integer Name="{name}"><pValue>{name}At</pValue><Max>255</Max></Integer>' for name in places}
    for name, (entries, _) in EXTRA_CHOICES.items():
        values = "".join(
            f'<EnumEntry Name="{entry}"><Value>{value}</Value></EnumEntry>' for value, entry in enumerate(entries)
        )
        described[name] = f'<Enumeration Name="{name}">{values}<pValue>{name}At</pValue></Enumeration>'
    for name, place in places.items():
        index = f'<pIndex Offset="4">{SELECTED[name]}At</pIndex>' if name in SELECTED else ""
        described[name] += (
            f'<IntReg Name="{name}At"><Address>{place}</Address>{index}<Length>4</Length><AccessMode>RW</AccessMode>'
            "<pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>"
        )
    return described


def host(args):
    """Be the camera."""
    library = ctypes.CDLL("libaravis-0.8.so.0")
    library.arv_buffer_get_data.restype = ctypes.c_void_p
    library.arv_buffer_get_data.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
    for name in ("width", "height"):
        getter = getattr(library, f"arv_buffer_get_image_{name}")
        getter.restype, getter.argtypes = ctypes.c_int, [ctypes.c_void_p]
    fill_type = ctypes.CFUNCTYPE(
        None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32
    )
    pictures = np.load(args.folder / "pictures.npy")
    count = 0

    @fill_type
    def fill(buffer, _data, exposure_us, _gain, pixel_format):
        nonlocal count
        began_ns = time.monotonic_ns()
        picture = pictures[count % len(pictures)]
        count += 1
        pixels = library.arv_buffer_get_image_width(buffer) * library.arv_buffer_get_image_height(buffer)
        size = min(picture.size, pixels * (pixel_format >> 16 & 0xFF) // 8)
        data = library.arv_buffer_get_data(buffer, None)
        ctypes.memmove(data, picture.ctypes.data, size)
        ctypes.memmove(data, struct.pack("<q", began_ns), 8 if args.mark else 0)
        time.sleep(exposure_us * 1e-6)

    xml = args.folder / "camera.xml"
    xml.write_text(description(args.line))
    camera = aravis().GvFakeCamera.new_full("127.0.0.1", args.serial, str(xml))
    camera.props.gvsp_lost_ratio = args.loss
    fake = camera.get_fake_camera()
    for place, word in enumerate(struct.unpack(">4I", args.user_name.encode().ljust(16, b"\0"))):
        fake.write_register(USER_NAME + 4 * place, word)
    fake.set_trigger_frequency(1000.0)  # how often it looks for a trigger
    library.arv_fake_camera_set_fill_pattern.argtypes = [ctypes.c_void_p, fill_type, ctypes.c_void_p, ctypes.c_void_p]
    library.arv_fake_camera_set_fill_pattern(hash(fake), fill, None, None)
    print("ready" if camera.is_running() else "the port is taken", flush=True)
    for command in sys.stdin:
        word, _, value = command.partition(" ")
        if word.strip() == "edge":
            fake.write_register(TRIGGER_SOFTWARE, 1)
        elif word == "width":
            fake.write_register(WIDTH, int(value))
        elif word == "at":
            print(fake.read_register(int(value))[1], flush=True)
            continue
        elif word.strip() == "made":
            print(count, flush=True)
            continue
        else:
            camera.props.gvsp_lost_ratio = float(value)
        print("done", flush=True)


def main():
    """The program."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--serial", required=True)
    parser.add_argument("--user-name", default="over table 2")
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--loss", type=float, default=0.0)
    parser.add_argument("--line", action="store_true")
    parser.add_argument("--mark", type=int, default=1)
    host(parser.parse_args())


if __name__ == "__main__":
    main()
