"""Which camera this is: what tells it from another of the same kind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from drivers.camera import CameraRefused
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.device import TELL_WHAT_IT_IS, Device

SYSFS = Path("/sys/class/video4linux")


@dataclass(frozen=True)
class CameraIdentity:
    """A camera as its driver names it. serial: its own number, "" where it has none; bus: where it is plugged in."""

    driver: str
    card: str
    bus: str
    serial: str

    def __str__(self) -> str:
        """What stays the same over restarts: with a serial number the camera itself, else the camera in that place."""
        return f"{self.card} serial {self.serial}" if self.serial else f"{self.card} at {self.bus}"


def identify(device: Device) -> CameraIdentity:
    """The camera's identity; raise CameraRefused where the device captures no video or cannot stream it."""
    capability = device.call(v4l2.QUERYCAP, v4l2.Capability(), TELL_WHAT_IT_IS)
    identity = CameraIdentity(
        _text(capability.driver), _text(capability.card), _text(capability.bus_info), serial_number(device.node)
    )
    if not captures(capability):
        raise CameraRefused(
            f"{device.path}: {identity.card} captures no video on this node; expected a capture device. "
            "One camera may have several nodes: `combtrace cameras` lists those that give pictures."
        )
    return identity


def captures(capability: v4l2.Capability) -> bool:
    """True for a node that gives pictures by streaming."""
    has_own = capability.capabilities & v4l2.CAP_DEVICE_CAPS
    bits = capability.device_caps if has_own else capability.capabilities
    wanted = v4l2.CAP_VIDEO_CAPTURE | v4l2.CAP_STREAMING
    return bool(bits & wanted == wanted)


def serial_number(node: str, sysfs: Path = SYSFS) -> str:
    """The serial number of the USB device behind the node, "" where there is none."""
    try:
        interface = (sysfs / Path(node).name / "device").resolve(strict=True)
    except OSError:
        return ""
    for folder in (interface, interface.parent):
        try:
            return (folder / "serial").read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            continue
    return ""


def _text(raw: bytes) -> str:
    return raw.decode("utf-8", "replace").strip()
