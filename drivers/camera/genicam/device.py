"""An open camera of Aravis': controlled by us alone, asked whether it is there, and let go without waiting."""

from __future__ import annotations

import contextlib
import threading
from typing import Any, Protocol

from drivers.camera import CameraError, CameraUnavailable
from drivers.camera.genicam.binding import aravis
from drivers.camera.genicam.clock import CameraClock
from drivers.camera.genicam.errors import told
from drivers.camera.genicam.features import Features
from drivers.camera.genicam.gvcp import GigeQuestions
from drivers.camera.genicam.listing import GenicamIdentity

# Command and value by which a camera tells its clock, in the standard's present and in its older names.
_CLOCKS = (("TimestampLatch", "TimestampLatchValue"), ("GevTimestampControlLatch", "GevTimestampValue"))
_CHECK = "Check its cable and power."


class Closes(Protocol):
    """What ends with its camera."""

    def close(self) -> object:
        """End it; the last reference to what Aravis holds of it."""


class Device:
    """A camera under our control; raises CameraUnavailable where it has gone or another client has it."""

    def __init__(self, identity: GenicamIdentity, source: str) -> None:
        self.source = source
        self.streams: list[Closes] = []  # they end with it
        self._questions = GigeQuestions(identity.address) if identity.address else None
        try:
            with told(source, "be opened"):
                self.camera: Any = aravis().Camera.new(identity.device_id)
            self.device: Any = self.camera.get_device()
            self.features = Features(self.device, source)
            if self.is_gige and not self.device.is_controller():
                raise CameraUnavailable(self._taken())
            with told(source, "stop a stream that a client before left running"):
                self.camera.stop_acquisition()  # most features are locked while it runs
            self._latch = next((pair for pair in _CLOCKS if all(map(self.features.has, pair))), None)
            self._tick_s = self._seconds_a_tick()
        except BaseException:
            self.close()
            raise

    @property
    def is_gige(self) -> bool:
        """True for a camera on the network."""
        return self._questions is not None

    def ask(self) -> None:
        """Raise CameraUnavailable where the camera does not answer, or is no longer ours; within 0.6 s."""
        if self._questions is None:
            with told(self.source, "answer"):
                self.camera.get_payload()
            return
        taken = self._questions.control_is_taken()
        if taken is None:
            raise CameraUnavailable(f"{self.source}: the camera has gone (no answer for 0.6 s). {_CHECK}")
        if not taken:
            raise CameraUnavailable(
                f"{self.source}: the camera was switched off and on, or let us go; it is opened anew."
            )
        if not self.device.is_controller():
            raise CameraUnavailable(self._taken())

    def read_clock(self, clock: CameraClock, now: Any) -> None:
        """Have the clock know the camera's, where the camera can tell it."""
        if self._latch is None:
            return
        command, value = self._latch
        before_s = now()
        self.features.run(command)
        after_s = now()
        clock.latched(float(self.features.read(value)) * self._tick_s, before_s, after_s)

    def close(self) -> None:
        """Let the camera go; never raises. Aravis waits up to 10 s for one that has gone: it does so aside."""
        gone = self._questions is not None and self._questions.control_is_taken() is None
        if self._questions is not None:
            self._questions.close()
        if (features := self.__dict__.get("features")) is not None:
            features.close()  # an error on its way up may hold them, and with them the camera
        held: list[Any] = [entry.close() for entry in self.streams]
        held += [self.__dict__.pop(name, None) for name in ("device", "camera")]
        if not gone and held[-1] is not None:
            with contextlib.suppress(CameraError), told(self.source, "stop its stream"):
                held[-1].stop_acquisition()
        if gone:
            threading.Thread(target=held.clear, name="genicam-let-go", daemon=True).start()
        else:
            held.clear()

    def _taken(self) -> str:
        where = self._questions.controlled_from() if self._questions is not None else ""
        by = f"by the client at {where}" if where else "by another client, whose address the camera does not tell"
        return (
            f"{self.source}: the camera is controlled {by}; expected to be its only client. Close that program; the "
            "camera frees itself a few seconds after one that was killed."
        )

    def _seconds_a_tick(self) -> float:
        for name in ("GevTimestampTickFrequency", "DeviceTimestampFrequency"):
            if self._latch == _CLOCKS[1] and self.features.has(name):
                return 1.0 / max(1.0, float(self.features.read(name)))
        return 1e-9
