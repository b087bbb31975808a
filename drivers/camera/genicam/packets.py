"""Size and pause of a GigE Vision camera's packets, and what helps where some are lost."""

from __future__ import annotations

import logging

from drivers.camera import CameraRefused
from drivers.camera.genicam.binding import aravis, error_type
from drivers.camera.genicam.device import Device
from drivers.camera.genicam.errors import told
from drivers.camera.genicam.settings import GenicamSettings

log = logging.getLogger("combtrace.camera")

LOST_PACKETS = (
    "Where packets are lost: use a network card and cable for this camera alone, packets of 9000 bytes on both ends "
    "(or camera.packet_size: 1400), a larger net.core.rmem_max, a larger camera.packet_delay_ns."
)


def negotiated(device: Device, settings: GenicamSettings) -> int:
    """The packet size, bytes, as asked for or as the network carries; raise CameraRefused, CameraUnavailable."""
    camera, source = device.camera, device.source
    # Frames through a socket of the kernel's: the way round it needs root, and then brought nothing on a trial.
    camera.gv_set_stream_options(aravis().GvStreamOption.PACKET_SOCKET_DISABLED)
    if settings.packet_size:
        with told(source, f"take packets of {settings.packet_size} bytes (camera.packet_size)"):
            camera.gv_set_packet_size(settings.packet_size)
    else:
        try:
            camera.gv_auto_packet_size()
        except error_type() as error:  # some cameras send no test packets; what they are set to may do
            log.warning("%s: the packet size cannot be negotiated (%s); camera.packet_size sets one", source, error)
    if settings.packet_delay_ns is not None:
        with told(source, f"pause {settings.packet_delay_ns} ns between packets (camera.packet_delay_ns)"):
            camera.gv_set_packet_delay(settings.packet_delay_ns)
    with told(source, "tell the size of its packets"):
        size = int(camera.gv_get_packet_size())
    if settings.packet_size and size != settings.packet_size:
        raise CameraRefused(
            f"{source}: asked for packets of {settings.packet_size} bytes, the camera holds {size}. Correct "
            "camera.packet_size."
        )
    return size
