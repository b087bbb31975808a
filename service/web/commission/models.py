"""What commissioning by the page is asked and answers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from service.web.models import Answer, RequestBody, TakingOver, Told

StepName = Literal["camera", "board", "calibration", "height", "alignment", "table", "marks", "controller", "job"]
Millimetres = Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False)]

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


class ActionRequest(RequestBody):
    """Nothing but perhaps a word to take over."""

    take_over: TakingOver = ""


class LookRequest(ActionRequest):
    """anew: what was the sharpest picture so far is forgotten, for the scene is another one."""

    anew: bool = False


class BoardRequest(ActionRequest):
    """The board, and what was measured by hand. marker_mm 0 = 0.7 squares."""

    kind: Literal["charuco", "chessboard"] = "charuco"
    squares_x: Annotated[int, Field(ge=3, le=100)]
    squares_y: Annotated[int, Field(ge=3, le=100)]
    square_mm: Millimetres
    marker_mm: Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)] = 0.0
    thickness_mm: Annotated[float, Field(ge=0, le=500, allow_inf_nan=False)] = 0.0


class ShootRequest(ActionRequest):
    """flat: the board lies on the table, where the work frame shall be."""

    flat: bool = False


class RemoveRequest(ActionRequest):
    """A picture of the board, by its number."""

    shot: Annotated[int, Field(ge=1, le=1_000_000)]


class CalibrateRequest(ActionRequest):
    """What is told besides the pictures."""

    camera_height_mm: Millimetres | None = None
    block_mm: Millimetres = 60.0
    accept_mm: Millimetres = 0.1


class ProbeRequest(ActionRequest):
    """write: also write, and put back what stood there."""

    write: bool = False


class HeightRequest(ActionRequest):
    """The block's height over the table."""

    thickness_mm: Millimetres


class PointRequest(ActionRequest):
    """A place in the work frame, and the machine's coordinates with the tool over it."""

    x_mm: Coordinate
    y_mm: Coordinate
    machine_x_mm: Coordinate
    machine_y_mm: Coordinate


class ForgetRequest(ActionRequest):
    """A point, by its place in the list, from 0."""

    point: Annotated[int, Field(ge=0, lt=1000)]


class AlignRequest(ActionRequest):
    """jog_mm: spread of jogging, one sigma, where no place was jogged to twice."""

    jog_mm: Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] = 0.15


class MarksRequest(ActionRequest):
    """The dictionary of the fixed marks."""

    dictionary: Annotated[str, Field(max_length=40)] = "DICT_4X4_50"


class Step(Answer):
    """How far a step is, in per cent; `well`: the next one may come. `command`: does the same in a shell."""

    name: StepName
    score: int = Field(ge=0, le=100)
    well: bool
    command: str
    lines: list[str] = Field(description="What was found, as sentences.")
    fault: str | None = Field(description="Why the last attempt came to nothing.")


class Shot(Answer):
    """A picture of the board: whether it serves, and if not why. corners 0 = no board seen."""

    number: int
    flat: bool
    serves: bool
    corners: int
    why: str | None


class Commission(Told):
    """All steps, as they stand. What is under way ends by itself: ask again."""

    halted: bool = Field(description="Only then anything but pictures is taken.")
    running: str | None = Field(description="The action that is under way.")
    progress: str
    steps: list[Step]
    board: BoardRequest | None
    setup: CalibrateRequest
    shots: list[Shot]
    most_shots: int
    zones: list[list[int]] = Field(description="Corners seen in each zone of the picture, row by row.")
    raised: list[Literal["left", "right", "top", "bottom"]] = Field(
        description="Sides of the picture at which the board was raised in some view."
    )
    wanted_views: int
    thickness_mm: float | None
    points: list[list[float]] = Field(description="x_mm, y_mm, machine_x_mm, machine_y_mm of each that was jogged to.")
    adoptable: bool = Field(description="There is a calibration that may be adopted.")
    reported: bool = Field(description="There is a report, /commission/report.")
    changes: dict[str, str | int | float] = Field(description="Keys of `controller` that the probe would change.")

    def sentences(self) -> Iterator[str | None]:
        """What was found, and what was wrong."""
        for step in self.steps:
            yield step.fault
            yield from step.lines
        yield from (shot.why for shot in self.shots)
