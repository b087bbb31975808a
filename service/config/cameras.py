"""`camera` of config.yaml: where frames come from."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.config.values import FilePath, Model, Seconds


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

    @property
    def has_spare_frames(self) -> bool:
        """True where a frame that is only looked at is none that a job would have got."""
        return self.loop


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

    @property
    def has_spare_frames(self) -> bool:
        """True: it sends frames all the time."""
        return True


class GenicamCamera(Model):
    """A GigE Vision or USB3 Vision camera, through Aravis (`apt install gir1.2-aravis-0.8 python3-gi`)."""

    kind: Literal["genicam"]
    serial: str = Field("", max_length=64, description="Serial number of the camera, in quotes.")
    user_name: str = Field("", max_length=64, description="Name that the camera was given; instead of serial.")
    width: int | None = Field(None, ge=16, le=32_768, description="Width of the region, px; none = as it has it.")
    height: int | None = Field(None, ge=16, le=32_768, description="Height of the region, px; none = as it has it.")
    offset_x: int = Field(0, ge=0, le=32_768, description="Left edge of the region on the sensor, px.")
    offset_y: int = Field(0, ge=0, le=32_768, description="Upper edge of the region on the sensor, px.")
    pixel_format: str = Field(
        "Mono8",
        min_length=1,
        max_length=40,
        description="Name of the pixel format: Mono8, 10, 12, 14, 16, BayerRG8 to 16, packed ones (p, Packed), RGB8.",
    )
    exposure_us: float | None = Field(None, gt=0, le=60_000_000, description="Exposure time, µs; none = as it has it.")
    gain_db: float | None = Field(None, ge=-100, le=10_000, description="Gain in the camera's unit, mostly dB.")
    black_level: float | None = Field(None, ge=0, le=65_535, description="Black level in the camera's unit.")
    white_balance: dict[Literal["red", "green", "blue"], float] = Field(
        default_factory=dict, description="Gain of each colour."
    )
    frame_rate: float | None = Field(None, gt=0, le=10_000, description="Frames a second; none = as it has it.")
    trigger: Literal["software", "line", "free"] = Field(
        "software", description="What exposes a frame: the job itself, an edge on a line, or the camera's own clock."
    )
    line: str = Field("Line1", min_length=1, max_length=40, description="With trigger line: the input.")
    trigger_activation: str | None = Field(
        None, max_length=40, description="With trigger line: RisingEdge, FallingEdge and the like; none = as it has it."
    )
    strobe: str | None = Field(
        None, max_length=40, description="Output line that is on while the sensor is exposed; none = none is set."
    )
    packet_size: Literal["auto"] | Annotated[int, Field(ge=220, le=65_000)] = Field(
        "auto", description="Bytes of a network packet; auto = negotiated."
    )
    packet_delay_ns: int | None = Field(
        None, ge=0, le=10_000_000, description="Pause between two packets, ns: for cameras that share a cable."
    )
    features: dict[str, bool | int | float | str] = Field(
        default_factory=dict, description="Any other feature by its name in the camera's own description."
    )
    timeout_s: Seconds = Field(5.0, description="Longest wait for a frame, s.")
    latency_ms: float = Field(
        0, ge=0, le=10_000, description="With trigger line or free: how long the camera keeps a frame, ms."
    )
    average: int = Field(
        1, ge=1, le=64, description="Frames of a still scene that are averaged; 103 where it moves. 1 = none."
    )
    warm_up_s: float = Field(
        0, ge=0, le=7200, description="Time after opening in which no trigger is taken, s, as for V4L2."
    )

    @model_validator(mode="after")
    def _one_name(self) -> Self:
        if bool(self.serial) == bool(self.user_name):
            seen = "both serial and user_name are" if self.serial else "neither serial nor user_name is"
            raise ValueError(f"{seen} given, expected one: `combtrace cameras` lists them")
        return self

    @property
    def has_spare_frames(self) -> bool:
        """True unless a line exposes each frame, which is a job's."""
        return self.trigger != "line"


Camera = Annotated[FilesCamera | V4l2Camera | GenicamCamera, Field(discriminator="kind")]
