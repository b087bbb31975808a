"""Few arenas: asked of the C library that runs here."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

COUNT = """
import ctypes, threading
from service.malloc import ARENAS, keep_few_arenas
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


HELD_BY_ONE = """
import ctypes
from pathlib import Path
from service.malloc import give_back
library = ctypes.CDLL(None)
library.malloc.restype = ctypes.c_void_p
library.free.argtypes = [ctypes.c_void_p]
library.memset.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t]
def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096
blocks = [library.malloc(64_000) for _ in range(1000)]
for block in blocks:
    library.memset(block, 1, 64_000)
for block in blocks[:-1]:
    library.free(block)
before = resident()
given = give_back()
print(given, before - resident() > 50e6)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="malloc_trim is glibc's")
def test_what_one_block_kept_from_the_kernel_is_given_back() -> None:
    done = subprocess.run([sys.executable, "-c", HELD_BY_ONE], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "True"]
    without = HELD_BY_ONE.replace("give_back()", "False")
    assert subprocess.run(
        [sys.executable, "-c", without], capture_output=True, text=True, check=True
    ).stdout.split() == ["False", "False"]


KEPT_ARRAYS = """
import resource, sys
from service.malloc import keep_freed
assert sys.argv[1] == "freely" or keep_freed()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for turn in range(12):
    if turn == 2:
        before = faults()
    arrays = [bytearray(3_000_000 + 400_000 * turn) for _ in range(4)]
    del arrays
print(faults() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="thresholds are glibc's")
def test_freed_arrays_are_kept_for_the_next_ones() -> None:
    kept, freely = (
        int(subprocess.run([sys.executable, "-c", KEPT_ARRAYS, way], capture_output=True, text=True, check=True).stdout)
        for way in ("kept", "freely")
    )
    assert kept < 0.5 * freely
