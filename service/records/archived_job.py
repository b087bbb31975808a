"""A job's evidence read back: its document checked, its frame as it was, and what it takes to measure it again."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.quality import Quality
from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from drivers.camera import Frame
from drivers.camera.depth import looked_at
from drivers.controller.mailbox.page_text import pages_from_text
from drivers.controller.mailbox.pages import Page
from service.config.mistakes import describe
from service.config.recipes import Recipe
from service.link.contour_message import Envelope
from service.measuring.calibration_file import CalibrationFileError, record_of
from service.measuring.calibration_guard import CalibrationGuard, GuardLimits
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.measuring.table_file import TableFileError, TableRecord, load_table
from service.parts.core_ribbon import CoreRibbon
from service.parts.fit import PartFit
from service.reasons import Reason
from service.records.archive import DRAFT, PLAIN_FRAME, TABLES, document_of, folder_of
from service.records.evidence import FRAME, VERSION, Evidence, EvidenceError, Flaw
from service.records.job import Job

LARGEST_DOCUMENT = 200_000_000


@dataclass(frozen=True)
class ArchivedJob:
    """One job as the archive keeps it. `document`: as `service.records.evidence.document` made it."""

    job_id: int
    path: Path
    document: dict[str, Any]

    @property
    def taken_at(self) -> datetime:
        """When it was taken."""
        return datetime.fromisoformat(self.document["job"]["taken_at"])

    @property
    def replayable(self) -> bool:
        """True where there is a frame, and a measurement that it was made into."""
        return self.document["frame"] is not None and self.document["measurement"] is not None

    @property
    def envelope(self) -> Envelope | None:
        """What of the pages was not measured; None where it came to none."""
        found = self.document["envelope"]
        return None if found is None else Envelope(**found)

    @property
    def pages(self) -> tuple[Page, ...]:
        """The pages as they were sent."""
        return pages_from_text(self.document["pages"])

    def contour(self, frame: str) -> Contour | None:
        """The polygon in `pixels` or `millimetres`."""
        found = self.document["measurement"][frame]
        if found is None:
            return None
        return Contour(np.array(found["exterior"]), tuple(np.array(hole) for hole in found["holes"]))

    @property
    def evidence(self) -> tuple[SentStretch, ...] | None:
        """What the polygon rests on; None where nobody said, as in documents of earlier versions."""
        found = self.document["measurement"].get("evidence")
        return None if found is None else tuple(SentStretch(**stretch) for stretch in found)

    @property
    def shown_px(self) -> tuple[Float64s, ...]:
        """Paths in the picture that show what spoke against it; none in documents of earlier versions."""
        return tuple(np.array(path) for path in self.document["measurement"].get("shown_px", ()))

    @property
    def part(self) -> PartFit | None:
        """The part that was laid into the block; None where the recipe had none, or the block was refused before."""
        found = self.document["measurement"].get("part")
        return None if found is None else PartFit.of_kept(found)

    @property
    def parts(self) -> tuple[PartFit, ...]:
        """The parts of a recipe with several that were laid."""
        return tuple(PartFit.of_kept(found) for found in self.document["measurement"].get("parts", ()))

    @property
    def ribbon(self) -> CoreRibbon | None:
        """Where the core's ribbon runs; None where no part asked for it, as in documents of earlier versions."""
        found = self.document["measurement"].get("ribbon")
        return None if found is None else CoreRibbon.of_kept(found)

    @cached_property
    def recipe_settings(self) -> dict[str, Any]:
        """The recipe's whole settings."""
        return dict(self.document["recipe"])

    def frame(self) -> NDArray[np.uint8]:
        """The frame, pixel for pixel as it was; raise EvidenceError."""
        path = self.path.with_name(f"{self.job_id}-{FRAME}")
        try:
            data = np.frombuffer(path.read_bytes(), np.uint8)
        except OSError as error:
            raise _unreadable(path, error) from error
        decoded = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if data.size else None
        samples: NDArray[np.generic] = np.zeros(0, np.uint8) if decoded is None else decoded
        known = self.document["frame"]
        if list(samples.shape) != known["shape"] or _sha256(samples) != known["sha256"]:
            told = f"{path}: is not the frame that was archived. Restore it, or replay another job"
            raise EvidenceError(told, Flaw.FRAME_DAMAGED)
        return looked_at(samples)[0]

    def measurer(self, calibration: Path | None = None, limits: dict[str, Any] | None = None) -> Measurer:
        """What measures as the job was measured; with another calibration file, or other limits. EvidenceError."""
        guard = self._guard(calibration, limits or {})
        area = self.document["work_area_mm"]
        return Measurer(
            None if guard is None else guard.record.calibration,
            guard=guard,
            work_area_mm=None if area is None else np.array(area, dtype=np.float64),
            table=self._table(),
        )

    def _guard(self, calibration: Path | None, limits: dict[str, Any]) -> CalibrationGuard | None:
        known = self.document["calibration"]
        if known is None and calibration is None:
            return None
        try:
            if calibration is not None:
                from service.measuring.calibration_file import load_record

                record = load_record(calibration)
            else:
                record = record_of(known["content"], str(self.path))
        except CalibrationFileError as error:
            raise EvidenceError(str(error), Flaw.CALIBRATION) from error
        values = {**({} if known is None else known["limits"]), **limits}
        taken_at = self.taken_at
        return CalibrationGuard(record, GuardLimits(**values), now=lambda: taken_at)

    def _table(self) -> TableRecord | None:
        name = self.document["table"]
        if name is None:
            return None
        path = self.path.parent.parent / TABLES / Path(name).name
        try:
            return load_table(path)
        except TableFileError as error:
            raise EvidenceError(f"job {self.job_id}: {error}", Flaw.TABLE) from error


