"""Few arenas: asked of the C library that runs here."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

COUNT = """
import ctypes, threading
from service.allocator import ARENAS, keep_few_arenas
assert keep_few_arenas()
allocate = ctypes.CDLL(None).malloc
together = threading.Barrier(12)
def work():
    together.wait()
    allocate(1000)
    together.wait()
threads = [threading.Thread(target=work) for _ in range(12)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
ctypes.CDLL(None).malloc_stats()
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="arenas are glibc's")
def test_threads_share_few_arenas() -> None:
    done = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True, check=True)
    assert done.stderr.count("Arena ") <= 2, done.stderr
    without = COUNT.replace("assert keep_few_arenas()", "")
    assert (
        subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=True).stderr.count(
            "Arena "
        )
        > 2
    )
