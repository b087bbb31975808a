"""Aravis' errors, told once in the house's own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.camera import CameraRefused, CameraUnavailable
from drivers.camera.genicam.binding import aravis, error_type


@contextmanager
def told(source: str, doing: str) -> Iterator[None]:
    """Raise what Aravis raises as CameraUnavailable where the camera does not answer, else as CameraRefused."""
    try:
        yield
    except error_type() as error:
        codes = aravis().DeviceError
        gone = (codes.TIMEOUT, codes.NOT_CONNECTED, codes.NOT_CONTROLLER, codes.NOT_FOUND, codes.TRANSFER_ERROR)
        code, message = getattr(error, "code", None), getattr(error, "message", str(error))
        if code in tuple(int(entry) for entry in gone):
            raise CameraUnavailable(
                f"{source}: no answer when it was to {doing} ({message}). Check the camera's cable and power."
            ) from error
        raise CameraRefused(f"{source}: does not {doing}: {message}.") from error
