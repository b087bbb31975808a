"""The daemon on a real kernel's camera: it loses it and finds it again, alone."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.support.camera.vivid import BIND, CAPTURE, UNBIND, ctl, set_control

CONFIG = f"""
camera: {{kind: v4l2, device: {CAPTURE}, width: 640, height: 360, frame_rate: 30, exposure_ms: 0, timeout_s: 2}}
controller: {{kind: none}}
recipes: [{{number: 1, name: default, thickness_mm: 20, method: find-contours}}]
triggers: [{{kind: interval, period_s: 0.5}}]
"""


class Daemon:
    """A running `combtrace run`, and what it has said so far."""

    def __init__(self, folder: Path, config: str = CONFIG) -> None:
        (folder / "config.yaml").write_text(config)
        self._log = folder / "log"
        command = [sys.executable, "-m", "service.cli.main", "run", "--config", str(folder / "config.yaml")]
        with open(self._log, "wb") as log:
            self._process = subprocess.Popen(command, stdout=log, stderr=log)

    def said(self) -> str:
        return self._log.read_text(errors="replace")

    def wait_for(self, pattern: str, *, after: int = 0, bound_s: float = 60.0) -> re.Match[str]:
        """The first match of the pattern behind the character `after`."""
        give_up_at = time.monotonic() + bound_s
        while time.monotonic() < give_up_at:
            found = re.compile(pattern).search(self.said(), after)
            if found:
                return found
            assert self._process.poll() is None, self.said()
            time.sleep(0.05)
        raise AssertionError(f"no {pattern!r} within {bound_s} s in:\n{self.said()}")

    def stop(self) -> None:
        self._process.terminate()
        self._process.wait(30)


@pytest.fixture
def daemon(tmp_path):
    ctl("-i", "0")
    running = Daemon(tmp_path)
    yield running
    running.stop()


def test_a_camera_whose_driver_goes_and_comes_back_leads_to_error_and_to_ready_again(daemon):
    daemon.wait_for(r"camera /dev/video0 opened: vivid")
    done = daemon.wait_for(r"job \d+ (refused|written)")
    UNBIND.write_text("vivid.0")
    lost = daemon.wait_for(r"-> Error reason=\S?/dev/video0", after=done.end())
    daemon.wait_for(r"No such file", after=lost.start())
    BIND.write_text("vivid.0")
    returned_s = time.monotonic()
    back = daemon.wait_for(r"-> Ready", after=lost.end())
    took_s = time.monotonic() - returned_s
    print(json.dumps({"recovered_after_s": round(took_s, 2)}))
    daemon.wait_for(r"job \d+ (refused|written)", after=back.end())


def test_a_camera_that_falls_silent_is_told_and_heard_again(daemon):
    daemon.wait_for(r"job \d+ (refused|written)")
    set_control("percentage_of_dropped_buffers", 100)
    try:
        lost = daemon.wait_for(r"-> Error reason=.*(silent|no frame came)")
    finally:
        set_control("percentage_of_dropped_buffers", 0)
    daemon.wait_for(r"job \d+ (refused|written)", after=daemon.wait_for(r"-> Ready", after=lost.end()).end())
