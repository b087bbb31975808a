"""What a trigger gets from a V4L2 camera: our driver beside OpenCV's, and beside the kernel tools' own frame rate.

Runs on the kernel's virtual camera, in the guest that `make bench-camera` boots, all in one run. Prints Markdown.
`python -m benchmarks.cameras [--frames N] [PART...]` measures only those parts:
triggers, stale, usb, trouble, rate, endurance.
The guest's processor is emulated: pixel conversions take many times longer there, so pictures come as BGR, which are
only copied.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2

from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings

DEVICE = "/dev/video0"
BLACK, WHITE = 5, 6
TRIGGERS = 40


def ctl(*arguments: str) -> str:
    """What v4l2-ctl prints; some of it goes to standard error."""
    done = subprocess.run(["v4l2-ctl", "-d", DEVICE, *arguments], capture_output=True, text=True, check=True)
    return done.stdout + done.stderr


def ours(**changes: object) -> V4l2Camera:
    """Our driver on the webcam input, 640 x 360 at 30 frames a second."""
    settings: dict[str, object] = {
        "device": DEVICE, "width": 640, "height": 360, "frame_rate": 30.0, "input": 0, "exposure_s": 0.0,
        "pixel_format": "BGR3",
    }  # fmt: skip
    return V4l2Camera(V4l2Settings(**settings | changes))  # type: ignore[arg-type]


def main() -> int:
    """Measure and print."""
    parts: dict[str, Callable[[], Iterator[tuple[str, str, str]]]] = {
        "triggers": trigger_rows,
        "stale": stale_rows,
        "usb": usb_rows,
        "trouble": trouble_rows,
        "rate": rate_rows,
        "endurance": lambda: endurance_rows(args.frames),
    }
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=3000, help="how many in a row for memory's growth")
    parser.add_argument(
        "part", nargs="*", choices=[*parts, []], metavar="PART", help="what to measure; all where none is named"
    )
    args = parser.parse_args()
    ctl("-i", "0", "-c", "osd_text_mode=2")
    print("| what | ours | beside it |\n|---|---|---|")
    for name in args.part or parts:
        for row in parts[name]():
            print("| " + " | ".join(row) + " |", flush=True)
    return 0


def trigger_rows() -> Iterator[tuple[str, str, str]]:
    """From trigger to frame in hand, in frame periods, triggers at random instants.

    The driver paints each picture between its stamp and handing it out, on an emulated processor: small pictures.
    """
    for source, name, bound in ((0, "end of frame", 2.2), (1, "start of exposure", 1.2)):
        ctl("-c", f"timestamp_source={source}")
        camera = ours(width=320, height=180)
        camera.open()
        assert camera.opened is not None
        assert camera.opened.period_s is not None
        periods: list[float] = []
        until_exposed: list[float] = []
        for number in range(TRIGGERS):
            time.sleep(0.1 + 0.033 * (number * 0.618 % 1))
            asked_s = time.monotonic()
            frame = camera.grab(asked_s, 5.0)
            periods.append((time.monotonic() - asked_s) / camera.opened.period_s)
            until_exposed.append((frame.exposed_at_s - asked_s) / camera.opened.period_s)
        camera.close()
        text = (
            f"median {statistics.median(periods):.2f}, worst {max(periods):.2f}; "
            f"until it was exposed: worst {max(until_exposed):.2f}"
        )
        yield f"trigger to frame, stamps of the {name}, periods", text, f"bound {bound}"
    ctl("-c", "timestamp_source=0")


def stale_rows() -> Iterator[tuple[str, str, str]]:
    """Frames of before the trigger that are handed out as new after 3 s of idling."""

    def stale(read: Callable[[], float]) -> int:
        ctl("-c", f"test_pattern={BLACK}")
        read()
        time.sleep(3)
        ctl("-c", f"test_pattern={WHITE}")
        return sum(read() < 128 for _ in range(8))

    camera = ours(pixel_format="GREY")
    camera.open()
    of_ours = stale(lambda: float(camera.grab(time.monotonic(), 5.0).pixels.mean()))
    camera.close()
    capture = cv2.VideoCapture(DEVICE, cv2.CAP_V4L2)
    of_opencv = stale(lambda: float(capture.read()[1].mean()))
    capture.release()
    yield "stale frames handed out after 3 s of idling", str(of_ours), f"cv2.VideoCapture {of_opencv}"
    ctl("-c", "test_pattern=0")


def usb_rows() -> Iterator[tuple[str, str, str]]:
    """Frames of a USB webcam exposed before their trigger: ours, and believing uvcvideo's flag."""
    from drivers.camera.v4l2 import camera as driver
    from tests.support.camera.usb_webcam import Webcam
    from tests.support.camera.webcam_scene import Scene, camera_on, node_of_the_webcam

    subprocess.run(["/bin/busybox", "modprobe", "uvcvideo"], check=True)
    scene = Scene()
    webcam = Webcam(scene.encode)
    webcam.plug_in()
    node = node_of_the_webcam()

    def early(rate: float) -> str:
        camera = camera_on(node, frame_rate=rate)
        camera.open()
        ages = []
        for number in range(TRIGGERS):
            time.sleep(0.1 + number * 0.618 % 1 / rate)
            asked_s = time.monotonic()
            ages.append(asked_s - scene.exposure_of(camera.grab(asked_s, 5.0).pixels))
        camera.close()
        return f"{sum(age > 0 for age in ages)} of {TRIGGERS}, oldest {max(*ages, 0):.3f} s"

    known = driver.STAMP_ARRIVAL
    for rate in (30.0, 10.0):
        ours_text = early(rate)
        driver.STAMP_ARRIVAL = frozenset()
        believed = early(rate)
        driver.STAMP_ARRIVAL = known
        yield (
            f"USB webcam at {rate:g} Hz: frames exposed before their trigger",
            ours_text,
            f"stamps believed: {believed}",
        )
    webcam.pull_out()


