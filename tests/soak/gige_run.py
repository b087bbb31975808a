"""Thousands of software triggers on a GigE Vision camera that loses packets, and is killed and started again.

`make soak-camera [TRIGGERS=10000]`. The camera, a process on loopback, writes into each frame when it began to expose
it. So of each frame that the driver hands out it is known whether it is whole, and whether it was exposed after its
trigger; of each frame that it did not hand out, whether it was told.
"""

from __future__ import annotations

import argparse
import gc
import logging
import os
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from drivers.camera import CameraTimeout, CameraUnavailable
from drivers.camera.genicam.camera import GenicamCamera
from drivers.camera.genicam.settings import GenicamSettings
from tests.support.gige_camera import GigeCamera, started_at_s
from tests.support.processes.processes import resident_megabytes

WIDTH, HEIGHT, MARK = 640, 480, 8
LOSS = 0.0003  # of packets of 1400 bytes: one frame in fifteen is broken
WARM_UP = 500  # triggers in which memory settles
SETTLED_S = 12.0  # Aravis lets a camera that has gone go after ten
MOST_GROWTH_MB, MOST_GROWTH_FILES = 8.0, 2


@dataclass
class Toll:
    """What came of it. vanished: frames of which no packet came, after each of which the driver triggered anew."""

    triggers: int = 0
    good: int = 0
    kills: int = 0
    incomplete: int = 0
    stale: int = 0
    told_broken: int = 0
    vanished: int = 0
    untold: int = 0
    timeouts: int = 0
    told_gone: int = 0
    slowest_loss_s: float = 0.0
    slowest_return_s: float = 0.0
    memory_mb: list[float] = field(default_factory=list)
    files: list[int] = field(default_factory=list)

    @property
    def violations(self) -> int:
        """Frames that should not have been handed out, and losses that nobody was told of."""
        return self.incomplete + self.stale + self.untold + (self.kills - self.told_gone)

    def __str__(self) -> str:
        growth = f"{self.memory_mb[-1] - self.memory_mb[0]:+.1f} MB, {self.files[-1] - self.files[0]:+d} descriptors"
        return (
            f"{self.triggers} triggers, {self.good} frames, {self.told_broken} broken frames told, {self.vanished} "
            f"vanished, {self.timeouts} time-outs, {self.kills} kills ({self.told_gone} told, at most "
            f"{self.slowest_loss_s:.1f} s; back within {self.slowest_return_s:.1f} s); accepted: {self.incomplete} "
            f"incomplete, {self.stale} stale; untold: {self.untold}; {growth}"
        )


def run(folder: Path, triggers: int, kill_every: int, warm_up: int = WARM_UP) -> Toll:
    """The camera triggered so often, and killed after each `kill_every` of them."""
    pictures = np.random.default_rng(11).integers(0, 256, (4, HEIGHT * WIDTH)).astype(np.uint8)
    known = {picture[MARK:].tobytes() for picture in pictures}
    toll = Toll()
    camera = GenicamCamera(GenicamSettings("GV7", width=WIDTH, height=HEIGHT, exposure_us=500, packet_size=1400))
    with GigeCamera(folder, pictures, loss=LOSS) as gige:
        _open(camera)
        while toll.triggers < triggers:
            _trigger(camera, known, toll)
            if toll.triggers % kill_every == 0:
                _count(camera, gige, toll)
                _kill(camera, gige, toll)
            if toll.triggers == warm_up:
                _look(toll)
        _count(camera, gige, toll)
        camera.close()
        time.sleep(SETTLED_S if toll.kills else 0.0)
        _open(camera)
        _look(toll)
        camera.close()
    return toll


def _trigger(camera: GenicamCamera, known: set[bytes], toll: Toll) -> None:
    toll.triggers += 1
    asked_s = time.monotonic()
    try:
        frame = camera.grab(asked_s, 5.0)
    except CameraTimeout:
        toll.timeouts += 1
        return
    toll.good += 1
    toll.incomplete += frame.pixels.tobytes()[MARK:] not in known
    toll.stale += not asked_s <= frame.exposed_at_s <= started_at_s(frame)


def _count(camera: GenicamCamera, gige: GigeCamera, toll: Toll) -> None:
    """Each frame that the camera made came whole, was told broken, or is one that its trigger waited for in vain."""
    counts, made = camera.stream_counts, gige.made()
    toll.told_broken += counts.broken + counts.other
    vanished = made - counts.whole - counts.broken - counts.other
    toll.vanished += vanished
    toll.untold += max(0, vanished - camera.counts.unanswered)


def _kill(camera: GenicamCamera, gige: GigeCamera, toll: Toll) -> None:
    toll.kills += 1
    killed_s = time.monotonic()
    gige.kill()
    try:
        camera.check()
    except CameraUnavailable:
        toll.told_gone += 1
        toll.slowest_loss_s = max(toll.slowest_loss_s, time.monotonic() - killed_s)
    gige.start()
    back_s = time.monotonic()
    _open(camera)
    toll.slowest_return_s = max(toll.slowest_return_s, time.monotonic() - back_s)


def _open(camera: GenicamCamera) -> None:
    for _ in range(60):
        try:
            camera.open()
            return
        except CameraUnavailable:
            time.sleep(0.5)
    raise AssertionError("the camera was not taken up again")


def _look(toll: Toll) -> None:
    gc.collect()
    toll.memory_mb.append(resident_megabytes(os.getpid()))
    toll.files.append(len(os.listdir("/proc/self/fd")))


def main() -> int:
    """0 where every frame was what it should be, and nothing leaked."""
    parser = argparse.ArgumentParser(prog="make soak-camera", description=__doc__)
    parser.add_argument("--triggers", type=int, default=10_000)
    parser.add_argument("--kill-every", type=int, default=500)
    args = parser.parse_args()
    logging.getLogger("combtrace.camera").setLevel(logging.ERROR)  # some seven hundred broken frames
    began_s = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="combtrace-gige-") as folder:
        toll = run(Path(folder), args.triggers, args.kill_every)
    print(f"{toll}; {time.monotonic() - began_s:.0f} s")
    leaked = (
        toll.memory_mb[-1] - toll.memory_mb[0] > MOST_GROWTH_MB or toll.files[-1] - toll.files[0] > MOST_GROWTH_FILES
    )
    return 1 if toll.violations or leaked else 0


if __name__ == "__main__":
    sys.exit(main())
