"""A camera whose frames are picture and video files: for trials, and for pictures that other software records."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.camera import CameraRefused, CameraTimeout, CameraUnavailable, Frame, FrameUnusable
from drivers.camera.depth import looked_at
from drivers.camera.files.decode import read_samples
from drivers.camera.files.folder import (
    SUFFIXES,
    FileVersion,
    Settling,
    is_video,
    list_versions,
    move_aside,
    natural_order,
    shown,
)
from drivers.camera.files.video import VideoFile
from drivers.camera.pacing import wait_until

LOOK_PERIOD_S = 0.05


class FileCamera:
    """One picture or video file, or all of a folder by name; a frame counts as exposed when it is read.

    With `loop` the folder is listed anew at each round. Without, each version of a file is handed out once, also over
    `close` and `open`; files added or written anew since are found when the list is used up. With `watch` the camera
    waits for them, and takes a file only once its writing has ended. With `move_to` a file that was read, or could not
    be, is moved there.
    """

    def __init__(
        self,
        path: str | Path,
        loop: bool,
        *,
        watch: bool = False,
        move_to: str | Path | None = None,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        if loop and (watch or move_to is not None):
            raise ValueError("a camera that loops neither watches for files nor moves them")
        self._path = Path(path)
        self._loop = loop
        self._watch = watch
        self._move_to = None if move_to is None else Path(move_to)
        self._now = now
        self._sleep = sleep
        self._is_open = False
        self._pending: deque[FileVersion] = deque()
        self._handed_out: set[FileVersion] = set()
        self._settling = Settling(now)
        self._video: VideoFile | None = None
        self._current: FileVersion | None = None
        self._read_at_s = 0.0
        self._sequence = 0

    def open(self) -> None:
        """List the files; raise CameraUnavailable where there are none (left). Opening it twice does nothing."""
        if self._is_open:
            return
        if self._move_to is not None:
            self._check_target(self._move_to)
        self._pending = deque(self._listed())
        if self._watch:
            self._pending.clear()
        self._is_open = True

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The next picture or frame of a video, read at or after `exposed_after_s`.

        Raises CameraTimeout where that time, or a watched-for file, does not come within `timeout_s`; CameraUnavailable
        where all files were handed out or the folder has gone; FrameUnusable for a file that is no good picture. The
        next call goes on after it.
        """
        if not self._is_open:
            raise CameraUnavailable(f"{shown(self._path)}: not open; expected open() before grab().")
        give_up_at = self._now() + timeout_s
        wait_until(exposed_after_s, timeout_s, now=self._now, sleep=self._sleep, source=shown(self._path))
        while True:
            samples = self._next_of_video() if self._video is not None else self._next_file(give_up_at)
            if samples is not None:
                break
        assert self._current is not None
        source = shown(self._current.path) + (f" frame {self._video.position}" if self._video is not None else "")
        if self._video is None:
            self._end_file()
        self._sequence += 1
        pixels, deep = looked_at(samples)
        return Frame(pixels, self._read_at_s, simulated=True, source=source, sequence=self._sequence, deep=deep)

    def check(self) -> None:
        """Raise CameraUnavailable where file or folder have gone."""
        if not self._is_open:
            raise CameraUnavailable(f"{shown(self._path)}: not open; expected open() before check().")
        try:
            self._path.stat()
        except OSError as error:
            raise CameraUnavailable(
                f"{shown(self._path)}: has gone ({error.strerror}); expected a picture file or a folder of them. "
                "Check camera.path, and that what it lies on is mounted."
            ) from error

    def close(self) -> None:
        """Forget the list of files; never raises. Closing it twice does nothing."""
        self._is_open = False
        self._pending.clear()
        if self._video is not None:
            self._video.close()
            self._video = None

    # --- one file -----------------------------------------------------------------------------------------------

    def _next_file(self, give_up_at: float) -> NDArray[np.uint8] | NDArray[np.uint16] | None:
        """The next file's picture; None where it is a video, which is open then."""
        if not self._pending:
            self._pending = deque([self._waited_for(give_up_at)] if self._watch else self._listed())
        self._current = self._pending.popleft()
        path = self._current.path
        self._read_at_s = self._now()
        try:
            if not is_video(path):
                return read_samples(path)
            self._video = VideoFile(path)
        except FrameUnusable:
            self._end_file()
            raise
        return None

    def _next_of_video(self) -> NDArray[np.uint8] | None:
        """The video's next frame; None after its last one, when it is closed."""
        assert self._video is not None
        self._read_at_s = self._now()
        try:
            pixels = self._video.next_frame()
        except FrameUnusable:
            self._end_file()
            raise
        if pixels is None:
            self._end_file()
        return pixels

    def _end_file(self) -> None:
        """Nothing more is wanted of the current file: it is moved aside, or not handed out again."""
        if self._video is not None:
            self._video.close()
            self._video = None
        assert self._current is not None
        if self._move_to is not None:
            try:
                move_aside(self._current.path, self._move_to)
            except OSError as error:
                raise CameraUnavailable(
                    f"{shown(self._current.path)}: cannot be moved to {shown(self._move_to)} "
                    f"({error.strerror or error}); it stays where it is and is taken again. "
                    "Check space and permissions."
                ) from error
        elif not self._loop:
            self._handed_out.add(self._current)

    # --- the list -----------------------------------------------------------------------------------------------

    def _waited_for(self, give_up_at: float) -> FileVersion:
        """The first file that is new and done; raise CameraTimeout, CameraUnavailable.

        Only that one: until the next is asked for, others may be written anew or taken away.
        """
        while True:
            new = self._new()
            done = self._settling.settled(new)
            if done:
                return natural_order(done)[0]
            if self._now() >= give_up_at:
                unfinished = len(new)
                seen = f"{unfinished} files are still being written" if unfinished else "no new picture came"
                raise CameraTimeout(
                    f"{shown(self._path)}: {seen} in time; expected one. Check the program that writes them, or raise "
                    "camera.timeout_s."
                )
            self._sleep(LOOK_PERIOD_S)

    def _listed(self) -> list[FileVersion]:
        """The files to hand out, sorted, at least one unless they are watched for; raise CameraUnavailable."""
        files = self._new()
        if files or self._watch:
            return natural_order(files)
        if not self._handed_out:
            raise CameraUnavailable(
                f"{shown(self._path)}: no pictures in this folder; expected files that end in {', '.join(SUFFIXES)}. "
                "Check camera.path."
            )
        raise CameraUnavailable(
            f"{shown(self._path)}: all pictures ({len(self._handed_out)}) were handed out; expected one that is left. "
            "Add pictures, or set camera.loop to true."
        )

    def _new(self) -> list[FileVersion]:
        """The files that were not handed out; raise CameraUnavailable."""
        try:
            found = list_versions(self._path)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise CameraUnavailable(
                f"{shown(self._path)}: cannot be read ({reason}); expected a picture file or a folder of them. "
                "Check camera.path."
            ) from error
        if self._loop:
            return found
        if not self._move_to:
            self._handed_out &= set(found)  # what has gone or was written anew need not be remembered
        return [version for version in found if version not in self._handed_out]

    def _check_target(self, folder: Path) -> None:
        """Raise CameraRefused, CameraUnavailable where read files cannot be moved to `folder`."""
        source = self._path if os.path.isdir(self._path) else self._path.parent
        if folder.resolve() == source.resolve():
            raise CameraRefused(
                f"{shown(folder)}: files are read from here; expected another folder in camera.move_to."
            )
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = error.strerror or error
            raise CameraUnavailable(f"{shown(folder)}: cannot be made ({reason}). Check camera.move_to.") from error
        for place in (folder, source):
            if os.path.exists(place) and not os.access(place, os.W_OK | os.X_OK):
                raise CameraUnavailable(
                    f"{shown(place)}: files cannot be moved from {shown(source)} to {shown(folder)}, as this folder "
                    "cannot be written. Check permissions and how it is mounted, or take camera.move_to out."
                )
