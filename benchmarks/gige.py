"""What a software trigger gets from a GigE Vision camera: our driver beside Aravis alone, on its fake over loopback.

`python -m benchmarks.gige [--triggers N]` prints Markdown. Exposure and transfer are the camera's and the network's:
what lies beyond the exposure holds the transfer, and Aravis alone has both. The two ways take turns, trigger by
trigger, in one process.
"""

from __future__ import annotations

import argparse
import logging
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from drivers.camera.genicam.camera import GenicamCamera
from drivers.camera.genicam.settings import GenicamSettings
from tests.support.gige_camera import GigeCamera, started_at_s

EXPOSURE_US = 5000
SIZES = ((640, 480), (1024, 1024), (2048, 2048))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triggers", type=int, default=100)
    args = parser.parse_args()
    logging.getLogger("combtrace.camera").setLevel(logging.ERROR)
    print("| picture | packets, bytes | trigger to frame, ms | beyond exposure | Aravis alone | ours more |")
    print("|---|---|---|---|---|---|")
    for size in SIZES:
        for packet_size in (1400, 8192):
            print(_row(size, packet_size, args.triggers), flush=True)


def _row(size: tuple[int, int], packet_size: int, triggers: int) -> str:
    width, height = size
    picture = np.random.default_rng(3).integers(0, 256, (1, width * height)).astype(np.uint8)
    settings = GenicamSettings("GV7", width=width, height=height, exposure_us=EXPOSURE_US, packet_size=packet_size)
    camera = GenicamCamera(settings)
    ours, theirs = [], []
    with tempfile.TemporaryDirectory() as folder, GigeCamera(Path(folder), picture):
        camera.open()
        for _ in range(triggers):
            began_s = time.monotonic()
            frame = camera.grab(began_s, 10.0)
            ours.append(time.monotonic() - max(began_s, 0.0))
            assert started_at_s(frame) >= began_s
            theirs.append(_aravis_alone(camera))
        camera.close()
    total, alone = (1000 * statistics.median(times) for times in (ours, theirs))
    beyond = total - EXPOSURE_US / 1000
    cells = (f"{width} x {height}", packet_size, *(f"{ms:.1f}" for ms in (total, beyond, alone, total - alone)))
    return "| " + " | ".join(map(str, cells)) + " |"


def _aravis_alone(camera: GenicamCamera) -> float:
    """Trigger and frame with nothing between, on the same stream."""
    device, stream = camera._device, camera._stream  # what is measured against has no door of its own
    assert device is not None
    assert stream is not None
    began_s = time.monotonic()
    device.camera.software_trigger()
    buffer = stream._stream.timeout_pop_buffer(10_000_000)
    took_s = time.monotonic() - began_s
    stream._stream.push_buffer(buffer)
    return took_s


if __name__ == "__main__":
    main()
