"""A job's evidence as the page hands it out: files by fixed names, and small pictures made from the frame.

No part of a path comes from a request: a job is a number, and a file one of FILES.
"""

from __future__ import annotations

import asyncio
import threading
from collections import OrderedDict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from service.export.forms import ENDINGS
from service.low_priority import go_last
from service.records.archive import folder_of
from service.records.evidence import FRAME, OVERLAY
from service.records.job import Job

DOCUMENT = "document.json"
FILES = {
    FRAME: "image/png",
    OVERLAY: "image/jpeg",
    DOCUMENT: "application/json",
    **{f"contour.{ending}": "application/octet-stream" for ending in ENDINGS.values()},
}
WIDTHS_PX = (320, 1600)
JPEG_QUALITY = 82
MOST_KEPT_BYTES = 16_000_000


class NoPicture(Exception):
    """There is no frame to show: what was found."""


def file_of(archive: Path, job: Job, name: str) -> Path | None:
    """Where one of FILES of a job is; None where nothing is kept. Raise KeyError for other names."""
    if name not in FILES:
        raise KeyError(name)
    suffix = f"{job.outcome}.json" if name == DOCUMENT else name
    path = folder_of(archive, job.job_id) / f"{job.job_id}-{suffix}"
    return path if path.is_file() and not path.is_symlink() else None


def files_kept(archive: Path, job: Job) -> list[str]:
    """The names of what is kept of a job. Without the document, which is written last, the rest does not count."""
    if job.outcome is None or file_of(archive, job, DOCUMENT) is None:
        return []
    return [name for name in FILES if file_of(archive, job, name) is not None]


class Pictures:
    """Frames made small, in a thread of low priority; the last ones are kept. May be called from any thread."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "page pictures", initializer=go_last)
        self._kept: OrderedDict[tuple[str, str, int], bytes] = OrderedDict()
        self._bytes = 0
        self._newest: tuple[Path, str, NDArray[np.uint8]] | None = None  # the last that was prepared, as large as it is
        self._lock = threading.Lock()

    def close(self) -> None:
        """Let the thread end; what it is making is not waited for."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    async def small(self, frame: Path, tag: str, width_px: int) -> bytes:
        """The frame at most `width_px` wide, as JPEG; raise NoPicture. tag: changes when the file does."""
        found = self._found(frame, tag, width_px)
        if found is None:
            made = await asyncio.get_running_loop().run_in_executor(self._pool, self._made, frame, tag)
            self._keep(frame, tag, made)
            found = made[width_px]
        return found

    def prepare(self, frame: Path, pixels: NDArray[np.uint8]) -> None:
        """Make what the strip will ask for of a frame at hand, and keep that for a look at it: not to read it back."""
        tag = tag_of(frame)
        self._newest = frame, tag, pixels
        self._keep(frame, tag, made_small(pixels, WIDTHS_PX[:1]))

    def _made(self, frame: Path, tag: str) -> dict[int, bytes]:
        newest = self._newest
        if newest is not None and newest[:2] == (frame, tag):
            return made_small(newest[2])
        return made_small(_read(frame))

    def _found(self, frame: Path, tag: str, width_px: int) -> bytes | None:
        key = str(frame), tag, width_px
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
            return self._kept.get(key)

    def _keep(self, frame: Path, tag: str, pictures: dict[int, bytes]) -> None:
        with self._lock:
            for width_px, picture in pictures.items():
                old = self._kept.pop((str(frame), tag, width_px), b"")
                self._kept[str(frame), tag, width_px] = picture
                self._bytes += len(picture) - len(old)
            while self._bytes > MOST_KEPT_BYTES and len(self._kept) > len(WIDTHS_PX):
                _, oldest = self._kept.popitem(last=False)
                self._bytes -= len(oldest)


def tag_of(path: Path) -> str:
    """What changes when the file does."""
    return f"{path.stat().st_mtime_ns:x}"


def _read(frame: Path) -> NDArray[np.uint8]:
    try:
        data = np.frombuffer(frame.read_bytes(), np.uint8)
    except OSError as error:
        raise NoPicture(f"the frame cannot be read: {error.strerror}") from error
    pixels = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
    if pixels is None:
        raise NoPicture("the frame's file is no picture")
    return np.asarray(pixels, dtype=np.uint8)


def made_small(pixels: NDArray[np.uint8], widths_px: tuple[int, ...] = WIDTHS_PX) -> dict[int, bytes]:
    """The picture as JPEG by each width, no wider."""
    made = {}
    for width_px in sorted(widths_px, reverse=True):  # each from the one before: what follows is the smaller work
        height, width = pixels.shape[:2]
        if width > width_px:
            size = width_px, max(round(height * width_px / width), 1)
            pixels = np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
        _, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        made[width_px] = jpeg.tobytes()
    return made
