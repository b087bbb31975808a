"""Frames of a video file, one after the other."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera import FrameUnusable
from drivers.camera.files.folder import shown

# What FFmpeg says of a broken file is said by the error that follows; on standard error it would only be noise.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")


class VideoFile:
    """An open video; `close` lets the file go."""

    def __init__(self, path: Path) -> None:
        """Raises FrameUnusable for a file that holds no video that can be read."""
        self._path = path
        self._handed_out = 0
        self._capture = _opened(path)
        if not self._capture.isOpened():
            raise FrameUnusable(
                f"{shown(path)}: no video that can be read; expected one with a codec that FFmpeg knows. "
                "Record it anew, or convert it to pictures."
            )
        self._promised = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self._ahead = self._read()

    def next_frame(self) -> NDArray[np.uint8] | None:
        """The next frame, (H, W, 3) BGR, uint8, of its own memory; None after the last one.

        Raises FrameUnusable where the file ends before the number of frames that its header promises. The frame before
        such an end is not handed out: decoders fill what is missing of it with something plausible.
        """
        pixels, self._ahead = self._ahead, None if self._ahead is None else self._read()
        cut_off = self._ahead is None and self._handed_out + 1 < self._promised
        if pixels is not None and not cut_off:
            self._handed_out += 1
            return pixels
        if self._handed_out == self._promised == 0:
            raise FrameUnusable(f"{shown(self._path)}: a video without a frame; expected one or more. Record it anew.")
        if self._handed_out == 0 or self._handed_out < self._promised:
            raise FrameUnusable(
                f"{shown(self._path)}: the video is cut off after {self._handed_out} frames; "
                f"expected {self._promised}. Copy or record it anew; what follows goes on with the next file."
            )
        return None

    @property
    def position(self) -> int:
        """How many frames were handed out."""
        return self._handed_out

    def close(self) -> None:
        """Let the file go; never raises."""
        self._capture.release()

    def _read(self) -> NDArray[np.uint8] | None:
        done, pixels = self._capture.read()
        return np.asarray(pixels, dtype=np.uint8) if done else None


def _opened(path: Path) -> cv2.VideoCapture:
    """The decoder of a regular file; raise FrameUnusable where there is none.

    OpenCV gets it by its number: a name that is no UTF-8 would crash the process in it, and a pipe hold it up for ever.
    """
    try:
        file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FrameUnusable(f"{shown(path)}: cannot be read ({reason}). Check path and permissions.") from error
    try:
        if not stat.S_ISREG(os.fstat(file).st_mode):
            raise FrameUnusable(f"{shown(path)}: no regular file; expected a video. Take it out of the folder.")
        return cv2.VideoCapture(f"/proc/self/fd/{file}", cv2.CAP_FFMPEG)
    finally:
        os.close(file)
