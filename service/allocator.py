"""How the C library keeps memory: in few arenas, so that what threads leave behind does not add up over months."""

from __future__ import annotations

import ctypes

M_ARENA_MAX = -8  # malloc.h of glibc
ARENAS = 2  # one for the loop, one for the threads that do its work; more would each keep its own leftovers


def keep_few_arenas() -> bool:
    """True where the C library took it; others than glibc have no arenas. To be called before threads are started."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and mallopt(M_ARENA_MAX, ARENAS) == 1
