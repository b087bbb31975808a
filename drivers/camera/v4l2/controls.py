"""A camera's controls: what there is, and settings that are written, read back and refused where they did not hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.camera import CameraRefused
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.device import Device

KINDS = {
    v4l2.CONTROL_INTEGER: "int",
    v4l2.CONTROL_BOOLEAN: "bool",
    v4l2.CONTROL_MENU: "menu",
    v4l2.CONTROL_BUTTON: "button",
    v4l2.CONTROL_INTEGER64: "int64",
    v4l2.CONTROL_STRING: "str",
    v4l2.CONTROL_BITMASK: "bitmask",
    v4l2.CONTROL_INTEGER_MENU: "intmenu",
}
SETTABLE = {"int", "bool", "menu", "bitmask", "intmenu"}
# An automatic is switched off before the value is written that it would hold: switches first, numbers after them.
SWITCHES = ("bool", "menu", "intmenu")


@dataclass(frozen=True)
class ControlInfo:
    """One control as the driver describes it now. value: None where it has none (buttons) or cannot be read so."""

    number: int
    name: str
    kind: str
    minimum: int
    maximum: int
    step: int
    default: int
    value: int | None
    inactive: bool
    read_only: bool
    volatile: bool
    menu: Mapping[int, str] = field(default_factory=dict)

    def range_text(self) -> str:
        """What it may be set to, for people: a menu's entries, or the range and its step."""
        if self.menu:
            return ", ".join(f"{value} ({text})" for value, text in sorted(self.menu.items()))
        return f"{self.minimum} to {self.maximum}" + (f" in steps of {self.step}" if self.step > 1 else "")

    def allows(self, value: int) -> bool:
        """True where the driver can take the value as it is."""
        if self.menu:
            return value in self.menu
        return self.minimum <= value <= self.maximum and (value - self.minimum) % max(1, self.step) == 0


def control_name(title: str) -> str:
    """The name of a control as `v4l2-ctl` writes it: "Exposure Time, Absolute" -> "exposure_time_absolute"."""
    words = "".join(letter.lower() if letter.isalnum() else " " for letter in title)
    return "_".join(words.split())


def list_controls(device: Device) -> list[ControlInfo]:
    """All controls that are not disabled, in the driver's order."""
    found: list[ControlInfo] = []
    query = v4l2.QueryExtControl(id=v4l2.FLAG_NEXT_CONTROL)
    while device.answers(v4l2.QUERY_EXT_CTRL, query):
        if query.type in KINDS and not query.flags & v4l2.FLAG_DISABLED:
            found.append(_described(device, query))
        query = v4l2.QueryExtControl(id=query.id | v4l2.FLAG_NEXT_CONTROL)
    return found


def apply_controls(device: Device, wanted: Mapping[str, int]) -> dict[str, int]:
    """The values that the driver reads back, by name; raise CameraRefused for one that does not hold."""
    known = {control.name: control for control in list_controls(device)}
    for name, value in wanted.items():
        _check_settable(device, name, value, known)
    in_order = sorted(wanted, key=lambda name: known[name].kind not in SWITCHES)
    for name in in_order:
        _refuse_governed(device, name, wanted[name])  # some drivers then refuse the writing, with no word of why
        setting = v4l2.Control(known[name].number, _as_int32(wanted[name]))
        device.call(v4l2.S_CTRL, setting, f"set {name} to {wanted[name]}")
    return {name: _held(device, name, wanted[name]) for name in in_order}


def exposure_s(device: Device) -> float | None:
    """The exposure time that is set, seconds; None where the camera does not tell, or chooses it by itself."""
    query = v4l2.QueryExtControl(id=v4l2.CID_EXPOSURE_ABSOLUTE)
    if not device.answers(v4l2.QUERY_EXT_CTRL, query):
        return None
    control = _described(device, query)
    return None if control.inactive or control.value is None else control.value * 1e-4


def _described(device: Device, query: v4l2.QueryExtControl) -> ControlInfo:
    kind = KINDS[query.type]
    menu = _menu(device, query, kind) if kind in ("menu", "intmenu") else {}
    current = v4l2.Control(query.id, 0)
    readable = kind in SETTABLE and not query.flags & (v4l2.FLAG_WRITE_ONLY | v4l2.FLAG_HAS_PAYLOAD)
    has_value = readable and device.answers(v4l2.G_CTRL, current)
    return ControlInfo(
        number=query.id,
        name=control_name(query.name.decode("utf-8", "replace")),
        kind=kind,
        minimum=query.minimum,
        maximum=query.maximum,
        step=query.step,
        default=query.default_value,
        value=(current.value & 0xFFFF_FFFF if kind == "bitmask" else current.value) if has_value else None,
        inactive=bool(query.flags & v4l2.FLAG_INACTIVE),
        read_only=bool(query.flags & v4l2.FLAG_READ_ONLY),
        volatile=bool(query.flags & v4l2.FLAG_VOLATILE),
        menu=menu,
    )


def _menu(device: Device, query: v4l2.QueryExtControl, kind: str) -> dict[int, str]:
    entries = {}
    for index in range(query.minimum, query.maximum + 1):
        entry = v4l2.QueryMenu(id=query.id, index=index)
        if device.answers(v4l2.QUERYMENU, entry):
            text = bytes(entry.u.name).split(b"\0")[0].decode("utf-8", "replace")
            entries[index] = text if kind == "menu" else str(entry.u.value)
    return entries


def _check_settable(device: Device, name: str, value: int, known: Mapping[str, ControlInfo]) -> None:
    control = known.get(name)
    if control is None:
        names = ", ".join(sorted(known)) or "none"
        raise CameraRefused(f"{device.path}: no control {name!r}; there are: {names}. Correct camera.controls.")
    if control.kind not in SETTABLE or control.read_only or control.value is None:
        kind = "read-only" if control.read_only else f"of kind {control.kind}"
        raise CameraRefused(
            f"{device.path}: control {name} is {kind}, it cannot be set. Take it out of camera.controls."
        )
    if not control.allows(value):
        expected = control.range_text()
        raise CameraRefused(
            f"{device.path}: control {name} = {value}; expected {expected}. Correct camera.controls.{name}."
        )


def _as_int32(value: int) -> int:
    """A bitmask's 32 bits as the signed number that the kernel's structure holds."""
    return value - (1 << 32) if value >= 1 << 31 else value


def _refuse_governed(device: Device, name: str, value: int) -> ControlInfo:
    """The control as it is now; raise CameraRefused where an automatic governs it."""
    control = next(control for control in list_controls(device) if control.name == name)
    if control.inactive:
        raise CameraRefused(
            f"{device.path}: control {name} = {value} does not hold, it is inactive: an automatic governs it. "
            "Switch the automatic off in camera.controls too, such as gain_automatic: 0 or auto_exposure: 1."
        )
    return control


def _held(device: Device, name: str, value: int) -> int:
    """The value read back; raise CameraRefused where the device holds another, or is not governed by it."""
    control = _refuse_governed(device, name, value)
    if control.value != value:
        raise CameraRefused(
            f"{device.path}: control {name} was set to {value} and reads back {control.value}; expected {value}. "
            f"The device does not take it: choose another value ({control.range_text()})."
        )
    return value
