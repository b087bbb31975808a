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


Camera = Annotated[FilesCamera | V4l2Camera, Field(discriminator="kind")]
