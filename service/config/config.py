"""The configuration's models: what config.yaml may say, with bounds, units and a sentence for each key.

Unknown keys are refused everywhere. Paths are resolved by `service.config.config_file`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from contour.geometry.rings import ring_defect
from contour.polygon.start_vertex import Start
from contour.tracing.trace import Method
from service.config.values import REGISTERS, FilePath, Host, MistakeAt, Model, Number, Point, Port, Register, Seconds

DEFAULT_METHOD: Method = "wall-tips"
METHOD_PARAMETERS: dict[str, dict[str, tuple[float, float]]] = {
    "wall-tips": {},
    "sliding-matrix": {"core_px": (1, 1000), "step_px": (1, 2000), "threshold": (0, 255)},
    "direct-scan": {"max_gap_px": (0, 100_000), "min_width_px": (0, 100_000)},
    "find-contours": {},
}
BLOCK_REGISTERS = 16
HEADER_REGISTERS = 32


class FilesCamera(Model):
    """Pictures from files: for tests, demonstrations, and replays."""

    kind: Literal["files"]
    path: FilePath = Field(
        description="A picture or video, or a folder whose pictures and videos are taken in the order of their names."
    )
    loop: bool = Field(True, description="Begin again after the last picture.")
    watch: bool = Field(False, description="Wait for files that other software writes; needs loop: false.")
    move_to: FilePath | None = Field(
        None, description="Folder that files are moved to once they were read; needs loop: false. none = they stay."
    )
    timeout_s: Seconds = Field(5.0, description="Longest wait for a watched-for file, s.")
    average: int = Field(
        1, ge=1, le=64, description="Frames of a still scene that are averaged; 103 where it moves. 1 = none."
    )

    @model_validator(mode="after")
    def _a_loop_keeps_its_files(self) -> Self:
        if self.loop and (self.watch or self.move_to is not None):
            key = "watch" if self.watch else "move_to"
            raise ValueError(f"{key} is set and loop is true: files are taken once or again and again. Set loop: false")
        return self


class V4l2Camera(Model):
    """A camera of the Linux kernel's Video4Linux2."""

    kind: Literal["v4l2"]
    device: FilePath = Field(description="Device file; one below /dev/v4l/by-id keeps its name when it is replugged.")
    width: int = Field(ge=16, le=32_768, description="Width of the picture, px.")
    height: int = Field(ge=16, le=32_768, description="Height of the picture, px.")
    pixel_format: str = Field(
        "YUYV", min_length=3, max_length=4, description="Four-character code of the pixel format."
    )
    frame_rate: float | None = Field(None, gt=0, le=1000, description="Frames a second; none = the driver's default.")
    controls: dict[str, int] = Field(
        default_factory=dict, description="Controls to write at each open, by their names."
    )
    timeout_s: Seconds = Field(5.0, description="Longest wait for a frame, s.")
    input: int | None = Field(None, ge=0, le=255, description="Input of a capture card by its number; none = as it is.")
    exposure_ms: float | None = Field(
        None,
        ge=0,
        le=60_000,
        description="Exposure time where the camera does not tell it, ms; none = one frame period is assumed.",
    )
    latency_ms: float = Field(
        0,
        ge=0,
        le=10_000,
        description="How long the camera keeps a frame, beyond exposure and reading out, before it sends it, ms.",
    )
    average: int = Field(
        1, ge=1, le=64, description="Frames of a still scene that are averaged; 103 where it moves. 1 = none."
    )
    warm_up_s: float = Field(
        0,
        ge=0,
        le=7200,
        description="Time after opening in which no trigger is taken, s: calibration holds for a warm camera. After an "
        "interruption at most as long as that was.",
    )


class Calibration(Model):
    """Where pixels become millimetres."""

    file: FilePath = Field(description="Calibration file.")
    max_age_days: float = Field(0, ge=0, le=36_500, description="Oldest accepted calibration, days; 0 = no limit.")
    sentinel_tolerance_px: float = Field(
        1.0, ge=0.05, le=1000, description="How far a fixed mark may lie from where the calibration saw it, px."
    )
    sentinels_required: bool = Field(
        True, description="Refuse where the calibration has fixed marks and none of them is seen."
    )