def load_archived(archive: Path, job_id: int) -> ArchivedJob:
    """The evidence of a job; raise EvidenceError."""
    try:
        path = document_of(archive, job_id)
    except OSError as error:
        told = f"{archive}: cannot be looked at: {error.strerror}. Check its permissions"
        raise EvidenceError(told, Flaw.STORAGE) from error
    if path is None:
        told = f"{archive}: holds nothing of job {job_id}. It was let go, or was never kept: see archive.max_bytes"
        raise EvidenceError(told, Flaw.MISSING)
    return _loaded(path, job_id)


def load_draft(archive: Path, job_id: int) -> ArchivedJob:
    """What was kept of a job before it had ended; raise EvidenceError."""
    return _loaded(folder_of(archive, job_id) / f"{job_id}-{DRAFT}", job_id)


def drafted_evidence(draft: ArchivedJob, job: Job) -> Evidence:
    """A job's evidence as it was in memory before the restart, read back from its draft; raise EvidenceError."""
    document = draft.document
    try:
        settings = document["recipe"]
        return Evidence(
            job,
            None,
            None if settings is None else Recipe.model_validate(settings),
            document["thickness_mm"],
            _plain_frame(draft),
            _measurement(draft),
            draft.envelope,
            draft.pages,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise EvidenceError(f"{draft.path}: is no draft that can be completed: {error}") from error


def _plain_frame(draft: ArchivedJob) -> Frame:
    known = draft.document["frame"]
    path = draft.path.with_name(f"{draft.job_id}-{PLAIN_FRAME}")
    try:
        # Documents of earlier versions say no type: their frames had eight bits.
        samples = np.frombuffer(path.read_bytes(), np.dtype(known.get("type", "uint8"))).reshape(known["shape"])
    except OSError as error:
        raise EvidenceError(f"{path}: cannot be read: {error.strerror}") from error
    if _sha256(samples) != known["sha256"]:
        raise EvidenceError(f"{path}: is not the frame that was kept")
    pixels, deep = looked_at(samples)
    return Frame(pixels, 0.0, known["simulated"], known["source"], known["sequence"], known["camera"], deep)


def _measurement(draft: ArchivedJob) -> Measurement:
    known = draft.document["measurement"]
    quality, uncertainty = known["quality"], known["uncertainty"]
    return Measurement(
        method=known["method"],
        polarity=known["polarity"],
        pitch_px=known["pitch_px"],
        pixels=draft.contour("pixels"),
        millimetres=draft.contour("millimetres"),
        shown_px=draft.shown_px,
        area_px2=known["area_px2"],
        area_mm2=known["area_mm2"],
        uncertainty_px=known["uncertainty_px"],
        uncertainty=None if uncertainty is None else ErrorBudget(**uncertainty),
        evidence=draft.evidence,
        part=draft.part,
        parts=draft.parts,
        ribbon=draft.ribbon,
        thickness_mm=known["thickness_mm"],
        aligned=known["aligned"],
        quality=None if quality is None else Quality(**quality),
        findings=tuple((Reason(entry["code"]), entry["text"]) for entry in known["reasons"]),
        timings_ms=known["timings_ms"],
    )


def _loaded(path: Path, job_id: int) -> ArchivedJob:
    try:
        if path.stat().st_size > LARGEST_DOCUMENT:
            raise EvidenceError(f"{path}: {path.stat().st_size} bytes, expected {LARGEST_DOCUMENT} at most")
        document = json.loads(path.read_bytes())
        version, number = document["version"], document["job"]["job_id"]
    except OSError as error:
        raise _unreadable(path, error) from error
    except (ValueError, KeyError, TypeError) as error:
        raise EvidenceError(f"{path}: is no document of a job ({error}). Restore it") from error
    if version != VERSION or number != job_id:
        later = isinstance(version, int) and version > VERSION
        raise EvidenceError(
            f"{path}: version {version} of job {number}, expected version {VERSION} of job {job_id}. "
            "Where the version is another, it was written by another version of combtrace: use that one",
            Flaw.LATER_VERSION if later else Flaw.DOCUMENT_DAMAGED,
        )
    return ArchivedJob(job_id, path, document)


def recipe_with(archived: ArchivedJob, changes: dict[str, Any]) -> Recipe:
    """The archived recipe, changed; keys may be `parameters.core_px`. Raise EvidenceError."""
    settings = dict(archived.recipe_settings)
    for key, value in changes.items():
        name, _, inner = key.partition(".")
        settings[name] = {**(settings.get(name) or {}), inner: value} if inner else value
    try:
        return Recipe.model_validate(settings)
    except ValidationError as error:
        mistakes = "; ".join(f"recipe.{line}" for line in describe(error, Recipe))
        raise EvidenceError(f"job {archived.job_id}: {mistakes}", Flaw.SETTINGS) from error


def _unreadable(path: Path, error: OSError) -> EvidenceError:
    flaw = Flaw.MISSING if isinstance(error, FileNotFoundError) else Flaw.STORAGE
    return EvidenceError(f"{path}: cannot be read: {error.strerror}", flaw)


def _sha256(samples: NDArray[np.generic]) -> str:
    return hashlib.sha256(np.ascontiguousarray(samples).tobytes()).hexdigest()
