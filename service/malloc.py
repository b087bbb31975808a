"""How the C library keeps memory: in few arenas, given back now and then, so that it does not add up over months."""

from __future__ import annotations

import ctypes

M_ARENA_MAX = -8  # malloc.h of glibc
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
KEPT, LARGE = 64 << 20, 32 << 20  # bytes
ARENAS = 2  # one for the loop, one for the threads that do its work; more would each keep its own leftovers


def keep_few_arenas() -> bool:
    """True where the C library took it; others than glibc have no arenas. To be called before threads are started."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and mallopt(M_ARENA_MAX, ARENAS) == 1


def keep_freed() -> bool:
    """True where the C library keeps up to 64 MB that were freed at the end of its heap, and takes arrays from there.

    To give pictures and maps back and get them again, page by page, takes up to 7 ms of a look at 2 MP.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and mallopt(M_TRIM_THRESHOLD, KEPT) == mallopt(M_MMAP_THRESHOLD, LARGE) == 1


def give_back() -> bool:
    """True where memory that nobody uses went back to the kernel; some milliseconds, in which others cannot allocate.

    By itself the library gives back only the end of a heap: one block that stays keeps all that was freed before it.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    return trim is not None and trim(0) == 1
