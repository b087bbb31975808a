"""What is asked and answered about recipes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from service.web.models import Answer, RequestBody, TakingOver, Told

MOST_JOBS = 50
MOST_CHANGES = 100

Note = Annotated[str, Field(min_length=3, max_length=200, description="Why, for those who find it so.")]


class KeyChange(Answer):
    """A key of a recipe, from what to what; keys within keys have dots: `gcode.feed_mm_min`, `parts.0.quantity`."""

    key: str
    before: Any
    after: Any


class AdoptionEntry(Answer):
    """A recipe that was adopted. 0 = as the configuration file has it, by nobody."""

    number: int
    at: str | None
    who: str | None
    note: str
    changes: list[KeyChange] = Field(description="From what was in force before.")
    in_force: bool


class RecipeEntry(Answer):
    """A recipe as it is in force, and what it was."""

    number: int
    name: str
    values: dict[str, Any] = Field(description="Of the keys that may be changed here; bounds: /recipes/schema.")
    parts: list[str] = Field(description="Files of its parts, in their order.")
    adopted: list[AdoptionEntry] = Field(description="Newest first; empty where none was.")


class RecipeList(Told):
    """All recipes. trouble: why no recipe can be adopted, null where one can."""

    default: int
    recipes: list[RecipeEntry]
    trouble: str | None

    def sentences(self) -> Iterator[str | None]:
        """Why none can be adopted."""
        yield self.trouble


class TriedJob(Answer):
    """What became of an archived job, and what would have with the changed recipe; code 0 = it was, would be sent."""

    job_id: int
    taken_at: str
    code_before: int
    code_after: int
    text: str | None = Field(description="What would speak against it.")
    flipped: bool
    distance: float | None = Field(description="Largest between the two outlines; null where there is none of them.")
    unit: str = Field(description="Of the distance: mm, px without a calibration.")
    area_mm2_before: float | None
    area_mm2_after: float | None


class LeftOut(Answer):
    """A job that could not be measured again."""

    job_id: int
    why: str


class TrialState(Answer):
    """A try: how far it is, and what has come out. `done` alone can be adopted."""

    number: int
    recipe: int
    changes: list[KeyChange]
    who: str
    state: Literal["running", "done", "stopped", "too_long", "failed"]
    wanted: int
    jobs: list[TriedJob] = Field(description="Newest first, as they come.")
    left_out: list[LeftOut]


class TrialAnswer(Told):
    """The last try; null where none was since the start."""

    trial: TrialState | None

    def sentences(self) -> Iterator[str | None]:
        """What would speak against jobs, and why some are left out."""
        if self.trial is not None:
            yield from (job.text for job in self.trial.jobs)
            yield from (job.why for job in self.trial.left_out)


class TrialRequest(RequestBody):
    """Which keys are to be otherwise, and on how many of the recipe's last archived jobs that is tried."""

    changes: dict[Annotated[str, Field(max_length=80)], Any] = Field(min_length=1, max_length=MOST_CHANGES)
    jobs: Annotated[int, Field(ge=1, le=MOST_JOBS)] = 20
    take_over: TakingOver = ""


class TrialBegun(Answer):
    """The try's number."""

    trial: int


class StopRequest(RequestBody):
    """Nothing but perhaps why another person's try is ended."""

    take_over: TakingOver = ""


class AdoptRequest(RequestBody):
    """What was tried in the try of this number."""

    trial: int
    note: Note
    take_over: TakingOver = ""


class BackRequest(RequestBody):
    """The adoption that is to be in force again; 0 = what the configuration file says."""

    adoption: Annotated[int, Field(ge=0)]
    note: Note
    take_over: TakingOver = ""


class Adopted(Answer):
    """The adoption's number. since: from which job on, in English."""

    recipe: int
    adoption: int
    since: str
