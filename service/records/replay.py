"""A job done again from its evidence: what came out, and field by field what is not as it was."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from contour.errors import ContourError
from contour.geometry.rings import Contour, farthest
from drivers.controller.errors import ContourTooLarge, MailboxError
from drivers.controller.mailbox.pages import HEADER_FIELDS, Page
from drivers.controller.mailbox.words import Unpacking, WordOrder
from service.link.contour_message import Envelope, contour_pages
from service.measuring.measurement import Measurement
from service.reasons import Reason
from service.records.archived_job import ArchivedJob, recipe_with
from service.records.evidence import EvidenceError, Flaw, measurement_fields

COMPARED = ("method", "polarity", "pitch_px", "vertices", "area_mm2", "uncertainty_mm", "thickness_mm")
COMPARED_AT_MM = 0.5  # spacing of the places at which two outlines are compared
SHOWN_REGISTERS = 3


@dataclass(frozen=True)
class Settings:
    """What is to be otherwise than it was; empty = nothing."""

    recipe: dict[str, Any] = field(default_factory=dict)
    limits: dict[str, Any] = field(default_factory=dict)
    calibration: Path | None = None

    @property
    def as_archived(self) -> bool:
        """True where nothing is changed."""
        return not (self.recipe or self.limits or self.calibration)


@dataclass(frozen=True)
class Change:
    """One thing that is not as it was."""

    field: str
    was: Any
    now: Any


@dataclass(frozen=True)
class Apart:
    """The largest distance between the outlines as they were and as they are now, holes too, in `unit`.

    0 = the same to the last bit.
    """

    distance: float
    unit: str


@dataclass(frozen=True)
class Replayed:
    """What came of a job, done again. reasons: why it would be refused, empty = it would be sent.

    registers: of the pages as sent; 0 where none were. identical: pages and polygon are as they were, bit for bit.
    apart: None where there is none of the two outlines.
    """

    job_id: int
    taken_at: str
    reasons_were: tuple[Reason, ...]
    reasons: tuple[Reason, ...]
    texts: tuple[str, ...]
    changes: tuple[Change, ...]
    registers: int
    was: dict[str, Any]
    now: dict[str, Any]
    seen: Measurement
    apart: Apart | None

    @property
    def identical(self) -> bool:
        """True where everything came out as it was."""
        return not self.changes

    @property
    def flipped(self) -> bool:
        """True where it is sent now and was refused, or the other way round."""
        return bool(self.reasons) != bool(self.reasons_were)


def replay(archived: ArchivedJob, settings: Settings) -> Replayed:
    """The job measured again and put into pages again; raise EvidenceError where that cannot be done."""
    if not archived.replayable:
        outcome = archived.document["job"]["outcome"]
        told = f"job {archived.job_id} {outcome} before a frame was measured: there is nothing to replay"
        raise EvidenceError(told, Flaw.NOTHING_MEASURED)
    recipe = recipe_with(archived, settings.recipe)
    thickness_mm = recipe.thickness_mm if "thickness_mm" in settings.recipe else archived.document["thickness_mm"]
    measurer = archived.measurer(settings.calibration, settings.limits)
    try:
        seen = measurer.measure(archived.frame(), recipe, thickness_mm, archived.document["frame"]["camera"])
    except ContourError as error:
        raise EvidenceError(f"job {archived.job_id}: {error}", Flaw.NOT_MEASURABLE) from error
    pages, refusal = _pages(seen, archived.envelope)
    known = archived.document["measurement"]
    were = tuple(Reason(entry["code"]) for entry in known["reasons"]) or _refused_pages(archived)
    reasons = seen.reasons or refusal
    now = measurement_fields(seen)
    apart = _apart(archived, seen)
    changes = [*_context(archived), *_fields(known, now), *_outlines(archived, seen, apart)]
    changes += [Change("reasons", _names(were), _names(reasons))] if were != reasons else []
    if archived.envelope is not None:
        changes += _page_changes(archived.pages, pages, archived.envelope.word_order)
    if not any(change.field not in CONTEXT for change in changes):
        changes = []  # another version that gives the same is no change
    registers = sum(len(page.header) + len(page.payload) for page in archived.pages)
    return Replayed(
        archived.job_id,
        archived.document["job"]["taken_at"],
        were,
        reasons,
        seen.texts,
        tuple(changes),
        registers,
        _shown(known),
        _shown(now),
        seen,
        apart,
    )


CONTEXT = ("combtrace", "numpy", "opencv")


def _context(archived: ArchivedJob) -> Iterator[Change]:
    """Versions of what did the work, where they are others."""
    now = (importlib.metadata.version("combtrace"), np.__version__, cv2.__version__)
    for name, version in zip(CONTEXT, now, strict=True):
        if archived.document[name] != version:
            yield Change(name, archived.document[name], version)


def _pages(seen: Measurement, envelope: Envelope | None) -> tuple[tuple[Page, ...], tuple[Reason, ...]]:
    """The pages, or why there are none."""
    if envelope is None or seen.reasons or seen.millimetres is None:
        return (), ()
    try:
        return contour_pages(seen, envelope), ()
    except ContourTooLarge:
        return (), (Reason.TOO_MANY_POINTS,)
    except MailboxError:
        return (), (Reason.SELF_INTERSECTING,)


def _refused_pages(archived: ArchivedJob) -> tuple[Reason, ...]:
    """Why a good measurement gave no pages then."""
    reason = archived.document["job"]["reason"]
    if archived.envelope is None or archived.pages or reason is None:
        return ()
    return (Reason(reason),)


def _fields(known: dict[str, Any], now: dict[str, Any]) -> Iterator[Change]:
    for name in COMPARED:
        if known[name] != now[name]:
            yield Change(name, known[name], now[name])


def _shown(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: fields[name] for name in COMPARED}


def _frames(archived: ArchivedJob, seen: Measurement) -> tuple[Contour | None, Contour | None, str]:
    """The polygon as it was and as it is now, and their unit."""
    frame, unit = ("millimetres", "mm") if seen.millimetres is not None else ("pixels", "px")
    return archived.contour(frame), getattr(seen, frame), unit


def _apart(archived: ArchivedJob, seen: Measurement) -> Apart | None:
    was, now, unit = _frames(archived, seen)
    if was is None or now is None:
        return None
    return apart_of(was, now, unit)


def apart_of(was: Contour, now: Contour, unit: str) -> Apart:
    """How far two outlines are apart."""
    return Apart(0.0 if _same(was, now) else farthest(was, now, COMPARED_AT_MM)[0], unit)


def _outlines(archived: ArchivedJob, seen: Measurement, apart: Apart | None) -> Iterator[Change]:
    """How far the polygons are apart, where they are not the same to the last bit."""
    was, now, _ = _frames(archived, seen)
    if was is None or now is None or apart is None:
        if (was is None) != (now is None):
            yield Change("contour", "none" if was is None else "there", "none" if now is None else "there")
        return
    if _same(was, now):
        return
    holes = "" if len(was.holes) == len(now.holes) else f", {len(now.holes)} holes"
    told = f"{now.point_count} vertices{holes}, up to {apart.distance:.4f} {apart.unit} away"
    yield Change("polygon", f"{was.point_count} vertices", told)


def _same(one: Contour, other: Contour) -> bool:
    return len(one.rings) == len(other.rings) and all(
        np.array_equal(mine, its) for mine, its in zip(one.rings, other.rings, strict=True)
    )


def _page_changes(was: tuple[Page, ...], now: tuple[Page, ...], word_order: WordOrder) -> Iterator[Change]:
    """Header by its fields, payload by its registers."""
    if len(was) != len(now):
        yield Change("pages", len(was), len(now))
        return
    for number, (old, new) in enumerate(zip(was, now, strict=True), start=1):
        before = Unpacking(HEADER_FIELDS)((0, *old.header), word_order)
        after = Unpacking(HEADER_FIELDS)((0, *new.header), word_order)
        for name, value in before.items():
            if value != after[name]:
                yield Change(f"page {number} {name}", value, after[name])
        yield from _payload_changes(number, old.payload, new.payload)


def _payload_changes(number: int, was: tuple[int, ...], now: tuple[int, ...]) -> Iterator[Change]:
    other = [place for place, pair in enumerate(zip(was, now, strict=False)) if pair[0] != pair[1]]
    if len(was) != len(now):
        yield Change(f"page {number} payload", f"{len(was)} registers", f"{len(now)} registers")
    elif other:
        shown = other[:SHOWN_REGISTERS]
        old, new = (" ".join(f"{place}:{registers[place]:04X}" for place in shown) for registers in (was, now))
        more = f" and {len(other) - len(shown)} more" if len(other) > len(shown) else ""
        yield Change(f"page {number} payload", old, new + more)


def _names(reasons: tuple[Reason, ...]) -> str:
    return ", ".join(f"{int(reason)} {reason.label}" for reason in reasons) or "none"
