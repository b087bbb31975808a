"""The stream of one camera: whole frames of the format that was asked for, and counts of all others."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drivers.camera import CameraRefused
from drivers.camera.genicam.binding import aravis
from drivers.camera.genicam.device import Device
from drivers.camera.genicam.errors import told
from drivers.camera.genicam.pixels import PixelFormat

log = logging.getLogger("combtrace.camera")

# A frame that is read, one that is filled, and two against a reader that is late.
BUFFERS = 4
SOCKET_BYTES = 4 << 20  # at least; a frame's packets take up to twice its size in the kernel
LARGEST_SOCKET = Path("/proc/sys/net/core/rmem_max")
# A camera sends its next packet within microseconds; what has not come by then was lost.
PACKET_WAIT_US, FRAME_WAIT_US = 20_000, 100_000


def small_sockets(needed: int = SOCKET_BYTES) -> str | None:
    """What to do where the system lets no socket hold so many bytes; None where it does."""
    try:
        allowed = int(LARGEST_SOCKET.read_text())
    except (OSError, ValueError):
        return None
    if allowed >= needed:
        return None
    return (
        f"the system lets a socket hold {allowed} bytes, expected {needed}: packets may be lost. As root, run "
        f"`sysctl -w net.core.rmem_max={needed}`; `combtrace install-service --print sysctl` keeps more"
    )


@dataclass(frozen=True)
class StreamCounts:
    """Since the camera was opened: whole frames, broken ones, those of another format, packets sent again and missing.

    Of a broken frame Aravis counts all packets from the first gap on.
    """

    whole: int = 0
    broken: int = 0
    other: int = 0
    resent_packets: int = 0
    missing_packets: int = 0


@dataclass(frozen=True)
class Whole:
    """A whole frame's bytes. number: the camera's own; stamp_s: its clock's, 0.0 = it has none."""

    data: bytes
    number: int
    stamp_s: float


class Stream:
    """A running stream; `close` ends it."""

    def __init__(self, device: Device, picture: PixelFormat, width: int, height: int) -> None:
        self._device, self._format, self._width, self._height = device, picture, width, height
        self._code = int(device.camera.get_pixel_format())
        self.counts = StreamCounts()
        source = device.source
        with told(source, "make a stream"):
            self._stream: Any = device.camera.create_stream(None, None)
        if self._stream is None:
            raise CameraRefused(f"{source}: makes no stream. Check that no firewall stops UDP.")
        device.streams.append(self)
        with told(source, "tell how large its frames are"):
            payload = int(device.camera.get_payload())
        if device.is_gige:
            self._patience(max(SOCKET_BYTES, 2 * payload))
        if payload < picture.size(width, height):
            seen = f"{source}: frames of {payload} bytes for {width} x {height} px {picture.name}"
            raise CameraRefused(f"{seen}; expected {picture.size(width, height)}. Correct camera.pixel_format.")
        for _ in range(BUFFERS):
            self._stream.push_buffer(aravis().Buffer.new_allocate(payload))

    def start(self) -> None:
        """Let frames flow."""
        with told(self._device.source, "start its stream"):
            self._device.camera.start_acquisition()

    def restart(self) -> None:
        """Stop, throw away all that came, start: after this no frame of an earlier trigger can come."""
        with told(self._device.source, "stop its stream"):
            self._device.camera.stop_acquisition()
        while self.take(FRAME_WAIT_US * 1e-6) is not None:
            continue
        self.start()

    def waiting(self) -> int:
        """Throw away what lies waiting, and tell how many frames that were."""
        thrown = 0
        while (buffer := self._stream.try_pop_buffer()) is not None:
            self._stream.push_buffer(buffer)
            thrown += 1
        return thrown

    def take(self, timeout_s: float) -> Whole | str | None:
        """The next frame; what is wrong with one that cannot be used; None where none comes in time."""
        buffer = self._stream.timeout_pop_buffer(max(1, int(timeout_s * 1e6)))
        if buffer is None:
            return None
        try:
            return self._looked_at(buffer)
        finally:
            self._stream.push_buffer(buffer)

    def told_counts(self) -> StreamCounts:
        """The counts, with the packets as Aravis counts them."""
        if not self._device.is_gige:
            return self.counts
        resent, missing = self._stream.get_statistics()
        return replace(self.counts, resent_packets=int(resent), missing_packets=int(missing))

    def close(self) -> object:
        """The last reference to Aravis' stream, which ends with it."""
        return self.__dict__.pop("_stream", None)

    def _looked_at(self, buffer: Any) -> Whole | str:
        status = buffer.get_status()
        if status != aravis().BufferStatus.SUCCESS:
            self.counts = replace(self.counts, broken=self.counts.broken + 1)
            return f"a frame came broken ({status.value_nick.replace('-', ' ')})"
        seen = buffer.get_image_width(), buffer.get_image_height(), buffer.get_image_pixel_format()
        data = buffer.get_data()
        needed = self._format.size(self._width, self._height)
        if seen != (self._width, self._height, self._code) or len(data) < needed:
            self.counts = replace(self.counts, other=self.counts.other + 1)
            what = f"{seen[0]} x {seen[1]}, format {seen[2]:#x}, {len(data)} bytes"
            return f"a frame of another kind came ({what}), expected {self._width} x {self._height} {self._format.name}"
        self.counts = replace(self.counts, whole=self.counts.whole + 1)
        return Whole(data, int(buffer.get_frame_id()), buffer.get_timestamp() * 1e-9)

    def _patience(self, socket_bytes: int) -> None:
        """The socket's buffer and the times after which packets are asked for again, or given up."""
        properties = self._stream.props
        properties.socket_buffer = aravis().GvStreamSocketBuffer.FIXED
        properties.socket_buffer_size = socket_bytes
        properties.packet_timeout = PACKET_WAIT_US
        properties.frame_retention = FRAME_WAIT_US
        if (trouble := small_sockets(socket_bytes)) is not None:
            log.warning("%s: %s", self._device.source, trouble)
