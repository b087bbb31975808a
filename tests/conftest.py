"""Property tests are the same in every run, so that a red run means a changed program, and never timed.

`pytest --hypothesis-profile=explore` looks for new examples instead.

Of the hundreds of processes that tests start, this one too, each may leave its bytecode for the next, and has one
thread for numpy's algebra: its others wait busily while it starts. Most are forked from one.

Tests that mostly wait for processes come first: while they wait others compute, and nobody waits alone at the end.
Files that use the GigE camera, of which loopback has room for one, lie far apart: else one worker waits for another.

Every test fails that leaves a descriptor or a thread open, or a task in its event loop.
"""

import os
import signal
import sys

import pytest
from hypothesis import settings

from tests.support.leaks import no_task_is_left, nothing_is_left, pytest_collection_modifyitems
from tests.support.processes import forked

__all__ = ["no_task_is_left", "nothing_is_left", "pytest_collection_modifyitems"]

FIRST = (
    "tests/contracts/test_camera_contract.py",
    "tests/docs/test_tutorial.py",
    "tests/system/",
    "tests/hil/",
    "tests/soak/",
    "tests/controllers/",
    "tests/drivers/camera/genicam/",
)

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# A shell begins what runs in the background with Ctrl-C ignored, and so would be all that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
forked.begin()

# Those need a kernel with the virtual camera: `make test-camera` boots one and says so.
collect_ignore = [] if os.environ.get("COMBTRACE_CAMERA_GUEST") else ["camera_guest"]
# Those run a CNC controller for a minute: `make test-linuxcnc`.
collect_ignore += [] if os.environ.get("COMBTRACE_LINUXCNC") else ["linuxcnc"]
# Those install packages that are built first, in a clean machine: `make test-deb`.
collect_ignore += [] if os.environ.get("COMBTRACE_DEB") else ["deb"]

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("same")


@pytest.hookimpl(specname="pytest_collection_modifyitems")
def pytest_begin_with_those_that_wait(items: list[pytest.Item]) -> None:
    items.sort(
        key=lambda item: next((place for place, one in enumerate(FIRST) if item.nodeid.startswith(one)), len(FIRST))
    )
