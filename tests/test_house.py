"""The house keeps its own rules: who may import benchmarks, how full a room may be, what a test may leave open."""

from __future__ import annotations

import ast
import asyncio
import os
import socket
import threading
import time
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from tests.support.leaks import no_task_left, nothing_left

ROOT = Path(__file__).parents[1]
PARTS = ("benchmarks", "contour", "controllers", "drivers", "packaging", "service", "tests")
MOST_FILES = 15


@cache
def imports(part: str) -> list[tuple[Path, str]]:
    """Each file of the part, and each module that it imports anywhere."""
    found = []
    for file in (ROOT / part).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                found.append((file, node.module or "."))
            elif isinstance(node, ast.Import):
                found += [(file, alias.name) for alias in node.names]
    return found


def test_nothing_imports_benchmarks() -> None:
    others = [part for part in PARTS if part != "benchmarks"]
    assert [file for part in others for file, name in imports(part) if name.split(".")[0] == "benchmarks"] == []


def test_benchmarks_take_of_tests_only_what_is_for_all() -> None:
    taken = {(file, name) for file, name in imports("benchmarks") if name.split(".")[0] == "tests"}
    assert taken
    assert [(file, name) for file, name in taken if name.split(".")[1:2] != ["support"]] == []


def test_no_test_is_imported_by_another() -> None:
    """What two of them need lies in tests.support."""
    assert [(file, name) for part in PARTS for file, name in imports(part) if ".test_" in name] == []


@pytest.mark.parametrize("part", PARTS)
def test_no_room_has_more_files_than_can_be_overlooked(part: str) -> None:
    files = Counter(file.parent for file in (ROOT / part).rglob("*.py") if file.name != "__init__.py")
    assert {folder: count for folder, count in files.items() if count > MOST_FILES} == {}


# --- what is left open ------------------------------------------------------------------------------------------------


def test_every_test_is_held_to_leave_nothing_open(request: pytest.FixtureRequest) -> None:
    assert "nothing_is_left" in request.fixturenames


async def test_and_no_task_where_it_has_a_loop(request: pytest.FixtureRequest) -> None:
    assert "no_task_is_left" in request.fixturenames


def test_a_socket_left_open_is_told() -> None:
    with pytest.raises(AssertionError, match=r"left open: socket:\["), nothing_left():
        left = socket.socket()
    left.close()


def test_a_thread_left_running_is_told_and_one_that_ends_soon_is_not() -> None:
    stop = threading.Event()
    with pytest.raises(AssertionError, match="left open: slow"), nothing_left():
        threading.Thread(target=stop.wait, name="slow").start()
    stop.set()
    with nothing_left():
        threading.Thread(target=time.sleep, args=(0.05,)).start()


def test_a_file_opened_in_the_place_of_another_is_none_too_many() -> None:
    old = os.open("/dev/null", os.O_RDONLY)
    with nothing_left():
        os.close(old)
        new = os.open("/dev/zero", os.O_RDONLY)
    os.close(new)


async def test_a_task_left_running_is_told_and_one_that_ends_soon_is_not() -> None:
    with pytest.raises(AssertionError, match=r"left running: .*for_ever"):
        async with no_task_left():
            left = asyncio.create_task(asyncio.sleep(1e9), name="for_ever")
    left.cancel()
    async with no_task_left():
        soon = asyncio.create_task(asyncio.sleep(0.02))
    assert soon.done()
