"""Buffers shared with the driver, filled by it in turn."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import mmap
from dataclasses import dataclass

from drivers.camera import CameraRefused
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.device import TELL_WHAT_IT_IS, Device, DeviceGone

# Two would do; with four a driver that fills out of turn, or a late reader, loses nothing.
BUFFERS = 4


@dataclass(frozen=True)
class Filled:
    """A buffer that the driver has filled and now lends to us."""

    index: int
    bytes_used: int
    flags: int
    stamp_s: float
    sequence: int

    @property
    def damaged(self) -> bool:
        """True where the driver itself says that the data may be corrupt."""
        return bool(self.flags & v4l2.BUFFER_ERROR)

    @property
    def on_monotonic_clock(self) -> bool:
        """True where the stamp is CLOCK_MONOTONIC's, which is `time.monotonic`'s."""
        return self.flags & v4l2.TIMESTAMP_MASK == v4l2.TIMESTAMP_MONOTONIC

    @property
    def stamped_at_start_of_exposure(self) -> bool:
        """True where the stamp is of the start of exposure, False where of the frame's end."""
        return self.flags & v4l2.TIMESTAMP_SOURCE_MASK == v4l2.TIMESTAMP_START_OF_EXPOSURE


class Stream:
    """A running stream of one device; `close` ends it and lets the memory go."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._memory: list[mmap.mmap] = []
        try:
            self._map_buffers()
            self.start()
        except BaseException:
            self.close()
            raise

    def memory(self, index: int) -> mmap.mmap:
        """The memory of a buffer. Look at it only while the buffer is lent to us."""
        return self._memory[index]

    def start(self) -> None:
        """Lend all buffers to the driver and let frames flow; raise CameraUnavailable."""
        for index in range(len(self._memory)):
            self.give_back(index)
        self._device.call_number(v4l2.STREAMON, v4l2.BUF_TYPE_VIDEO_CAPTURE, "start its stream")

    def restart(self) -> None:
        """Stop and start again: what a stalled device needs."""
        self._device.call_number(v4l2.STREAMOFF, v4l2.BUF_TYPE_VIDEO_CAPTURE, "stop its stream")
        self.start()

    def take(self) -> Filled | None:
        """The next filled buffer, or None where none is ready; raise CameraUnavailable. It must be given back."""
        buffer = v4l2.Buffer(type=v4l2.BUF_TYPE_VIDEO_CAPTURE, memory=v4l2.MEMORY_MMAP)
        try:
            fcntl.ioctl(self._device.fileno(), v4l2.DQBUF, buffer)
        except BlockingIOError:
            return None
        except OSError as error:
            if error.errno == errno.EIO:  # the driver's word for a lost frame; the device may well be there
                self._device.call(v4l2.QUERYCAP, v4l2.Capability(), TELL_WHAT_IT_IS)
                return None
            seen = f"{self._device.path}: the camera has gone ({error.strerror})"
            raise DeviceGone(f"{seen}; expected frames. Check its cable and power.") from error
        stamp_s = buffer.timestamp.tv_sec + buffer.timestamp.tv_usec * 1e-6
        return Filled(buffer.index, buffer.bytesused, buffer.flags, stamp_s, buffer.sequence)

    def give_back(self, index: int) -> None:
        """Lend a buffer to the driver again; raise CameraUnavailable."""
        buffer = v4l2.Buffer(index=index, type=v4l2.BUF_TYPE_VIDEO_CAPTURE, memory=v4l2.MEMORY_MMAP)
        self._device.call(v4l2.QBUF, buffer, "take a buffer back")

    def close(self) -> None:
        """End the stream; never raises. The driver forgets its buffers when the device is closed."""
        stop = ctypes.c_int(v4l2.BUF_TYPE_VIDEO_CAPTURE)
        with contextlib.suppress(OSError):  # a device that has gone stops by itself
            fcntl.ioctl(self._device.fileno(), v4l2.STREAMOFF, stop)
        while self._memory:
            self._memory.pop().close()

    def _map_buffers(self) -> None:
        request = v4l2.RequestBuffers(count=BUFFERS, type=v4l2.BUF_TYPE_VIDEO_CAPTURE, memory=v4l2.MEMORY_MMAP)
        granted = self._device.call(v4l2.REQBUFS, request, "give memory for frames").count
        if granted == 0:
            raise CameraRefused(f"{self._device.path}: no memory for frames. Use a smaller picture.")
        for index in range(granted):
            buffer = v4l2.Buffer(index=index, type=v4l2.BUF_TYPE_VIDEO_CAPTURE, memory=v4l2.MEMORY_MMAP)
            self._device.call(v4l2.QUERYBUF, buffer, "tell where its frames lie")
            self._memory.append(mmap.mmap(self._device.fileno(), buffer.length, offset=buffer.m.offset))
