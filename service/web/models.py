"""What the REST interface is asked and answers, as models: each answer is made through one, and OpenAPI tells them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from service.details import russian

Milliseconds = dict[str, float]


class Answer(BaseModel):
    """Exactly these fields."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Told(Answer):
    """An answer with sentences of what was seen, which are English."""

    ru: dict[str, str] = Field(
        default_factory=dict, description="Its sentences in Russian, by the English ones, as far as they are known."
    )

    @model_validator(mode="after")
    def _in_russian(self) -> Self:
        self.ru.update({text: told for text in self.sentences() if text and (told := russian(text)) != text})
        return self

    def sentences(self) -> Iterator[str | None]:
        """All of them."""
        raise NotImplementedError


class Problem(Told):
    """What went wrong, as a sentence; where a reason of the table applies, its code and name."""

    error: str
    code: int | None = None
    name: str | None = None
    holder: str | None = Field(None, description="Who gives orders now, where that is why: say why you take over.")

    def sentences(self) -> Iterator[str | None]:
        """What went wrong."""
        yield self.error


class Fault(Answer):
    """Why a part does not work; texts for people by `code` in /api/v1/reasons."""

    code: int
    name: str
    text: str
    starting: bool = Field(description="It has not been tried yet.")


class LastJob(Answer):
    """How the last job ended."""

    job: int
    outcome: str | None
    code: int
    name: str | None
    detail: str | None
    settled_at: str | None


class TriggerCount(Answer):
    """Triggers by what became of them since the start."""

    kind: str
    what: str
    count: int


class OutcomeCount(Answer):
    """Ended jobs since the start."""

    outcome: str
    reason: str | None
    count: int


class Part(Answer):
    """A part of the service: how often it was started again."""

    name: str
    restarts: int
    last_error: str | None
    failed_at: str | None


class RecipeName(Answer):
    """A recipe that a job may name."""

    number: int
    name: str


class CameraState(Answer):
    """The camera."""

    what: str
    up: bool


class LinkState(Answer):
    """The controller's connection."""

    what: str
    up: bool
    not_ready: str | None = Field(description="Why the controller would not take a contour now.")
    round_trip_ms: float | None
    connections: int


class CalibrationState(Answer):
    """The calibration in use. max_age_days 0 = no limit."""

    digest: str
    age_days: float | None
    max_age_days: float


class DiskState(Answer):
    """Room for journal and evidence."""

    journal_free_bytes: int | None
    archive_bytes: int
    archive_max_bytes: int
    archive_jobs: int


class LeaseState(Answer):
    """Who gives orders from the page now, for so long, and for how much longer unless they give another."""

    who: str
    since_s: float
    left_s: float


class ServiceState(Told):
    """The service now. States are OPC 40100-1's."""

    version: str
    process: int
    uptime_s: float
    state: str
    service_state: int
    reason: str | None
    code: int = Field(description="Of the fault to repair first; 0 = none.")
    since_s: float
    job: int | None = Field(description="Being executed.")
    waiting: int
    settled_job: int
    last_job: LastJob | None
    missed_triggers: int
    triggers: list[TriggerCount]
    faults: dict[str, Fault]
    warnings: dict[str, str]
    parts: list[Part]
    outcomes: list[OutcomeCount]
    recipes: list[RecipeName]
    camera: CameraState
    link: LinkState | None
    calibration: CalibrationState | None
    disk: DiskState
    lease: LeaseState | None = Field(description="null where nobody does, or people need no word.")

    def sentences(self) -> Iterator[str | None]:
        """Why it is as it is, and how the last job ended."""
        yield self.reason
        yield from (fault.text for fault in self.faults.values())
        yield from self.warnings.values()
        yield None if self.last_job is None else self.last_job.detail
        yield None if self.link is None else self.link.not_ready


class TriggerOrigin(Answer):
    """Where a job came from."""

    kind: str
    recipe: int
    thickness_um: int
    session: int | None
    counter: int | None
    line: str | None


class Job(Told):
    """A job as the journal holds it, and which of its files the archive keeps."""

    job_id: int
    taken_at: str
    settled_at: str | None
    trigger: TriggerOrigin
    outcome: Literal["accepted", "written", "refused", "failed"] | None
    reason: int | None
    reason_name: str | None
    detail: str | None
    report: dict[str, Any]
    recipe: dict[str, Any] | None
    calibration: str | None
    transfer: dict[str, Any]
    files: list[str] = Field(description="Names for /api/v1/jobs/{job}/files/{name}; empty where nothing is kept.")

    def sentences(self) -> Iterator[str | None]:
        """How it ended."""
        yield self.detail