class NoController(Model):
    """No controller: contours are traced and go nowhere; the journal keeps a summary of each job."""

    kind: Literal["none"]
    ready_timeout_s: Seconds = Field(30, description="Longest wait for the service to be ready, s.")


class ModbusController(Model):
    """What all controllers on Modbus share."""

    device_id: int = Field(1, ge=1, le=255, description="Modbus device id (unit); 0, a broadcast, is never answered.")
    word_order: Literal["big", "little"] = Field(
        "big", description="Order of the two registers of a 32-bit value: big = ABCD, little = CDAB."
    )
    handshake: Literal["full", "none"] = Field(
        "full", description="none: a controller that cannot answer; jobs end as written, never as accepted."
    )
    mode: Literal["send", "observe"] = Field(
        "send", description="observe: make every contour and write nothing, to run beside an old process."
    )
    readback: bool = Field(True, description="Read each page back before it is committed.")
    link_address: Register = Field(
        0, description="First register of the block that the controller writes (PDU address)."
    )
    service_address: Register = Field(
        16, description="First register of the block that the service writes (PDU address)."
    )
    contour_address: Register = Field(32, description="First register of header and payload (PDU address).")
    payload_capacity: int = Field(1984, ge=8, le=REGISTERS, description="Registers of payload, an even number.")
    longest_write: int = Field(
        123,
        ge=16,
        le=123,
        description="Most registers in one write; blocks of 16 go whole, the standard's most is 123.",
    )
    longest_read: int = Field(
        125, ge=16, le=125, description="Most registers in one read; blocks of 16 go whole, the standard's most is 125."
    )
    single_write: Literal["fc6", "fc16"] = Field(
        "fc6", description="How `transfer` is written; fc16 (of one register): for a controller without FC6."
    )
    timeout_s: Seconds = Field(1.0, description="Longest wait for the reply to one request, s.")
    poll_period_s: float = Field(0.05, ge=0.001, le=0.5, description="Period of looking at the controller's block, s.")
    heartbeat_timeout_s: float = Field(
        3.0, ge=1.0, le=3600, description="Longest time without a change of the controller's heartbeat, s."
    )
    ready_timeout_s: Seconds = Field(30, description="Longest wait for the controller to be ready for a contour, s.")
    ack_timeout_s: Seconds = Field(5, description="Longest wait for the answer to a page, s.")
    max_repeats: int = Field(3, ge=1, le=100, description="Attempts in vain after which a job is withdrawn.")
    valid_for_s: float = Field(
        30, ge=0, le=86_400, description="Age at which the controller refuses a contour, s; 0 = no limit."
    )
    job_timeout_s: Seconds = Field(120, description="Longest wait to deliver a contour where valid_for_s is 0, s.")

    @field_validator("payload_capacity")
    @classmethod
    def _even(cls, value: int) -> int:
        if value % 2:
            raise ValueError(f"is {value}, expected an even number: 32-bit values take two registers")
        return value

    @model_validator(mode="after")
    def _fits(self) -> Self:
        blocks = {
            "link_address": (self.link_address, BLOCK_REGISTERS),
            "service_address": (self.service_address, BLOCK_REGISTERS),
            "contour_address": (self.contour_address, HEADER_REGISTERS + self.payload_capacity),
        }
        for name, (start, length) in blocks.items():
            if start + length > REGISTERS:
                raise ValueError(f"{name} {start} and {length} registers end at {start + length - 1}, past 65535")
        for (one, (start, length)), (other, (other_start, other_length)) in combinations(blocks.items(), 2):
            if start < other_start + other_length and other_start < start + length:
                raise ValueError(
                    f"{one} ({start} to {start + length - 1}) and {other} "
                    f"({other_start} to {other_start + other_length - 1}) overlap"
                )
        if self.ack_timeout_s <= self.poll_period_s:
            raise ValueError(f"ack_timeout_s is {self.ack_timeout_s:g}, expected more than poll_period_s")
        return self


class ModbusTcp(ModbusController):
    """A controller over Modbus TCP."""

    kind: Literal["modbus-tcp"]
    device_id: int = Field(
        1, ge=0, le=255, description="Modbus device id (unit); 0 and 255: the device itself, behind no gateway."
    )
    host: Host = Field("127.0.0.1", description="Host name or address of the controller.")
    port: Port = Field(502, description="TCP port.")


