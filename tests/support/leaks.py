"""What a test may leave open when it ends: nothing, neither files, sockets and threads nor tasks.

A conftest.py that imports the fixtures and the hook from here holds every test of its folder to that.
"""

from __future__ import annotations

import asyncio
import gc
import os
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager, suppress

import pytest
from pytest_asyncio import is_async_test

BOUND_S = 1.0  # what winds down by itself, a pool's thread or the other end of a connection, has this long
PAUSE_S = 0.005
DESCRIPTORS = "/proc/self/fd"


@contextmanager
def nothing_left() -> Iterator[None]:
    """AssertionError where the block leaves more descriptors or threads than it found."""
    files, threads = _open_files(), set(threading.enumerate())
    yield
    if not _more_files(files) and not _more_threads(threads):
        return
    gc.collect()
    give_up_at = time.monotonic() + BOUND_S
    while (more := _more_files(files) + _more_threads(threads)) and time.monotonic() < give_up_at:
        time.sleep(PAUSE_S)
    assert not more, f"left open: {', '.join(more)}"


@asynccontextmanager
async def no_task_left() -> AsyncIterator[None]:
    """AssertionError where the block leaves tasks in the event loop."""
    before = asyncio.all_tasks()
    yield
    await asyncio.sleep(0)
    give_up_at = time.monotonic() + BOUND_S
    while (more := asyncio.all_tasks() - before - {asyncio.current_task()}) and time.monotonic() < give_up_at:
        await asyncio.sleep(PAUSE_S)
    assert not more, f"left running: {', '.join(map(str, more))}"


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


def _open_files() -> Counter[str]:
    """What open descriptors lead to, and how many to each."""
    found: Counter[str] = Counter()
    for number in os.listdir(DESCRIPTORS):
        with suppress(FileNotFoundError):  # the folder's own
            found[os.readlink(f"{DESCRIPTORS}/{number}")] += 1
    return found


def _more_files(before: Counter[str]) -> list[str]:
    """Those that are new, where there are more than before; one may be opened anew in the place of another."""
    now = _open_files()
    return sorted((now - before).elements()) if now.total() > before.total() else []


def _more_threads(before: set[threading.Thread]) -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread not in before and not thread.daemon]