class Jobs(Answer):
    """Jobs, newest first."""

    jobs: list[Job]


Points = list[tuple[float, float]]


class Axis(Answer):
    """A line of one whole millimetre value, as it lies in the picture."""

    axis: Literal["x", "y"]
    mm: float
    points: Points


class Grid(Answer):
    """x and y in millimetres at nodes over the whole picture, evenly from edge to edge, row by row from the top."""

    columns: int
    rows: int
    millimetres: list[float]


class SentinelMark(Answer):
    """A fixed mark where the calibration saw it."""

    id: int
    corners: Points


class HiddenPart(Answer):
    """A part of the contour that was not seen: a line of points, bridged where it is not covered."""

    covered: bool
    points: Points


class LaidPart(Answer):
    """The part in the block, in pixels of the frame; its tightest place is on its own outline and on the block's."""

    exterior: Points
    holes: list[Points]
    tightest: Points
    fits: bool
    margin_mm: float = Field(description="The least distance to the block's edge that was reached.")
    asked_mm: float = Field(description="The margin that the recipe asks for.")
    needed_mm: float = Field(description="That and the contour's own bound.")
    px_per_mm: float
    number: int = Field(description="Among the recipe's parts, from 1.")
    middle: tuple[float, float] = Field(description="A place in its material, for the number.")
    file: str


class WantedPart(Answer):
    """One of a recipe's several parts: how many of it were to be laid."""

    number: int
    file: str
    quantity: int


class Drawing(Answer):
    """What is drawn over a job's frame, in its pixels; (0, 0) is the centre of the top-left one."""

    job_id: int
    width: int
    height: int
    refused: bool
    exterior: Points
    holes: list[Points]
    hidden: list[HiddenPart]
    shown: list[Points] = Field(description="Paths that show why it was refused.")
    band_px: float | None = Field(description="What the contour may be off by.")
    part: LaidPart | None
    parts: list[LaidPart] = Field(description="Those of a recipe with several.")
    wanted: list[WantedPart] = Field(description="What such a recipe would have laid.")
    ribbon: Points = Field(description="Ends of a line along the core's ribbon, read from the picture; empty = not.")
    size_mm: tuple[float, float] | None
    sentinels: list[SentinelMark]
    grid: Grid | None
    axes: list[Axis]


class ReasonText(Answer):
    """A reason in one language."""

    sentence: str
    next_action: str


class ReasonEntry(Answer):
    """A reason by which jobs are not accepted."""

    code: int
    name: str
    outcome: str
    en: ReasonText
    ru: ReasonText


class Reasons(Answer):
    """The table of reasons."""

    reasons: list[ReasonEntry]


class NoteEntry(Answer):
    """Who asked for what. who null = nobody proved to be anybody; result null = it was cut short."""

    at: str
    who: str | None
    address: str
    action: str
    detail: str | None
    result: str | None


class Notes(Answer):
    """The audit, newest first."""

    notes: list[NoteEntry]


class Triggered(Answer):
    """The job that was taken; null where it waits for its turn."""

    job: int | None


class StateAfter(Answer):
    """The state that followed."""

    state: str


class RequestBody(Answer):
    """Exactly these fields, each of its own JSON type: `true` is no recipe."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


TakingOver = Annotated[str, Field(max_length=200, description="Why, where another person gives orders now.")]


class TriggerRequest(RequestBody):
    """recipe 0 = the configured default, thickness_mm 0 = the recipe's."""

    recipe: Annotated[int, Field(ge=0, le=65_535)] = 0
    thickness_mm: Annotated[float, Field(ge=0, le=10_000, allow_inf_nan=False)] = 0.0
    take_over: TakingOver = ""


class HaltRequest(RequestBody):
    """Why, for those who find it halted."""

    reason: Annotated[str, Field(max_length=200)] = ""


class ResumeRequest(RequestBody):
    """Nothing but perhaps that."""

    take_over: TakingOver = ""


class PeopleNames(Answer):
    """Who may give orders by a PIN."""

    names: list[str]
