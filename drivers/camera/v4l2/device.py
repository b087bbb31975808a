"""One open Video4Linux2 device: calls that succeed, or raise what a person can act on."""

from __future__ import annotations

import ctypes
import errno
import fcntl
import grp
import os
import select
import stat
from collections.abc import Callable, Iterator
from typing import TypeVar

from drivers.camera import CameraRefused, CameraUnavailable
from drivers.camera.v4l2 import kernel_interface as v4l2

S = TypeVar("S", bound=ctypes.Structure)

# How the kernel says that a device was unplugged or its driver unbound.
GONE = (errno.ENODEV, errno.ENXIO, errno.EIO)

TELL_WHAT_IT_IS = "tell what it is"


class DeviceGone(CameraUnavailable):
    """The device was unplugged, or its driver let it go."""


class Device:
    """An open device file; `path` is what the user called it, `node` what it stands for now."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.node = os.path.realpath(path)
        self._fd = _opened(path)

    def fileno(self) -> int:
        """The file descriptor; raise CameraUnavailable after `close`."""
        if self._fd < 0:
            raise CameraUnavailable(f"{self.path}: not open; expected open() before.")
        return self._fd

    def close(self) -> None:
        """Let the device go. Closing it twice does nothing."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def call(self, request: int, argument: S, what: str) -> S:
        """The argument as the driver filled it; raise DeviceGone, CameraRefused naming `what`."""
        try:
            fcntl.ioctl(self.fileno(), request, argument)
        except OSError as error:
            raise self._translated(error, what) from error
        return argument

    def call_number(self, request: int, number: int, what: str) -> int:
        """The same for an ioctl whose argument is an int."""
        argument = ctypes.c_int(number)
        try:
            fcntl.ioctl(self.fileno(), request, argument)
        except OSError as error:
            raise self._translated(error, what) from error
        return argument.value

    def answers(self, request: int, argument: ctypes.Structure) -> bool:
        """True where the driver knows the call and filled the argument; raise DeviceGone."""
        try:
            fcntl.ioctl(self.fileno(), request, argument)
        except OSError as error:
            if error.errno in GONE:
                raise self._translated(error, "answer") from error
            return False
        return True

    def wait(self, timeout_s: float) -> bool:
        """True once a frame lies ready, False after `timeout_s`; raise DeviceGone."""
        waiting = select.poll()
        waiting.register(self.fileno(), select.POLLIN)
        events = waiting.poll(max(0, round(timeout_s * 1000)))
        if any(event & select.POLLERR for _, event in events):
            # POLLERR also tells of a stream that is off: asking the device itself tells the two apart.
            self.call(v4l2.QUERYCAP, v4l2.Capability(), TELL_WHAT_IT_IS)
            raise CameraUnavailable(f"{self.path}: its stream has stopped; expected it to run. It is opened again.")
        return bool(events)

    def _translated(self, error: OSError, what: str) -> CameraUnavailable:
        reason = error.strerror or str(error)
        if error.errno in GONE:
            seen = f"{self.path}: the camera has gone ({reason})"
            return DeviceGone(f"{seen}; expected it to stay connected. Check its cable and power.")
        if error.errno == errno.EBUSY:
            return CameraUnavailable(
                f"{self.path}: busy, another program uses it; expected it to be free to {what}. "
                f"`fuser -v {self.node}` names the program: end it."
            )
        if error.errno == errno.ENOTTY and what == TELL_WHAT_IT_IS:
            return CameraRefused(f"{self.path}: no camera; expected a device of Video4Linux. {_WHERE}")
        return CameraRefused(f"{self.path}: the driver refused to {what} ({reason}).")


def _opened(path: str) -> int:
    """A descriptor of the device file; raise CameraUnavailable."""
    try:
        if not stat.S_ISCHR(os.stat(path).st_mode):
            raise CameraRefused(f"{path}: no device; expected a camera's device file such as /dev/video0. {_WHERE}")
        return os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except PermissionError as error:
        group = _group_of(path)
        raise CameraUnavailable(
            f"{path}: permission denied; expected to be allowed to read and write it. "
            f"Add the service's user to the group '{group}': usermod -aG {group} USER"
        ) from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CameraUnavailable(f"{path}: {reason}; expected a camera there. {_WHERE}") from error


_WHERE = "Check its cable; `combtrace cameras` lists what is there."


def _group_of(path: str) -> str:
    try:
        return grp.getgrgid(os.stat(path).st_gid).gr_name
    except (OSError, KeyError):
        return "video"


def enumerated(device: Device, request: int, make: Callable[[int], S]) -> Iterator[S]:
    """What the device lists under `request`: `make(index)` is asked for index 0, 1, … until the driver says no more."""
    index = 0
    while device.answers(request, entry := make(index)):
        yield entry
        index += 1
