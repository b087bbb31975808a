"""A daemon that runs on the virtual camera, and what it has said."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

from tests.support.camera.vivid import CAPTURE, PATIENT_S

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

    def wait_for(self, pattern: str, *, after: int = 0, bound_s: float = PATIENT_S) -> re.Match[str]:
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
        """SIGTERM, on which it must end by itself."""
        self._process.terminate()
        try:
            self._process.wait(PATIENT_S)
        finally:
            self._process.kill()
            self._process.wait()
