"""A Video4Linux2 camera: the first good frame exposed after the trigger, or a reason."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drivers.camera import CameraRefused, CameraTimeout, CameraUnavailable, Frame, FrameUnusable
from drivers.camera.depth import looked_at
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.controls import apply_controls, exposure_s
from drivers.camera.v4l2.device import TELL_WHAT_IT_IS, Device
from drivers.camera.v4l2.exposure import STAMP_ARRIVAL, FrameTiming
from drivers.camera.v4l2.formats import set_format, set_frame_rate
from drivers.camera.v4l2.identity import CameraIdentity, identify
from drivers.camera.v4l2.pixels import PictureFormat, bytes_needed, to_samples
from drivers.camera.v4l2.signal_input import select_input
from drivers.camera.v4l2.stream import BUFFERS, Filled, Stream

log = logging.getLogger("combtrace.camera")

# Where a driver tells no frame period: longer than that of any camera that suits a cutting cell.
UNKNOWN_PERIOD_S = 0.2
# A stream that brings nothing for so long, and for so many periods, is silent.
SILENT_S, SILENT_PERIODS = 2.0, 5


@dataclass(frozen=True)
class V4l2Settings:
    """What the camera is asked for at every open.

    exposure_s: what the exposure time is where the camera does not tell; None = one frame period is assumed.
    latency_s: how long the camera keeps a frame, beyond exposure and reading out, before it sends it.
    input: number of a capture card's input; None = as it is.
    """

    device: str
    width: int
    height: int
    pixel_format: str = "YUYV"
    frame_rate: float | None = None
    controls: Mapping[str, int] = field(default_factory=dict)
    input: int | None = None
    exposure_s: float | None = None
    latency_s: float = 0.0


@dataclass(frozen=True)
class Opened:
    """An open camera: what it is, and what it was set to and reads back."""

    identity: CameraIdentity
    picture: PictureFormat
    period_s: float | None
    exposure_s: float | None
    controls: Mapping[str, int]

    def __str__(self) -> str:
        rate = "" if self.period_s is None else f" at {1 / self.period_s:.4g} a second"
        exposure = "exposure unknown" if self.exposure_s is None else f"exposure {self.exposure_s * 1000:.3g} ms"
        settings = "".join(f", {name} = {value}" for name, value in self.controls.items())
        picture = f"{self.picture.width} x {self.picture.height} {self.picture.code}{rate}"
        return f"{self.identity} ({self.identity.driver}): {picture}, {exposure}{settings}"


@dataclass
class FrameCounts:
    """Frames since the camera was opened: handed out, exposed too early, and unusable (flagged, short or damaged)."""

    good: int = 0
    early: int = 0
    bad: int = 0


class V4l2Camera:
    """Frames of a Video4Linux2 device; free-running, the stale ones are thrown away unseen.

    All settings are written, read back and logged at each open, as devices forget them with their power. A device that
    goes is closed, so that the next `open` finds it again.
    """

    def __init__(self, settings: V4l2Settings, *, now: Callable[[], float] = time.monotonic) -> None:
        self._settings = settings
        self._now = now
        self._device: Device | None = None
        self._stream: Stream | None = None
        self._opened: Opened | None = None
        self._stalled = False
        self._handed_out = 0
        self._last: Filled | None = None
        self._asked_at_s = 0.0
        self._heard_at_s = 0.0
        self._seen_period_s = 0.0
        self.counts = FrameCounts()

    @property
    def opened(self) -> Opened | None:
        """What the open camera is and was set to; None while it is closed."""
        return self._opened

    def open(self) -> None:
        """Apply all settings and start the stream; raise CameraUnavailable, CameraRefused. Twice does nothing more."""
        if self._device is not None:
            return
        device = Device(self._settings.device)
        try:
            self._opened = self._set_up(device)
            self._stream = Stream(device)
            if not device.wait(self._silence_s(self._opened)):
                raise CameraUnavailable(f"{device.path}: no frame came; expected its stream to run. {_CHECK}")
        except BaseException:
            if self._stream is not None:
                self._stream.close()
            self._opened = self._stream = None
            device.close()
            raise
        self._device, self._last, self._seen_period_s = device, None, 0.0
        self._heard_at_s = self._now()
        self._stalled, self.counts = False, FrameCounts()
        log.info("camera %s opened: %s", self._settings.device, self._opened)

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The first good frame whose exposure began at or after `exposed_after_s`; `exposed_at_s` tells its earliest.

        Raises CameraTimeout, which says what came instead, and CameraUnavailable, after which the camera is closed.
        """
        if self._stream is None or self._device is None:
            raise CameraUnavailable(f"{self._settings.device}: not open; expected open() before grab().")
        try:
            return self._first_good(self._device, self._stream, exposed_after_s, timeout_s)
        except CameraUnavailable:
            self.close()
            raise

    def check(self) -> None:
        """Raise CameraUnavailable where the device has gone or no frame came for some time; then it is closed.

        Frames that lie waiting are given back: each was exposed before whatever is triggered from now on.
        """
        if self._stream is None or self._device is None or self._opened is None:
            raise CameraUnavailable(f"{self._settings.device}: not open; expected open() before check().")
        try:
            self._device.call(v4l2.QUERYCAP, v4l2.Capability(), TELL_WHAT_IT_IS)
            for _ in range(BUFFERS):
                filled = self._stream.take()
                if filled is None:
                    break
                self._stream.give_back(filled.index)
                self._heard_at_s = self._now()
            silent_s = self._now() - self._heard_at_s
            if silent_s > self._silence_s(self._opened):
                seen = f"{self._settings.device}: silent for {silent_s:.1f} s"
                raise CameraUnavailable(f"{seen}; expected its stream to run. {_CHECK}")
        except CameraUnavailable:
            self.close()
            raise

    def close(self) -> None:
        """Let the device go; never raises. Closing it twice does nothing."""
        if self._stream is not None:
            self._stream.close()
        if self._device is not None:
            self._device.close()
        self._device = self._stream = self._opened = None

    @staticmethod
    def _silence_s(opened: Opened) -> float:
        return max(SILENT_S, SILENT_PERIODS * (opened.period_s or UNKNOWN_PERIOD_S))

    def _set_up(self, device: Device) -> Opened:
        settings = self._settings
        identity = identify(device)
        select_input(device, settings.input)
        picture = set_format(device, settings.width, settings.height, settings.pixel_format)
        period_s = set_frame_rate(device, settings.frame_rate, settings.pixel_format)
        controls = apply_controls(device, settings.controls)
        told_s = exposure_s(device)
        return Opened(identity, picture, period_s, settings.exposure_s if told_s is None else told_s, controls)

    def _first_good(self, device: Device, stream: Stream, exposed_after_s: float, timeout_s: float) -> Frame:
        if self._stalled:
            stream.restart()
            self._stalled = False
        self._asked_at_s = self._now()
        give_up_at = self._asked_at_s + timeout_s
        before = FrameCounts(**vars(self.counts))
        trouble = ""
        while True:
            filled = stream.take()
            if filled is None:
                if (left_s := give_up_at - self._now()) <= 0:
                    raise self._timed_out(before, timeout_s, trouble)
                device.wait(left_s)
                continue
            try:
                return self._used(stream, filled, exposed_after_s)
            except FrameUnusable as error:
                self.counts.bad += 1
                trouble = str(error)
            except _TooEarly:
                self.counts.early += 1
            finally:
                stream.give_back(filled.index)
            if self._now() >= give_up_at:
                raise self._timed_out(before, timeout_s, trouble)

    def _used(self, stream: Stream, filled: Filled, exposed_after_s: float) -> Frame:
        """The frame in a buffer; raise FrameUnusable, _TooEarly."""
        opened, device = self._opened, self._settings.device
        self._heard_at_s = self._now()
        assert opened is not None
        began_s = self._exposed_at(filled, opened)
        if filled.damaged or filled.bytes_used < bytes_needed(opened.picture):
            flaw = "flagged as damaged by the driver" if filled.damaged else f"only {filled.bytes_used} bytes long"
            raise FrameUnusable(f"{device}: frame {filled.sequence} is {flaw}")
        if began_s < exposed_after_s:
            raise _TooEarly
        samples = to_samples(stream.memory(filled.index), filled.bytes_used, opened.picture, device)
        pixels, deep = looked_at(samples)
        self.counts.good += 1
        self._handed_out += 1
        return Frame(pixels, began_s, False, device, self._handed_out, str(opened.identity), deep)

    def _exposed_at(self, filled: Filled, opened: Opened) -> float:
        """The earliest start of the frame's exposure; raise CameraRefused where the stamp's clock is not known."""
        if not filled.on_monotonic_clock:
            raise CameraRefused(
                f"{self._settings.device}: the driver stamps frames by an unknown clock; expected the monotonic one, "
                "without which nobody can tell whether a frame was exposed after its trigger. Use another driver."
            )
        last, self._last = self._last, filled
        # Frames that lay waiting say nothing: behind the last of them the driver may have dropped any number.
        if last is not None and last.stamp_s >= self._asked_at_s and filled.sequence == last.sequence + 1:
            self._seen_period_s = filled.stamp_s - last.stamp_s
        told_s = UNKNOWN_PERIOD_S if opened.period_s is None else opened.period_s
        # In poor light some cameras lengthen the exposure and with it the period beyond what they were set to.
        timing = FrameTiming(max(told_s, self._seen_period_s), opened.exposure_s, self._settings.latency_s)
        at_start = filled.stamped_at_start_of_exposure and opened.identity.driver not in STAMP_ARRIVAL
        return timing.earliest_start_s(filled.stamp_s, at_start_of_exposure=at_start)

    def _timed_out(self, before: FrameCounts, timeout_s: float, trouble: str) -> CameraTimeout:
        early, bad = self.counts.early - before.early, self.counts.bad - before.bad
        if early + bad == 0:
            self._stalled = True
            seen = "no frame came: the camera is silent"
        else:
            seen = f"{early} frames were exposed too early and {bad} were unusable"
            seen += f" (last: {trouble})" if trouble else ""
        return CameraTimeout(
            f"{self._settings.device}: {seen} within {timeout_s:g} s; expected one good frame exposed after the "
            f"trigger. {_CHECK}"
        )


_CHECK = "Check the camera's cable, power and frame rate."


class _TooEarly(Exception):
    """The frame's exposure may have begun before the time asked for."""
