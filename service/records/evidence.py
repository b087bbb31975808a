"""What a job leaves behind: its document (JSON), its frame (PNG, lossless) and an overlay for people (JPEG).

The document holds all that the job was carried out with and came to, so that `replay` can do it again: recipe,
calibration, limits, work area, what of the pages was not measured, and the pages themselves.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.rings import Contour
from drivers.camera import Frame
from drivers.controller.mailbox.page_text import pages_to_text
from drivers.controller.mailbox.pages import Page
from service.config.recipes import Recipe
from service.link.contour_message import Envelope
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.measuring.table_file import TableRecord
from service.records.job import Job
from service.records.pictures import overlay

VERSION = 1
FRAME = "frame.png"
OVERLAY = "overlay.jpg"
OVERLAY_PX = 1600  # the longer side: enough to look at, a tenth of the frame's bytes
JPEG_QUALITY = 85
PNG_LEVEL = 1  # on photographs higher levels take four times as long for 3 % less


class Flaw(StrEnum):
    """Why a job cannot be done again, by kind."""

    NOTHING_MEASURED = "nothing_measured"
    MISSING = "missing"
    STORAGE = "storage"
    FRAME_DAMAGED = "frame_damaged"
    DOCUMENT_DAMAGED = "document_damaged"
    LATER_VERSION = "later_version"
    CALIBRATION = "calibration"
    TABLE = "table"
    SETTINGS = "settings"
    NOT_MEASURABLE = "not_measurable"


class EvidenceError(Exception):
    """A job's evidence is not there or cannot be used: seen, expected, next step."""

    def __init__(self, message: str, flaw: Flaw = Flaw.DOCUMENT_DAMAGED) -> None:
        super().__init__(message)
        self.flaw = flaw


@dataclass(frozen=True)
class Evidence:
    """A job and what it was carried out with; what it did not come to is None.

    measurer: None where all was read back, and with it the document.
    """

    job: Job
    measurer: Measurer | None
    recipe: Recipe | None = None
    thickness_mm: float = 0.0
    frame: Frame | None = None
    measurement: Measurement | None = None
    envelope: Envelope | None = None
    pages: tuple[Page, ...] = ()


class Keeper(Protocol):
    """Keeps evidence; none of the calls blocks. `service.records.archive_writer.ArchiveWriter` in the daemon."""

    def draft(self, evidence: Evidence) -> Future[None] | None:
        """Keep what a restart would need to end the job with all its evidence.

        It is done once that is durable, or cannot be; None where nothing of it will be kept.
        """

    def keep(self, evidence: Evidence) -> None:
        """Keep it for good: the job has ended. Of one that a restart found the draft is completed."""


class KeepsNothing:
    """Where there is no archive."""

    def draft(self, evidence: Evidence) -> None:
        """Nothing."""

    def keep(self, evidence: Evidence) -> None:
        """Nothing."""


def document(evidence: Evidence, table_file: str | None) -> dict[str, Any]:
    """The job's document, JSON's types only. table_file: where in the archive the taught table is."""
    measurer, frame = evidence.measurer, evidence.frame
    assert measurer is not None
    return {
        "version": VERSION,
        "combtrace": importlib.metadata.version("combtrace"),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "job": job_fields(evidence.job),
        "recipe": None if evidence.recipe is None else evidence.recipe.model_dump(mode="json"),
        "thickness_mm": evidence.thickness_mm,
        "calibration": calibration_fields(measurer),
        "work_area_mm": None if measurer.work_area_mm is None else measurer.work_area_mm.tolist(),
        "table": table_file,
        "frame": None if frame is None else _frame_fields(frame),
        "measurement": None if evidence.measurement is None else measurement_fields(evidence.measurement),
        "envelope": None if evidence.envelope is None else asdict(evidence.envelope),
        "pages": pages_to_text(evidence.pages),
    }


def document_bytes(document: dict[str, Any]) -> bytes:
    """The document as it stands in its file."""
    return (json.dumps(document, default=str, ensure_ascii=False) + "\n").encode()


