"""What the live view answers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from service.web.models import Answer, Drawing, RecipeName, Told


class LookFinding(Answer):
    """Why a job now would be refused; texts for people by `code` in /api/v1/reasons."""

    code: int
    name: str
    text: str


class LookFigures(Answer):
    """Sharpness, % a pixel, to be compared for one scene only; mean grey level; shares at the ends of the range."""

    sharpness: float
    mean_grey: float
    black_share: float
    white_share: float


class LiveLook(Answer):
    """One frame, and what a job by this recipe would have made of it."""

    number: int = Field(description="Of its picture, /api/v1/live/{number}; goes up.")
    at: str
    recipe: RecipeName
    findings: list[LookFinding] = Field(description="Lowest code first; none = it would be accepted.")
    figures: LookFigures | None = Field(description="null where the frame could not be used.")
    drawing: Drawing | None


class LiveAnswer(Told):
    """The newest look, null where there is none that is newer than `after`; and what looking waits for."""

    waits_for: Literal["start", "job", "camera", "source"] | None = Field(
        description="start: the first look is under way. job: jobs go first. camera: it does not work. "
        "source: each of the camera's frames is a job's."
    )
    detail: str | None
    look: LiveLook | None

    def sentences(self) -> Iterator[str | None]:
        """What speaks against a job now, and what is wrong with the camera."""
        yield self.detail
        yield from () if self.look is None else (finding.text for finding in self.look.findings)
