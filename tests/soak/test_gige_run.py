"""A slice of `make soak-camera`."""

from __future__ import annotations

from tests.soak.gige_run import run
from tests.support.gige_camera import aravis_is_loaded, need_aravis

__all__ = ["aravis_is_loaded"]


def test_no_incomplete_or_stale_frame_is_accepted_and_every_loss_is_told(tmp_path):
    need_aravis()
    toll = run(tmp_path, triggers=200, kill_every=100, warm_up=50)
    assert toll.violations == 0, str(toll)
    assert toll.good >= 190
    assert toll.told_broken >= 1, "nothing was done to it"
    assert toll.told_gone == toll.kills == 2
