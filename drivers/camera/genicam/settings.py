"""What a GenICam camera is asked for, as the features in which it is written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.camera import CameraRefused
from drivers.camera.genicam.features import Features, Value, Written

# Names of the present standard (SFNC), then those of cameras that are older than it.
_EXPOSURE = ("ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw")
_GAIN = ("Gain", "GainRaw")
_BLACK_LEVEL = ("BlackLevel", "BlackLevelRaw")
_BALANCE = ("BalanceRatio", "BalanceRatioAbs", "BalanceRatioRaw")
_RATE = ("AcquisitionFrameRate", "AcquisitionFrameRateAbs")
_RATE_SWITCH = ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled")
# What a frame is judged by is not changed behind its back.
_KEYS = {
    "Width": "width",
    "Height": "height",
    "OffsetX": "offset_x",
    "OffsetY": "offset_y",
    "PixelFormat": "pixel_format",
    "TriggerMode": "trigger",
    "TriggerSource": "trigger",
    "AcquisitionMode": "trigger",
}


@dataclass(frozen=True)
class GenicamSettings:
    """What the camera is asked for at every open; None = as the camera has it.

    serial, user_name: which camera; the serial number counts where both are given. trigger: "software", "line" or
    "free"; line: the input that triggers. white_balance: the gain of each colour. strobe: the output line that is on
    while the sensor is exposed. packet_size: bytes; 0 = negotiated. packet_delay_ns: pause between two packets.
    latency_s: how long the camera keeps a frame.
    """

    serial: str = ""
    user_name: str = ""
    width: int | None = None
    height: int | None = None
    offset_x: int = 0
    offset_y: int = 0
    pixel_format: str = "Mono8"
    exposure_us: float | None = None
    gain_db: float | None = None
    black_level: float | None = None
    white_balance: Mapping[str, float] = field(default_factory=dict)
    frame_rate: float | None = None
    trigger: str = "software"
    line: str = "Line1"
    trigger_activation: str | None = None
    strobe: str | None = None
    packet_size: int = 0
    packet_delay_ns: int | None = None
    features: Mapping[str, Value] = field(default_factory=dict)
    latency_s: float = 0.0


def apply_settings(features: Features, settings: GenicamSettings) -> tuple[Written, ...]:
    """Write all that is asked and read it back, each once it is written and all of them at the end.

    Raises CameraRefused where one does not hold, CameraUnavailable.
    """
    writer = _Writer(features)
    _region(writer, settings)
    _light(writer, settings)
    _trigger(writer, settings)
    for name, value in settings.features.items():
        if name in _KEYS:
            raise CameraRefused(f"genicam: {name} is set by camera.{_KEYS[name]}. Take camera.features.{name} out.")
        writer.put((name,), value, f"camera.features.{name}")
    return writer.held()


class _Writer:
    """Writes features and remembers them. Under a selector one name stands for several values: only its last counts."""

    def __init__(self, features: Features) -> None:
        self.features = features
        self._written: dict[str, tuple[Written, str]] = {}

    def put(self, names: tuple[str, ...], value: Value, key: str, *, if_there: bool = False) -> None:
        name = next((name for name in names if self.features.has(name)), names[0])
        if if_there and not self.features.has(name):
            return
        self._written[name] = self.features.write(name, value, key), key

    def choose(self, name: str, entry: str) -> None:
        """Choose an entry where there is one: an automatic that is off, a mode that is the only one."""
        if self.features.allows(name, entry):
            self.put((name,), entry, f"camera ({name})")

    def held(self) -> tuple[Written, ...]:
        """All that was written, as it reads back now: what was written later may have moved it."""
        now = []
        for written, key in self._written.values():
            latest = Written(written.name, written.asked, self.features.read(written.name))
            self.features.check_held(latest, key)
            now.append(latest)
        return tuple(now)


def _region(writer: _Writer, settings: GenicamSettings) -> None:
    for name in ("OffsetX", "OffsetY"):  # else they would stand in the way of a wider region
        writer.put((name,), 0, "camera.offset_x", if_there=True)
    if settings.width is not None:
        writer.put(("Width",), settings.width, "camera.width")
    if settings.height is not None:
        writer.put(("Height",), settings.height, "camera.height")
    writer.put(("OffsetX",), settings.offset_x, "camera.offset_x", if_there=settings.offset_x == 0)
    writer.put(("OffsetY",), settings.offset_y, "camera.offset_y", if_there=settings.offset_y == 0)
    writer.put(("PixelFormat",), settings.pixel_format, "camera.pixel_format")


def _light(writer: _Writer, settings: GenicamSettings) -> None:
    if settings.exposure_us is not None:
        writer.choose("ExposureMode", "Timed")
        writer.choose("ExposureAuto", "Off")
        writer.put(_EXPOSURE, settings.exposure_us, "camera.exposure_us")
    if settings.gain_db is not None:
        writer.choose("GainAuto", "Off")
        writer.put(_GAIN, settings.gain_db, "camera.gain_db")
    if settings.black_level is not None:
        writer.choose("BlackLevelAuto", "Off")
        writer.put(_BLACK_LEVEL, settings.black_level, "camera.black_level")
    if settings.white_balance:
        writer.choose("BalanceWhiteAuto", "Off")
    for colour, ratio in settings.white_balance.items():
        key = f"camera.white_balance.{colour}"
        writer.put(("BalanceRatioSelector",), colour.capitalize(), key)
        writer.put(_BALANCE, ratio, key)
    if settings.frame_rate is not None:
        writer.put(_RATE_SWITCH, True, "camera.frame_rate", if_there=True)
        writer.put(_RATE, settings.frame_rate, "camera.frame_rate")


def _trigger(writer: _Writer, settings: GenicamSettings) -> None:
    writer.choose("AcquisitionMode", "Continuous")
    writer.choose("TriggerSelector", "FrameStart")
    if settings.trigger == "free":
        writer.choose("TriggerMode", "Off")
    else:
        source = "Software" if settings.trigger == "software" else settings.line
        if not writer.features.has("TriggerMode"):
            raise CameraRefused("genicam: the camera has no trigger (TriggerMode). Set camera.trigger to free.")
        writer.put(("TriggerSource",), source, "camera.trigger" if settings.trigger == "software" else "camera.line")
        if settings.trigger_activation is not None:
            writer.put(("TriggerActivation",), settings.trigger_activation, "camera.trigger_activation")
        writer.put(("TriggerMode",), "On", "camera.trigger")
    if settings.strobe is not None:
        writer.put(("LineSelector",), settings.strobe, "camera.strobe")
        writer.choose("LineMode", "Output")
        writer.put(("LineSource",), "ExposureActive", "camera.strobe")


def exposure_s(features: Features) -> float | None:
    """The exposure time that the camera holds, None where it does not tell."""
    for name in _EXPOSURE[:2]:
        if features.has(name):
            return float(features.read(name)) * 1e-6
    return None


def frame_rate(features: Features) -> float | None:
    """Frames a second of a free-running camera, None where it does not tell."""
    for name in _RATE:
        if features.has(name):
            return float(features.read(name)) or None
    return None
