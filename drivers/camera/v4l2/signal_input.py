"""Inputs of a capture card: which one, and the timings of a digital signal on it."""

from __future__ import annotations

from drivers.camera import CameraRefused, CameraUnavailable
from drivers.camera.v4l2 import kernel_interface as v4l2
from drivers.camera.v4l2.device import Device, enumerated


def select_input(device: Device, number: int | None) -> None:
    """Switch to an input, None = leave it, and follow the timings of a digital signal there.

    Raises CameraRefused where there is no such input, CameraUnavailable where no signal arrives.
    """
    inputs = list(enumerated(device, v4l2.ENUMINPUT, lambda index: v4l2.Input(index=index)))
    if number is not None and inputs:
        if number >= len(inputs):
            names = ", ".join(f"{entry.index} ({input_name(entry)})" for entry in inputs)
            raise CameraRefused(f"{device.path}: no input {number}; there are {names}. Correct camera.input.")
        device.call_number(v4l2.S_INPUT, number, f"switch to input {number}")
    if not inputs:
        return
    current = v4l2.Input(index=device.call_number(v4l2.G_INPUT, 0, "tell its input"))
    if device.answers(v4l2.ENUMINPUT, current) and current.capabilities & v4l2.INPUT_CAPABILITY_DV_TIMINGS:
        _follow_signal(device, input_name(current))


def input_name(entry: v4l2.Input) -> str:
    """The name that the driver gives an input."""
    return bytes(entry.name).split(b"\0")[0].decode("utf-8", "replace")


def _follow_signal(device: Device, name: str) -> None:
    timings = v4l2.DvTimings()
    if not device.answers(v4l2.QUERY_DV_TIMINGS, timings):
        raise CameraUnavailable(f"{device.path}: no signal on its input {name}; expected a picture. Check the source.")
    device.call(v4l2.S_DV_TIMINGS, timings, "follow the signal's timings")
