"""A thread that gives way to jobs."""

from __future__ import annotations

import os
import threading

NICENESS = 10  # a job goes before what only looks at one, adds up, or keeps the last one's picture


def go_last() -> None:
    """Have this thread take the processor after all that is for jobs."""
    os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
