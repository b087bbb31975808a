"""The cameras of this machine: what each is, and what it offers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from drivers.camera import CameraUnavailable
from drivers.camera.v4l2.controls import ControlInfo, list_controls
from drivers.camera.v4l2.device import Device
from drivers.camera.v4l2.formats import FormatInfo, list_formats
from drivers.camera.v4l2.identity import CameraIdentity, identify

DEV = Path("/dev")


@dataclass(frozen=True)
class CameraInfo:
    """One capture node. names: those below /dev/v4l, which keep to this camera or to its place when numbers change."""

    device: str
    names: tuple[str, ...]
    identity: CameraIdentity
    formats: tuple[FormatInfo, ...]
    controls: tuple[ControlInfo, ...]


@dataclass(frozen=True)
class Unreadable:
    """A node that could not be asked, and why."""

    device: str
    why: str


def list_cameras() -> list[CameraInfo]:
    """The capture nodes that answer, by number; nodes that capture nothing are left out."""
    return [found for found in look_at_nodes() if isinstance(found, CameraInfo)]


def look_at_nodes(dev: Path = DEV) -> list[CameraInfo | Unreadable]:
    """All video nodes by number: capture nodes as CameraInfo, those one may not open as Unreadable."""
    nodes = sorted(dev.glob("video[0-9]*"), key=lambda path: int("0" + path.name.removeprefix("video")))
    return [found for node in nodes if (found := _look_at(node, dev)) is not None]


def sharing_a_device(cameras: Iterable[CameraInfo]) -> list[tuple[CameraInfo, ...]]:
    """Groups of capture nodes that belong to one device: opening both at once may starve one of them."""
    groups: dict[tuple[str, str], list[CameraInfo]] = {}
    for camera in cameras:
        groups.setdefault((camera.identity.driver, camera.identity.bus), []).append(camera)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def _look_at(node: Path, dev: Path) -> CameraInfo | Unreadable | None:
    try:
        device = Device(str(node))
    except CameraUnavailable as error:
        return Unreadable(str(node), str(error))
    try:
        identity = identify(device)
        formats, controls = tuple(list_formats(device)), tuple(list_controls(device))
    except CameraUnavailable:
        return None  # a node of another kind: an output, metadata, a radio
    finally:
        device.close()
    return CameraInfo(str(node), _names(node, dev), identity, formats, controls)


def _names(node: Path, dev: Path) -> tuple[str, ...]:
    links = sorted((dev / "v4l").glob("by-*/*"))
    return tuple(str(link) for link in links if link.resolve() == node.resolve())