def job_fields(job: Job) -> dict[str, Any]:
    """A job as `combtrace jobs --json` and documents tell it."""
    return {
        "job_id": job.job_id,
        "taken_at": job.taken_at,
        "settled_at": job.settled_at,
        "trigger": asdict(job.trigger),
        "outcome": None if job.outcome is None else str(job.outcome),
        "reason": None if job.reason is None else int(job.reason),
        "reason_name": None if job.reason is None else job.reason.label,
        "detail": job.detail,
        "report": job.report,
        "recipe": None if job.terms is None else job.terms.recipe,
        "calibration": None if job.terms is None else job.terms.calibration,
        "transfer": job.transfer,
    }


def measurement_fields(measurement: Measurement) -> dict[str, Any]:
    """What was measured, with the polygon to the last bit."""
    return {
        **measurement.summary(),
        "aligned": measurement.aligned,
        "area_px2": measurement.area_px2,
        "uncertainty_px": measurement.uncertainty_px,
        "uncertainty": None if measurement.uncertainty is None else asdict(measurement.uncertainty),
        "evidence": measurement.evidence_fields,
        **({} if measurement.part is None else {"part": measurement.part.kept()}),
        **({} if measurement.ribbon is None else {"ribbon": measurement.ribbon.kept()}),
        "shown_px": [np.round(path, 2).tolist() for path in measurement.shown_px],
        **({"parts": [part.kept() for part in measurement.parts]} if measurement.parts else {}),
        "reasons": [{"code": int(reason), "text": text} for reason, text in measurement.findings],
        "pixels": contour_fields(measurement.pixels),
        "millimetres": contour_fields(measurement.millimetres),
    }


def contour_fields(contour: Contour | None) -> dict[str, Any] | None:
    """Rings as lists of pairs."""
    if contour is None:
        return None
    return {"exterior": contour.exterior.tolist(), "holes": [hole.tolist() for hole in contour.holes]}


def plain_bytes(frame: Frame) -> bytes:
    """The frame's samples as they are in memory, row by row."""
    return np.ascontiguousarray(frame.samples).tobytes()


def frame_bytes(frame: Frame) -> bytes:
    """The frame as PNG of its full depth, which loses nothing."""
    return _encoded(".png", frame.samples, [cv2.IMWRITE_PNG_COMPRESSION, PNG_LEVEL])


def overlay_bytes(frame: Frame, measurement: Measurement) -> bytes:
    """The frame with the contour over it, made smaller, as JPEG."""
    drawn = overlay(frame.pixels, measurement)
    height, width = drawn.shape[:2]
    scale = OVERLAY_PX / max(height, width)
    if scale < 1:
        size = max(round(width * scale), 1), max(round(height * scale), 1)
        drawn = np.asarray(cv2.resize(drawn, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return _encoded(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])


def table_digest(record: TableRecord) -> str:
    """What a taught table is told from others by."""
    digest = hashlib.sha256(record.table.picture.tobytes())
    digest.update(f"{record.table.picture.shape} {record.table.noise!r} {record.camera}".encode())
    return digest.hexdigest()[:32]


def _encoded(ending: str, pixels: NDArray[np.uint8] | NDArray[np.uint16], options: list[int]) -> bytes:
    _, data = cv2.imencode(ending, pixels, options)
    return data.tobytes()


def calibration_fields(measurer: Measurer) -> dict[str, Any] | None:
    """The calibration that it measures by; None without one."""
    guard = measurer.guard
    if guard is None:
        return None
    return {"digest": guard.record.digest, "content": guard.record.content, "limits": asdict(guard.limits)}


def _frame_fields(frame: Frame) -> dict[str, Any]:
    return {
        "source": frame.source,
        "camera": frame.camera,
        "simulated": frame.simulated,
        "sequence": frame.sequence,
        "shape": list(frame.pixels.shape),
        "type": frame.samples.dtype.name,
        "sha256": hashlib.sha256(plain_bytes(frame)).hexdigest(),
    }
