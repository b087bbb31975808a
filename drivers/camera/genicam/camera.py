"""A GenICam camera: the first whole frame exposed after the trigger, or a reason."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from drivers.camera import CameraTimeout, CameraUnavailable, Frame
from drivers.camera.depth import looked_at
from drivers.camera.genicam.clock import CameraClock
from drivers.camera.genicam.device import Device
from drivers.camera.genicam.features import Written
from drivers.camera.genicam.listing import GenicamIdentity, find_camera
from drivers.camera.genicam.packets import LOST_PACKETS, negotiated
from drivers.camera.genicam.pixels import PixelFormat, pixel_format
from drivers.camera.genicam.settings import GenicamSettings, apply_settings, exposure_s, frame_rate
from drivers.camera.genicam.software_trigger import PATIENCE_S, SoftwareTrigger
from drivers.camera.genicam.stream import Stream, StreamCounts, Whole
from drivers.camera.pacing import wait_until

log = logging.getLogger("combtrace.camera")

ASK_EVERY_S = 0.5
UNKNOWN_PERIOD_S = 0.2  # of a free-running camera that does not tell its rate
SILENT_S, SILENT_PERIODS = 2.0, 5


@dataclass(frozen=True)
class Opened:
    """An open camera: what it is, and what it was set to and reads back. packet_size: bytes, 0 = not on a network."""

    identity: GenicamIdentity
    width: int
    height: int
    picture: PixelFormat
    exposure_s: float | None
    period_s: float | None
    packet_size: int
    written: tuple[Written, ...]

    def __str__(self) -> str:
        settings = "".join(f", {written}" for written in self.written)
        packets = f", packets of {self.packet_size} bytes" if self.packet_size else ""
        picture = f"{self.width} x {self.height} {self.picture.name}"
        return f"{self.identity} ({self.identity.protocol}): {picture}{packets}{settings}"


@dataclass
class TriggerCounts:
    """Since the camera was opened. stale: frames whose stamp lies before their trigger; unanswered: triggers whose
    frame never came; unasked, missed: edges of the line that came without a job, or whose frame did not come."""

    good: int = 0
    stale: int = 0
    unanswered: int = 0
    unasked: int = 0
    missed: int = 0


class GenicamCamera:
    """Frames of a GigE Vision or USB3 Vision camera, triggered by software, by a line, or free-running.

    All settings are written, read back and logged at each open. A camera that goes is closed, so that the next `open`
    finds it again.
    """

    def __init__(self, settings: GenicamSettings, *, now: Callable[[], float] = time.monotonic) -> None:
        self._settings = settings
        self._source = f"genicam {settings.serial or settings.user_name}"
        self._now = now
        self._device: Device | None = None
        self._stream: Stream | None = None
        self._opened: Opened | None = None
        self._clock = CameraClock()
        self._trigger: SoftwareTrigger | None = None
        self._last_number: int | None = None
        self._heard_at_s = 0.0
        self._handed_out = 0
        self.counts = TriggerCounts()

    @property
    def opened(self) -> Opened | None:
        """What the open camera is and was set to; None while it is closed."""
        return self._opened

    @property
    def stream_counts(self) -> StreamCounts:
        """Frames and packets of the open camera's stream."""
        return StreamCounts() if self._stream is None else self._stream.told_counts()

    def open(self) -> None:
        """Apply all settings and start the stream; raise CameraUnavailable, CameraRefused. Twice does nothing more.

        A first frame is taken, but of a camera that waits for its line: one whose packets do not come through is told
        here, not by the first job.
        """
        if self._device is not None:
            return
        picture = pixel_format(self._settings.pixel_format)
        identity = find_camera(self._settings.serial, self._settings.user_name)
        self._device = Device(identity, self._source)
        try:
            self._opened = self._set_up(self._device, identity, picture)
            self._stream = Stream(self._device, picture, self._opened.width, self._opened.height)
            self._clock, self._last_number, self.counts = CameraClock(), None, TriggerCounts()
            if self._settings.trigger == "software":
                self._trigger = SoftwareTrigger(self._device.features, self._opened.exposure_s)
            self._stream.start()
            self._heard_at_s = self._now()
            if self._settings.trigger != "line":
                self._first_good(self._now(), self._silence_s())
        except CameraTimeout as error:
            self.close()
            raise CameraUnavailable(str(error)) from error
        except BaseException:
            self.close()
            raise
        log.info("camera %s opened: %s", self._source, self._opened)

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The first whole frame whose exposure began at or after `exposed_after_s`; `exposed_at_s` tells its earliest.

        Raises CameraTimeout, which says what came instead, and CameraUnavailable, after which the camera is closed.
        """
        if self._stream is None or self._opened is None:
            raise CameraUnavailable(f"{self._source}: not open; expected open() before grab().")
        try:
            give_up_at = self._now() + timeout_s
            if self._settings.trigger == "software":
                wait_until(exposed_after_s, timeout_s, now=self._now, sleep=time.sleep, source=self._source)
            whole, began_s = self._first_good(exposed_after_s, give_up_at - self._now())
        except CameraUnavailable:
            self.close()
            raise
        samples = self._opened.picture.samples(whole.data, self._opened.width, self._opened.height)
        self._handed_out += 1
        self.counts.good += 1
        pixels, deep = looked_at(samples)
        camera = str(self._opened.identity)
        return Frame(pixels, began_s, False, self._source, self._handed_out, camera, deep)

    def check(self) -> None:
        """Raise CameraUnavailable where the camera has gone, is another client's or fell silent; then it is closed."""
        if self._device is None or self._stream is None:
            raise CameraUnavailable(f"{self._source}: not open; expected open() before check().")
        try:
            self._device.ask()
            if self._settings.trigger == "free":
                if self._stream.waiting():
                    self._heard_at_s = self._now()
                if (silent_s := self._now() - self._heard_at_s) > self._silence_s():
                    raise CameraUnavailable(f"{self._source}: silent for {silent_s:.1f} s; expected its stream to run.")
        except CameraUnavailable:
            self.close()
            raise

    def close(self) -> None:
        """Let the camera go; never raises. Closing it twice does nothing."""
        if self._device is not None:
            self._device.close()
        self._device = self._stream = self._opened = self._trigger = None

    # --- opening ----------------------------------------------------------------------------------------------------

    def _set_up(self, device: Device, identity: GenicamIdentity, picture: PixelFormat) -> Opened:
        settings, features = self._settings, device.features
        written = apply_settings(features, settings)
        packet_size = negotiated(device, settings) if device.is_gige else 0
        width, height = int(features.read("Width")), int(features.read("Height"))
        rate = frame_rate(features)
        return Opened(
            identity,
            width,
            height,
            picture,
            exposure_s(features),
            None if rate is None else 1 / rate,
            packet_size,
            written,
        )

    def _silence_s(self) -> float:
        assert self._opened is not None
        period_s = self._opened.period_s or UNKNOWN_PERIOD_S
        periods = SILENT_PERIODS * period_s if self._settings.trigger == "free" else 0.0
        return max(SILENT_S, periods, 2 * (self._opened.exposure_s or 0.0) + PATIENCE_S)

    # --- one frame --------------------------------------------------------------------------------------------------

    def _first_good(self, exposed_after_s: float, timeout_s: float) -> tuple[Whole, float]:
        """The frame and the earliest start of its exposure; raise CameraTimeout, CameraUnavailable."""
        device, stream = self._device, self._stream
        assert device is not None
        assert stream is not None
        give_up_at = self._now() + timeout_s
        before, trouble = stream.told_counts(), ""
        self._make_ready(device, stream)
        asked_at_s = self._now()
        while (now_s := self._now()) < give_up_at:
            if self._trigger is not None:
                self._trigger.give_if_due(now_s)
            if now_s - asked_at_s >= ASK_EVERY_S:
                device.ask()
                asked_at_s = now_s
            came = stream.take(min(0.1, give_up_at - now_s))
            if came is None:
                continue
            self._heard_at_s = self._now()
            began_s = -math.inf if isinstance(came, str) else self._began_s(came)
            if self._trigger is not None:
                self._trigger.frame_came(usable=began_s >= exposed_after_s)
            if isinstance(came, str):
                trouble = came
            elif began_s >= exposed_after_s:
                self._tell_losses(before, stream.told_counts(), trouble)
                return came, began_s
        raise self._timed_out(before, stream.told_counts(), timeout_s, trouble)

    def _make_ready(self, device: Device, stream: Stream) -> None:
        """Nothing of an earlier trigger may come any more; then the camera's clock is read."""
        device.ask()
        if self._trigger is not None:
            if self._trigger.owed:
                stream.restart()
            self._trigger.begin()
        unasked = stream.waiting()
        if self._settings.trigger == "line" and unasked:
            self.counts.unasked += unasked
            self._last_number = None
            log.warning("%s: %d edges of the line came without a job; their frames are not used", self._source, unasked)
        device.read_clock(self._clock, self._now)

    def _began_s(self, whole: Whole) -> float:
        """The earliest start of the exposure on our clock; -inf where the stamp says that it was before the trigger."""
        came_s, opened = self._now(), self._opened
        assert opened is not None
        self._count_edges(whole)
        triggered_at_s = -math.inf if self._trigger is None else self._trigger.first_at_s
        assert triggered_at_s is not None  # frames of earlier triggers were thrown away
        if whole.stamp_s and not self._clock.frame_came(whole.stamp_s, triggered_at_s, came_s):
            self.counts.stale += 1
            log.warning("%s: frame %d was exposed before its trigger; it is not used", self._source, whole.number)
            return -math.inf
        earliest_s = self._clock.earliest_s(whole.stamp_s) if whole.stamp_s else -math.inf
        if self._trigger is not None:
            return max(triggered_at_s, earliest_s)
        # Whatever the stamp marks, the exposure began no earlier than its own length before that. Of a camera whose
        # clock nobody can read, the frame that came soonest after its stamp tells, less the longest time to read out.
        period_s = opened.period_s or UNKNOWN_PERIOD_S
        exposure_s = period_s if opened.exposure_s is None else opened.exposure_s
        if not math.isfinite(earliest_s):
            earliest_s = (self._clock.latest_s(whole.stamp_s) if whole.stamp_s else came_s) - period_s
        return earliest_s - exposure_s - self._settings.latency_s

    def _count_edges(self, whole: Whole) -> None:
        last, self._last_number = self._last_number, whole.number
        if self._settings.trigger != "line" or last is None:
            return
        missed = whole.number - last - 1
        if 0 < missed < 1000:  # numbers of 16 bits begin anew
            self.counts.missed += missed
            log.warning("%s: %d edges of the line have brought no whole frame", self._source, missed)

    def _tell_losses(self, before: StreamCounts, after: StreamCounts, trouble: str) -> None:
        unanswered = 0 if self._trigger is None else self._trigger.unanswered
        if not trouble and unanswered == self.counts.unanswered:
            return
        first = self.counts.unanswered + before.broken + before.other == 0
        self.counts.unanswered = unanswered
        log.warning(
            "%s: %s; the next one was taken. Since its opening: %d frames broken, %d never came, %d packets missing%s",
            *(self._source, trouble or "a frame never came", after.broken + after.other, unanswered),
            *(after.missing_packets, f". {LOST_PACKETS}" if first else ""),
        )

    def _timed_out(self, before: StreamCounts, after: StreamCounts, timeout_s: float, trouble: str) -> CameraTimeout:
        broken = after.broken - before.broken + after.other - before.other
        seen = f"no whole frame within {timeout_s:.3g} s"
        if broken:
            seen += f"; {broken} came that cannot be used (last: {trouble})"
        advice = {"line": "Check that the line's edge comes after the trigger.", "free": "Check camera.frame_rate."}
        next_step = LOST_PACKETS if broken else advice.get(self._settings.trigger, "Check its cable. " + LOST_PACKETS)
        return CameraTimeout(f"{self._source}: {seen}; expected one exposed after the trigger. {next_step}")