class Rs485(Model):
    """A transceiver that the kernel's driver switches between sending and receiving by RTS."""

    rts_level_for_tx: bool = Field(True, description="Level of RTS while sending.")
    rts_level_for_rx: bool = Field(False, description="Level of RTS while receiving.")
    delay_before_tx_s: float = Field(0, ge=0, le=1, description="From RTS to the first character, s.")
    delay_before_rx_s: float = Field(0, ge=0, le=1, description="From the last character to RTS, s.")


class ModbusRtu(ModbusController):
    """A controller over Modbus RTU on a serial port."""

    kind: Literal["modbus-rtu"]
    port: str = Field(min_length=1, description="Serial port; one below /dev/serial/by-id keeps its name.")
    baudrate: int = Field(115_200, ge=300, le=4_000_000, description="Baud rate.")
    parity: Literal["N", "E", "O"] = Field("N", description="Parity.")
    stop_bits: Literal[1, 2] = Field(1, description="Stop bits.")
    rs485: Rs485 | None = Field(
        None, description="Keys below; none = RS-232, or a converter that switches its transceiver itself."
    )
    echo: bool = Field(False, description="What is sent comes back, as on two wires with a receiver that stays on.")


class ModbusRtuOverTcp(ModbusController):
    """A controller over Modbus RTU frames in a TCP connection (a serial server)."""

    kind: Literal["modbus-rtu-over-tcp"]
    host: Host = Field("127.0.0.1", description="Host name or address of the serial server.")
    port: Port = Field(4001, description="TCP port.")
    baudrate: int = Field(
        9600, ge=300, le=4_000_000, description="Baud rate of the line behind the serial server: silence and time-outs."
    )


class IntervalTrigger(Model):
    """A job at equal intervals."""

    kind: Literal["interval"]
    period_s: Annotated[float, Field(ge=0.05, le=86_400)] = Field(description="Period, s.")


class ControllerTrigger(Model):
    """A job when the controller asks for one."""

    kind: Literal["controller"]


