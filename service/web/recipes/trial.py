"""What a changed recipe makes of an archived job: measured again, in a process of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.config.recipes import Recipe
from service.records.archived_job import ArchivedJob, load_archived
from service.records.evidence import EvidenceError, measurement_fields
from service.records.replay import Replayed, Settings, replay
from service.web.drawing import drawing
from service.web.recipes.models import LeftOut, TriedJob


@dataclass(frozen=True)
class Drawn:
    """A tried job, and the drawing of what would have been sent, JSON."""

    job: TriedJob
    drawing: bytes


@dataclass(frozen=True)
class Trial:
    """Tries the recipe on one job after the other."""

    archive: Path
    recipe: Recipe

    def tried(self, job_id: int) -> Drawn | LeftOut:
        """What comes of it, or why nothing does."""
        try:
            archived = load_archived(self.archive, job_id)
            settings = self.recipe.model_dump(mode="json")
            if archived.document["job"]["trigger"]["thickness_um"]:  # the machine's word goes before the recipe's
                del settings["thickness_mm"]
            again = replay(archived, Settings(recipe=settings))
            return Drawn(_told(again), self._drawn(archived, again))
        except EvidenceError as error:
            return LeftOut(job_id=job_id, why=str(error).removeprefix(f"job {job_id}: "))

    def _drawn(self, archived: ArchivedJob, again: Replayed) -> bytes:
        """As of a job that was archived so, so that both look the same."""
        document: dict[str, Any] = {
            **archived.document,
            "job": {**archived.document["job"], "outcome": "refused" if again.reasons else "accepted"},
            "recipe": self.recipe.model_dump(mode="json"),
            "measurement": measurement_fields(again.seen),
        }
        if again.seen.thickness_mm is not None:
            document["thickness_mm"] = again.seen.thickness_mm
        return drawing(ArchivedJob(archived.job_id, archived.path, document)).model_dump_json().encode()


def _told(again: Replayed) -> TriedJob:
    return TriedJob(
        job_id=again.job_id,
        taken_at=again.taken_at,
        code_before=int(next(iter(again.reasons_were), 0)),
        code_after=int(next(iter(again.reasons), 0)),
        text="; ".join(again.texts) or None,
        flipped=again.flipped,
        distance=None if again.apart is None else round(again.apart.distance, 4),
        unit="mm" if again.apart is None else again.apart.unit,
        area_mm2_before=again.was["area_mm2"],
        area_mm2_after=again.now["area_mm2"],
    )
