"""A camera whose frames are picture files: for trials, demonstrations and pictures that other software records."""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from drivers.camera import CameraUnavailable, Frame
from drivers.camera.decode import read_picture
from drivers.camera.pacing import wait_until

# What counts as a picture in a folder, which may hold notes and calibrations beside them. A single file may be called
# anything: its content decides.
SUFFIXES = (
    *(".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".dib", ".tif", ".tiff", ".webp", ".gif", ".jp2", ".avif"),
    *(".pbm", ".pgm", ".ppm", ".pnm", ".pam"),
)


def natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    """A key that sorts names as people do: frame2 before frame10, capitals beside small letters."""
    parts = re.split(r"([0-9]+)", path.name.casefold())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], path.name


class FileCamera:
    """One picture file, or all of a folder by name; a picture counts as exposed when it is read.

    With `loop` the folder is listed anew at each round. Without, each file is handed out once, also over `close` and
    `open`; files added since are found when the list is used up.
    """

    def __init__(
        self,
        path: str | Path,
        loop: bool,
        *,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._path = Path(path)
        self._loop = loop
        self._now = now
        self._sleep = sleep
        self._is_open = False
        self._pending: deque[Path] = deque()
        self._handed_out: set[Path] = set()
        self._sequence = 0

    def open(self) -> None:
        """List the pictures; raise CameraUnavailable where there are none (left). Opening it twice does nothing."""
        if self._is_open:
            return
        self._pending = deque(self._listed())
        self._is_open = True

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The next picture, read at or after `exposed_after_s`.

        Raises CameraTimeout where that time lies beyond `timeout_s`, CameraUnavailable where all pictures were handed
        out or the folder has gone, FrameUnusable for a file that is no good picture; the next call goes on after it.
        """
        if not self._is_open:
            raise CameraUnavailable(f"{self._path}: not open; expected open() before grab().")
        source = str(self._path)
        wait_until(exposed_after_s, timeout_s, now=self._now, sleep=self._sleep, source=source)
        if not self._pending:
            self._pending = deque(self._listed())
        path = self._pending.popleft()
        if not self._loop:
            self._handed_out.add(path)
        exposed_at_s = self._now()
        pixels = read_picture(path)
        self._sequence += 1
        return Frame(pixels, exposed_at_s, simulated=True, source=str(path), sequence=self._sequence)

    def close(self) -> None:
        """Forget the list of pictures; never raises. Closing it twice does nothing."""
        self._is_open = False
        self._pending.clear()

    def _listed(self) -> list[Path]:
        """The pictures to hand out, sorted, at least one; raise CameraUnavailable."""
        try:
            found = self._found()
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise CameraUnavailable(
                f"{self._path}: cannot be read ({reason}); expected a picture file or a folder of them. "
                "Check camera.path."
            ) from error
        if not found:
            raise CameraUnavailable(
                f"{self._path}: no pictures in this folder; expected files that end in {', '.join(SUFFIXES)}. "
                "Check camera.path."
            )
        left = found if self._loop else [path for path in found if path not in self._handed_out]
        if not left:
            raise CameraUnavailable(
                f"{self._path}: all pictures ({len(self._handed_out)}) were handed out; expected one that is left. "
                "Add pictures, or set camera.loop to true."
            )
        return left

    def _found(self) -> list[Path]:
        if not self._path.is_dir():
            self._path.stat()
            return [self._path]
        visible = (path for path in self._path.iterdir() if not path.name.startswith("."))
        pictures = [path for path in visible if path.suffix.lower() in SUFFIXES and not path.is_dir()]
        return sorted(pictures, key=natural_key)
