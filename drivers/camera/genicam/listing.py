"""The GenICam cameras that answer, and the one of a serial number or user name among them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivers.camera import CameraUnavailable
from drivers.camera.genicam.binding import aravis
from drivers.camera.genicam.gvcp import GigeQuestions

GIGE = "GigEVision"


@dataclass(frozen=True)
class GenicamIdentity:
    """A camera as it names itself. device_id: Aravis' name for it; address: a network address, "" for one on USB."""

    vendor: str
    model: str
    serial: str
    protocol: str
    device_id: str
    address: str
    user_name: str = ""

    def __str__(self) -> str:
        return f"{self.vendor} {self.model} serial {self.serial}"


def list_cameras() -> list[GenicamIdentity]:
    """The cameras that answer within a second, sorted by their names; raise CameraRefused without Aravis."""
    library = aravis()
    library.update_device_list()
    found = [_identity(library, index) for index in range(library.get_n_devices())]
    return sorted(found, key=str)


def find_camera(serial: str, user_name: str) -> GenicamIdentity:
    """The camera of that serial number, else of that user name; raise CameraUnavailable, telling which there are."""
    cameras = list_cameras()
    wanted = [one for one in cameras if (one.serial == serial if serial else one.user_name == user_name)]
    called = f"serial {serial}" if serial else f"user name {user_name}"
    if len(wanted) == 1:
        return wanted[0]
    if wanted:
        raise CameraUnavailable(
            f"genicam {called}: {len(wanted)} cameras answer to it ({', '.join(map(str, wanted))}); expected one. "
            "Name it by camera.serial."
        )
    seen = ", ".join(f"{one}{f' ({one.user_name})' if one.user_name else ''}" for one in cameras) or "none"
    raise CameraUnavailable(
        f"genicam {called}: no such camera answers; there are: {seen}. Check its power and cable, that its address is "
        "in the network of this machine's card, and that no firewall stops UDP."
    )


def _identity(library: Any, index: int) -> GenicamIdentity:
    protocol = library.get_device_protocol(index) or ""
    address = (library.get_device_address(index) or "") if protocol == GIGE else ""
    return GenicamIdentity(
        library.get_device_vendor(index) or "",
        library.get_device_model(index) or "",
        library.get_device_serial_nbr(index) or "",
        protocol,
        library.get_device_id(index),
        address,
        _user_name(address) if address else "",
    )


def _user_name(address: str) -> str:
    questions = GigeQuestions(address)
    try:
        return questions.user_name()
    finally:
        questions.close()
