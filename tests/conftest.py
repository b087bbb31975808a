"""Property tests are the same in every run, so that a red run means a changed program, and never timed.

`pytest --hypothesis-profile=explore` looks for new examples instead.
"""

import asyncio
import os
from collections.abc import AsyncIterator

import pytest
from hypothesis import settings

# Those need a kernel with the virtual camera: `make test-camera` boots one and says so.
collect_ignore = [] if os.environ.get("COMBTRACE_CAMERA_GUEST") else ["camera_guest"]
# Those run a CNC controller for a minute: `make test-linuxcnc`.
collect_ignore += [] if os.environ.get("COMBTRACE_LINUXCNC") else ["linuxcnc"]

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("same")


@pytest.fixture
async def no_task_is_left() -> AsyncIterator[None]:
    """Fails a test that leaves a task behind in the event loop."""
    before = asyncio.all_tasks()
    yield
    await asyncio.sleep(0.01)
    assert asyncio.all_tasks() - before - {asyncio.current_task()} == set()
