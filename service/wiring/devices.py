"""Drivers as the configuration names them, not yet opened, and what of them is this daemon's alone."""

from __future__ import annotations

from drivers.camera import Camera
from drivers.camera.averaging import AveragingCamera
from drivers.camera.files.camera import FileCamera
from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.modbus import client as modbus
from drivers.trigger import PulseTrigger
from drivers.trigger.pulses import SerialBytes, SerialSignal
from drivers.trigger.serial import SerialLineTrigger
from service.config import cameras
from service.config.cameras import FilesCamera
from service.config.config import Config
from service.config.controllers import ModbusRtu, ModbusRtuOverTcp, ModbusTcp, NoController
from service.config.triggers import SerialTrigger as SerialTriggerSettings
from service.daemon.lock import network_names, serial_name

BURST_SILENCE_S = 0.2
LEVEL_HOLDS_S = 0.05


def make_camera(config: Config) -> Camera:
    """The camera's driver, not yet opened."""
    camera = _single_frames(config)
    return camera if config.camera.average == 1 else AveragingCamera(camera, config.camera.average)


def single_frames(camera: Camera) -> Camera:
    """The camera that gives its frames one by one: who lays a block moves, and averages refuse what moves."""
    return camera.single if isinstance(camera, AveragingCamera) else camera


def _single_frames(config: Config) -> Camera:
    settings = config.camera
    if isinstance(settings, FilesCamera):
        return FileCamera(settings.path, loop=settings.loop, watch=settings.watch, move_to=settings.move_to)
    if isinstance(settings, cameras.GenicamCamera):
        return _genicam(settings)
    return V4l2Camera(
        V4l2Settings(
            device=str(settings.device),
            width=settings.width,
            height=settings.height,
            pixel_format=settings.pixel_format,
            frame_rate=settings.frame_rate,
            controls=settings.controls,
            input=settings.input,
            exposure_s=None if settings.exposure_ms is None else settings.exposure_ms / 1000,
            latency_s=settings.latency_ms / 1000,
        )
    )


def _genicam(settings: cameras.GenicamCamera) -> Camera:
    # Loaded only where it is configured: others need not wait for it.
    from drivers.camera.genicam.camera import GenicamCamera
    from drivers.camera.genicam.settings import GenicamSettings

    same = settings.model_dump(exclude={"kind", "packet_size", "timeout_s", "latency_ms", "average", "warm_up_s"})
    packet_size = 0 if settings.packet_size == "auto" else settings.packet_size
    latency_s = settings.latency_ms / 1000
    return GenicamCamera(GenicamSettings(**same, packet_size=packet_size, latency_s=latency_s))


def make_controller(config: Config) -> modbus.ModbusController | None:
    """The controller's driver, None for `kind: none`."""
    settings = config.controller
    if isinstance(settings, NoController):
        return None
    layout = mailbox_layout(config)
    assert layout is not None
    limits = modbus.RequestLimits(settings.longest_write, settings.longest_read)
    shared = settings.device_id, layout, settings.timeout_s, limits, settings.single_write
    if isinstance(settings, ModbusTcp):
        return modbus.ModbusTcpController(settings.host, settings.port, *shared)
    if isinstance(settings, ModbusRtuOverTcp):
        return modbus.ModbusRtuOverTcpController(settings.host, settings.port, *shared, baudrate=settings.baudrate)
    rs485 = None if settings.rs485 is None else modbus.Rs485(**settings.rs485.model_dump())
    line = modbus.SerialLine(
        settings.port, settings.baudrate, settings.parity, settings.stop_bits, rs485=rs485, echo=settings.echo
    )
    return modbus.ModbusRtuController(line, *shared)


def mailbox_layout(config: Config) -> MailboxLayout | None:
    """Where the mailbox lies in the controller's registers, None for `kind: none`."""
    settings = config.controller
    if isinstance(settings, NoController):
        return None
    return MailboxLayout(
        settings.link_address,
        settings.service_address,
        settings.contour_address,
        settings.payload_capacity,
        settings.word_order,
        None if settings.part_block is None else settings.part_block.address,
        0 if settings.part_block is None else settings.part_block.capacity,
    )


def controller_words(config: Config) -> str:
    """What the controller is, for a person: its kind, and where."""
    controller = config.controller
    if isinstance(controller, NoController):
        return controller.kind
    where = f"{controller.host}:{controller.port}" if not isinstance(controller, ModbusRtu) else controller.port
    return f"{controller.kind} {where}"


def controller_names(config: Config) -> list[str]:
    """What of the controller must be this daemon's alone on this machine; nothing for one that only observes."""
    settings = config.controller
    if isinstance(settings, ModbusRtu):
        return [serial_name(settings.port)]
    if isinstance(settings, NoController) or settings.mode == "observe":
        return []
    unit = settings.device_id if isinstance(settings, ModbusTcp) else None
    return network_names(settings.host, settings.port, unit)


def make_serial_port(trigger: SerialTriggerSettings) -> SerialLineTrigger | PulseTrigger:
    """The driver of a serial trigger, whatever its mode, not yet opened."""
    if trigger.mode == "text":
        return SerialLineTrigger(trigger.port, trigger.baudrate)
    if trigger.mode == "byte":
        return SerialBytes(trigger.port, trigger.baudrate, trigger.debounce_s or BURST_SILENCE_S)
    hold_s = trigger.debounce_s or LEVEL_HOLDS_S
    return SerialSignal(trigger.port, trigger.signal, trigger.edge, hold_s, baudrate=trigger.baudrate)