class SerialTrigger(Model):
    """A job by hand, over a serial port: by lines of text, by any byte, or by an edge of an input line."""

    kind: Literal["serial"]
    port: str = Field(
        min_length=1,
        description="Serial port; one below /dev/serial/by-id keeps its name. With byte and signal also "
        "rfc2217://HOST:PORT of a serial server.",
    )
    baudrate: int = Field(9600, ge=300, le=4_000_000, description="Baud rate.")
    mode: Literal["text", "byte", "signal"] = Field(
        "text", description="text: lines of TRIG, STAT, PING. byte: any byte. signal: an edge of CTS or DSR."
    )
    debounce_s: Annotated[float, Field(ge=0.001, le=10)] | None = Field(
        None,
        description="byte: bytes closer than this are one trigger, s, else 0.2. signal: how long the new level must "
        "hold, s, else 0.05.",
    )
    signal: Literal["cts", "dsr"] = Field("cts", description="mode signal: the input line that is watched.")
    edge: Literal["rising", "falling"] = Field(
        "rising", description="mode signal: rising = the line becomes asserted (contact closes), falling = it ends."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.mode == "text" and "://" in self.port:
            raise ValueError(f"port is {self.port}, but mode text needs a serial port of this machine")
        if "://" in self.port and not self.port.startswith("rfc2217://"):
            raise ValueError(f"port is {self.port}, expected a serial port of this machine or rfc2217://HOST:PORT")
        foreign = self.model_fields_set & _OF_OTHER_MODES[self.mode]
        if foreign:
            raise ValueError(f"{', '.join(sorted(foreign))} is given, but means nothing in mode {self.mode}")
        return self


_OF_OTHER_MODES: dict[str, set[str]] = {
    "text": {"debounce_s", "signal", "edge"},
    "byte": {"signal", "edge"},
    "signal": set(),
}


class Gcode(Model):
    """How G-code of a contour moves; heights above the table."""

    feed_mm_min: float = Field(3000, gt=0, le=1e6, description="Feed along the rings, mm/min.")
    plunge_mm_min: float = Field(600, gt=0, le=1e6, description="Feed downwards, mm/min.")
    safe_z_mm: float | None = Field(
        None, ge=0, le=10_000, description="Height between rings, mm; none = 20 mm above the block."
    )
    cut_z_mm: float | None = Field(
        None, ge=-1000, le=10_000, description="Height along the rings, mm; none = the safe height, a dry run."
    )
    path_tolerance_mm: float = Field(0.01, gt=0, le=10, description="How far corners may be rounded (G64 P), mm.")
    direction: Literal["climb", "conventional"] = Field(
        "climb", description="climb: the material is on the right of the way; conventional: on the left."
    )
    lead_in_mm: float = Field(
        0, ge=0, le=1000, description="Straight way onto each ring through what is no material, mm; 0 = none."
    )
    template: FilePath | None = Field(None, description="Program around $rings; none = one for LinuxCNC.")


class Recipe(Model):
    """A block type: how it is traced and what is accepted."""

    number: int = Field(ge=1, le=65_535, description="Number by which triggers name it.")
    name: str = Field(min_length=1, max_length=80, description="Name for people.")
    method: Method = Field(DEFAULT_METHOD, description="How the contour is traced.")
    thickness_mm: float = Field(20, ge=0, le=10_000, description="Height of the block's top above the table, mm.")
    tolerance_mm: float = Field(0.1, ge=0, le=100, description="Largest shift by leaving vertices out, mm.")
    thickness_tolerance_mm: float = Field(
        0, ge=0, le=1000, description="How far the block's top may lie from that height, mm."
    )
    max_uncertainty_mm: float = Field(
        0, ge=0, le=1000, description="Largest accepted 95 % bound on the contour's position, mm; 0 = not checked."
    )
    max_disagreement_pitches: float = Field(
        2.0,
        ge=0,
        le=1000,
        description="How far contour and busy part of the picture may be apart in one place, cell pitches, and an "
        "eighth of it everywhere; 0 = not checked.",
    )
    margin_mm: float = Field(
        0,
        ge=-1000,
        le=1000,
        description="How far the polygon's edges are moved into the material, mm: the exterior shrinks, holes grow; "
        "negative = out of it.",
    )
    start: Literal["traced", "lower-left", "lower-right", "upper-left", "upper-right"] | Point = Field(
        "traced",
        description="Vertex at which each ring begins: as traced, the outermost towards a corner, or the nearest to a "
        "point [x, y] in mm; all in the machine frame.",
    )
    max_vertices: int = Field(4000, ge=3, le=1_000_000, description="Most vertices of all rings together.")
    budget_mm: float = Field(
        0,
        ge=0,
        le=100,
        description="Most material that may be given up so that there are no more than max_vertices, mm; 0 = none.",
    )
    min_area_mm2: float = Field(100, ge=0, le=4e9, description="Smallest accepted area, mm², holes taken off.")
    max_area_mm2: float = Field(4_000_000, gt=0, le=4e9, description="Largest accepted area, mm², holes taken off.")
    polarity: Literal["auto", "bright", "dark"] = Field("auto", description="Walls against the table.")
    binarize: Literal["flat", "otsu"] | Annotated[int, Field(ge=0, le=255)] = Field(
        "flat", description="How walls are told from gaps: flat, otsu, or a fixed grey level 0 to 255."
    )
    edge: Literal["cut", "cells"] = Field("cut", description="cut: cells are cut open at the edge; cells: closed.")
    pieces: Literal["one", "largest"] = Field(
        "one", description="one: other blocks in view are refused; largest: smaller ones are not."
    )
    roi_px: tuple[Number, ...] = Field(
        (), description="Nothing is seen outside of it: left, top, right, bottom, px; none = the whole picture."
    )
    roi_mm: tuple[Number, ...] = Field(
        (), description="The same in the machine frame, at the block's top: left, bottom, right, top, mm."
    )
    exports: tuple[Literal["dxf", "svg", "geojson", "gcode"], ...] = Field(
        (), description="Forms in which an accepted contour is kept in the archive: dxf, svg, geojson, gcode."
    )
    gcode: Gcode = Field(Gcode(), description="How G-code moves.")
    parameters: dict[str, Number] = Field(
        default_factory=dict, description="Sizes of the method; left out, they follow from the picture."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.method == "wall-tips" and self.binarize != "flat":
            raise ValueError(
                f"binarize is {self.binarize!r}, but wall-tips finds its own threshold; use flat, or another method"
            )
        if self.roi_px and self.roi_mm:
            raise ValueError("roi_px and roi_mm are both given, expected one of them")
        if self.min_area_mm2 >= self.max_area_mm2:
            raise ValueError(
                f"min_area_mm2 is {self.min_area_mm2:g}, expected less than max_area_mm2, {self.max_area_mm2:g}"
            )
        known = METHOD_PARAMETERS[self.method]
        for name, value in self.parameters.items():
            if name not in known:
                there = ", ".join(known) or "none"
                owner = next((f"; {name} is {other}'s" for other, its in METHOD_PARAMETERS.items() if name in its), "")
                raise ValueError(f"parameters.{name} is none of {self.method}'s; there are: {there}{owner}")
            low, high = known[name]
            if not low <= value <= high:
                raise ValueError(f"parameters.{name} is {value:g}, expected {low:g} to {high:g}")
            if name.endswith("_px") and value != int(value):
                raise ValueError(f"parameters.{name} is {value:g}, expected a whole number of pixels")
        return self

    @property
    def needs_millimetres(self) -> str | None:
        """The first of its keys that means nothing without a calibration."""
        meant = {"roi_mm": self.roi_mm, "margin_mm": self.margin_mm, "start": isinstance(self.start, tuple)}
        return next((key for key, value in meant.items() if value), None)

    @property
    def first_vertex(self) -> Start | None:
        """Where rings begin; None = as traced."""
        return None if self.start == "traced" else self.start

    @field_validator("roi_px", "roi_mm")
    @classmethod
    def _box(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if value and (len(value) != 4 or value[0] >= value[2] or value[1] >= value[3]):
            raise ValueError(
                f"is {list(value)}, expected four numbers, the third above the first and the fourth above the second"
            )
        return value


class Table(Model):
    """The empty table as `combtrace teach-table` stores it."""

    file: FilePath = Field(description="File of the taught table; used where it is there.")


class Service(Model):
    """Where the service keeps its state, and how it queues."""

    state_dir: FilePath = Field(Path("var"), description="Folder of the lock and other state.")
    queue_depth: int = Field(
        0, ge=0, le=100, description="Triggers that may wait while a job is executed; 0 = they are refused as busy."
    )


class JournalSettings(Model):
    """Where jobs are kept."""

    path: FilePath = Field(Path("var/journal.sqlite"), description="SQLite file.")
    max_jobs: int = Field(500_000, ge=1000, le=10**9, description="Most jobs kept; the oldest are let go.")
    min_free_bytes: int = Field(
        50_000_000,
        ge=0,
        le=10**15,
        description="Free bytes of the journal's disk below which no trigger is taken (160 storage_full); 0 = none.",
    )


class ArchiveSettings(Model):
    """Where evidence of jobs is kept: frame, overlay, and a document with all that a replay needs."""

    path: FilePath = Field(Path("var/archive"), description="Folder.")
    max_bytes: int = Field(
        2_000_000_000, ge=0, le=10**15, description="Most bytes kept, the oldest are let go; 0 = nothing is kept."
    )
    min_free_bytes: int = Field(
        500_000_000,
        ge=0,
        le=10**15,
        description="Free bytes of the archive's disk that evidence leaves, whatever that costs it.",
    )


class Metrics(Model):
    """Figures for Prometheus over HTTP; needs the extra combtrace[metrics]."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(9771, description="TCP port.")


class Page(Model):
    """The operator's page and its REST interface over HTTP; needs the extra combtrace[page]."""

    host: Host = Field("127.0.0.1", description="Address to listen on; anything but loopback is open to the network.")
    port: Port = Field(9770, description="TCP port.")
    names: tuple[str, ...] = Field(
        (), description="Host names by which browsers may call it, besides its own address and localhost."
    )
    token_file: FilePath | None = Field(
        None, description="File of mode 0600, a line 'name token' a person; none = the page can only be looked at."
    )
    language: Literal["en", "ru"] = Field("en", description="What the page speaks until a person chooses.")
    certificate: FilePath | None = Field(None, description="TLS certificate chain, PEM; none = plain HTTP.")
    key: FilePath | None = Field(None, description="Private key of the certificate, PEM.")

    @model_validator(mode="after")
    def _certificate_with_key(self) -> Self:
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key: only one of them is given, expected both or none")
        return self


class Log(Model):
    """The log on standard error."""

    format: Literal["text", "json"] = Field("text", description="json: one object a line, with fields.")
    level: Literal["debug", "info", "warning", "error"] = Field("info", description="Least level that is written.")


Camera = Annotated[FilesCamera | V4l2Camera, Field(discriminator="kind")]
Controller = Annotated[NoController | ModbusTcp | ModbusRtu | ModbusRtuOverTcp, Field(discriminator="kind")]
Trigger = Annotated[IntervalTrigger | ControllerTrigger | SerialTrigger, Field(discriminator="kind")]


def _repeated(values: list[Any]) -> Iterator[tuple[int, Any]]:
    """Index and value of each that stood before already; None counts as none."""
    return ((k, value) for k, value in enumerate(values) if value is not None and value in values[:k])


class Config(Model):
    """Everything that config.yaml says."""

    camera: Camera = Field(description="Where frames come from.")
    calibration: Calibration | None = Field(None, description="Pixels to millimetres; needed where a controller is.")
    controller: Controller = Field(description="The cutting machine's controller.")
    triggers: tuple[Trigger, ...] = Field((), description="What begins a job.")
    default_recipe: int = Field(1, ge=1, le=65_535, description="Recipe of a trigger that names none.")
    recipes: tuple[Recipe, ...] = Field((Recipe(number=1, name="default"),), description="Block types.")
    work_area_mm: tuple[Point, ...] = Field((), description="Polygon in the machine frame, mm; empty = not checked.")
    table: Table | None = Field(None, description="The taught table; none = blocks are told from any table.")
    service: Service = Field(default_factory=Service, description="The service itself.")
    journal: JournalSettings = Field(default_factory=JournalSettings, description="The durable list of jobs.")
    archive: ArchiveSettings = Field(default_factory=ArchiveSettings, description="Where evidence is kept.")
    metrics: Metrics | None = Field(None, description="Figures for Prometheus; none = not served.")
    page: Page | None = Field(None, description="The operator's page; none = not served.")
    log: Log = Field(default_factory=Log, description="The log.")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not self.recipes:
            raise ValueError("recipes is empty, expected one or more")
        for name in ("number", "name"):
            for k, value in _repeated([getattr(recipe, name) for recipe in self.recipes]):
                raise MistakeAt(("recipes", k, name), f"{value} is there more than once. Give each recipe its own")
        if self.default_recipe not in {recipe.number for recipe in self.recipes}:
            numbers = ", ".join(str(recipe.number) for recipe in self.recipes)
            raise ValueError(f"default_recipe is {self.default_recipe}, but recipes have only the numbers {numbers}")
        needs = next((recipe.needs_millimetres for recipe in self.recipes if recipe.needs_millimetres), None)
        if self.calibration is None and needs:
            raise ValueError(f"calibration is missing: a recipe's {needs} needs millimetres. Set calibration.file")
        if self.calibration is None and not isinstance(self.controller, NoController):
            raise ValueError("calibration is missing: a controller needs millimetres. Set calibration.file")
        controllers = [trigger for trigger in self.triggers if isinstance(trigger, ControllerTrigger)]
        if controllers and (isinstance(self.controller, NoController) or self.controller.handshake == "none"):
            raise ValueError("triggers: kind controller needs a controller with handshake full")
        for k, kind in _repeated([trigger.kind for trigger in self.triggers]):
            if kind == "controller":
                raise MistakeAt(("triggers", k), "kind controller is there more than once. Take one out")
        ports = [self.controller.port if isinstance(self.controller, ModbusRtu) else None]
        ports += [trigger.port if isinstance(trigger, SerialTrigger) else None for trigger in self.triggers]
        for k, port in _repeated(ports):
            raise MistakeAt(("triggers", k - 1, "port"), f"{port} is named more than once. A serial port serves one")
        if self.page is not None and self.metrics is not None and self.page.port == self.metrics.port:
            raise ValueError(f"page.port and metrics.port are both {self.page.port}. Give each its own")
        return self

    @field_validator("work_area_mm")
    @classmethod
    def _polygon(cls, value: tuple[Point, ...]) -> tuple[Point, ...]:
        if not value:
            return value
        import numpy as np

        if len(value) < 3:
            raise ValueError(f"has {len(value)} points, expected 3 or more, or none")
        defect = ring_defect(np.array(value, dtype=np.float64))
        if defect:
            raise ValueError(f"is no simple polygon: {defect}")
        return value
