"""Which cameras may be looked at between jobs, and which of their frames."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drivers.camera.files.camera import FileCamera
from service.config.config import Config
from service.wiring.devices import make_camera, single_frames

V4L2 = {"kind": "v4l2", "device": "/dev/video0", "width": 640, "height": 480}


def configured(**camera: Any) -> Config:
    return Config.model_validate({"camera": camera, "controller": {"kind": "none"}})


@pytest.mark.parametrize(
    ("camera", "spare"),
    [
        ({"kind": "files", "path": "."}, True),
        ({"kind": "files", "path": ".", "loop": False}, False),
        ({"kind": "files", "path": ".", "loop": False, "watch": True}, False),
        (V4L2, True),
        ({"kind": "genicam", "serial": "7"}, True),
        ({"kind": "genicam", "serial": "7", "trigger": "free"}, True),
        ({"kind": "genicam", "serial": "7", "trigger": "line"}, False),
    ],
)
def test_a_frame_that_would_be_a_jobs_is_not_looked_at(camera: dict[str, Any], spare: bool) -> None:
    assert configured(**camera).camera.has_spare_frames is spare


def test_frames_are_looked_at_one_by_one_where_jobs_average_them(tmp_path: Path) -> None:
    averaged = make_camera(configured(kind="files", path=str(tmp_path), average=4))
    assert not isinstance(averaged, FileCamera)
    assert isinstance(single_frames(averaged), FileCamera)
    plain = make_camera(configured(kind="files", path=str(tmp_path)))
    assert single_frames(plain) is plain
