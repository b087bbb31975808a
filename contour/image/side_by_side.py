"""Steps that know nothing of each other, side by side on two cores: OpenCV and numpy let others work meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import cv2

A = TypeVar("A")
B = TypeVar("B")

_alone = False


def keep_to_one_thread() -> None:
    """From here on this process takes one core, OpenCV too: each of the others has a process that measures, as well."""
    global _alone
    _alone = True
    cv2.setNumThreads(1)


def side_by_side(one: Callable[[], A], other: Callable[[], B]) -> tuple[A, B]:
    """The results of both, of which the other runs in a thread of its own; what either raises comes through.

    The thread ends with its step: to start one takes a tenth of a millisecond, and none is left behind.
    """
    if _alone:
        return one(), other()
    with ThreadPoolExecutor(1) as beside:
        coming = beside.submit(other)
        return one(), coming.result()