def trouble_rows() -> Iterator[tuple[str, str, str]]:
    """What is said of a refused size, of a damaged frame, of a camera that was pulled out."""
    refused = told(lambda: ours(width=641).open())
    capture = cv2.VideoCapture(DEVICE, cv2.CAP_V4L2)
    said = capture.set(cv2.CAP_PROP_FRAME_WIDTH, 641)
    got = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH))
    yield "a width of 641 px asked for", refused, f"cv2 set() {said}, width then {got}"
    capture.read()
    ctl("-c", "inject_v4l2_buf_flag_error=1")
    good = sum(capture.read()[0] for _ in range(8))
    camera = ours()
    capture.release()
    camera.open()
    for _ in range(4):
        ctl("-c", "inject_v4l2_buf_flag_error=1")
        camera.grab(time.monotonic() - 0.5, 5.0)
        camera.grab(time.monotonic(), 5.0)
    yield (
        "a buffer flagged as damaged",
        f"skipped, counted ({camera.counts.bad})",
        f"cv2: {good} of 8 reads called good",
    )
    ctl("-c", "disconnect=1")

    def grabs() -> None:
        for _ in range(10):
            camera.grab(time.monotonic(), 2.0)

    text = told(grabs)
    camera.close()
    capture = cv2.VideoCapture(DEVICE, cv2.CAP_V4L2)
    capture.read()
    ctl("-c", "disconnect=1")
    began_s = time.monotonic()
    answers = [capture.read()[0] for _ in range(8)]
    took_s = time.monotonic() - began_s
    theirs = f"cv2: read() {answers[-1]} for ever, isOpened() {capture.isOpened()}, {took_s:.1f} s for 8 reads"
    capture.release()
    yield "the camera is pulled out", text, theirs


def told(call: Callable[[], object]) -> str:
    """The beginning of what the error says."""
    try:
        call()
    except Exception as error:  # noqa: BLE001  # whatever it is, it is what the user sees
        return str(error).split(";")[0]
    return "nothing"


def rate_rows() -> Iterator[tuple[str, str, str]]:
    """Frames in 5 s from the HDMI input at 1280 x 720, 60 a second, as many as v4l2-ctl gets in the same run."""
    camera = ours(width=1280, height=720, frame_rate=None, input=1)
    camera.open()
    began_s, mine = time.monotonic(), 0
    while time.monotonic() - began_s < 5:
        camera.grab(0.0, 5.0)
        mine += 1
    rate = mine / (time.monotonic() - began_s)
    camera.close()
    text = ctl("--stream-mmap=4", "--stream-count=300")
    rates = [float(found) for found in re.findall(r"([\d.]+) fps", text)]
    theirs = f"v4l2-ctl {statistics.median(rates):.1f}" if rates else "v4l2-ctl told none"
    yield "frames a second, 720p60, BGR", f"{rate:.1f}", theirs
    ctl("-i", "0")


def endurance_rows(frames: int) -> Iterator[tuple[str, str, str]]:
    """Growth of memory and descriptors over that many frames."""
    camera = ours(width=320, height=180, frame_rate=60.0)
    camera.open()
    for _ in range(200):
        camera.grab(0.0, 5.0)
    before, descriptors = resident_kb(), len(os.listdir("/proc/self/fd"))
    for _ in range(frames):
        camera.grab(0.0, 5.0)
    grown, more = resident_kb() - before, len(os.listdir("/proc/self/fd")) - descriptors
    bad = camera.counts.bad
    camera.close()
    yield f"{frames:,} frames in a row", f"{grown} kB and {more} descriptors more", f"{bad} unusable"


def resident_kb() -> int:
    """Memory of this process that is in use, kB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


if __name__ == "__main__":
    sys.exit(main())
