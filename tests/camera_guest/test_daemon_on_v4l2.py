"""The daemon on a real kernel's camera: it loses it and finds it again, alone."""

from __future__ import annotations

import json
import time

import pytest

from tests.support.camera.daemon import Daemon
from tests.support.camera.vivid import BIND, UNBIND, ctl, set_control


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
