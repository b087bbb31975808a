"""Property tests are the same in every run, so that a red run means a changed program, and never timed.

`pytest --hypothesis-profile=explore` looks for new examples instead.

Every test fails that leaves a descriptor or a thread open, or a task in its event loop.
"""

import os
from collections.abc import AsyncIterator, Iterator

import pytest
from hypothesis import settings
from pytest_asyncio import is_async_test

from tests.support.leaks import no_task_left, nothing_left

# Those need a kernel with the virtual camera: `make test-camera` boots one and says so.
collect_ignore = [] if os.environ.get("COMBTRACE_CAMERA_GUEST") else ["camera_guest"]
# Those run a CNC controller for a minute: `make test-linuxcnc`.
collect_ignore += [] if os.environ.get("COMBTRACE_LINUXCNC") else ["linuxcnc"]

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("same")


@pytest.fixture(autouse=True)
def nothing_is_left() -> Iterator[None]:
    """Set up after what a module keeps open and before all that is the test's own, its event loop too."""
    with nothing_left():
        yield


@pytest.fixture
async def no_task_is_left() -> AsyncIterator[None]:
    async with no_task_left():
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests with an event loop of their own are asked for tasks too: after their fixtures, before the loop ends."""
    for item in items:
        names = item.fixturenames if is_async_test(item) and isinstance(item, pytest.Function) else []
        if "nothing_is_left" in names and "no_task_is_left" not in names:
            names.insert(names.index("nothing_is_left") + 1, "no_task_is_left")
