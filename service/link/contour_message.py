"""A measured contour becomes the pages of a job: the one way there, for a job as for its replay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.controller.errors import ContourTooLarge
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, micrometres
from drivers.controller.mailbox.part_block import PlacedPart, with_parts
from drivers.controller.mailbox.words import WordOrder
from service.measuring.measurement import Measurement

if TYPE_CHECKING:
    from service.parts.fit import PartFit

UNCERTAINTY_FACTOR = 1000.0  # mm to µm
MICRODEGREES = 1e6


@dataclass(frozen=True)
class Envelope:
    """What stands in a job's pages and was not measured, and how they are laid out.

    captured_at, valid_for_ms: on the controller's clock, ms. trigger: the counter it answers, 0 = another kind.
    single_page: nobody answers, so nobody knows when a page was read, and the next would overwrite it unseen.
    part_capacity: registers of the part block behind its header; None = the controller has none.
    """

    job_id: int
    recipe: int
    captured_at: int
    valid_for_ms: int
    session: int
    trigger: int
    simulated: bool
    word_order: WordOrder = "big"
    payload_capacity: int = 1984
    single_page: bool = False
    part_capacity: int | None = None


def contour_pages(measurement: Measurement, envelope: Envelope) -> tuple[Page, ...]:
    """The pages of a contour in millimetres; raise MailboxError, ContourTooLarge."""
    contour = measurement.millimetres
    assert contour is not None
    assert measurement.area_mm2 is not None
    sure = measurement.uncertainty_mm
    message = ContourMessage(
        job_id=envelope.job_id,
        rings_um=tuple(micrometres(ring) for ring in contour.rings),
        area_mm2=round(measurement.area_mm2),
        uncertainty_um=None if sure is None else round(sure * UNCERTAINTY_FACTOR),
        captured_at=envelope.captured_at,
        recipe=envelope.recipe,
        simulated=envelope.simulated,
        aligned=measurement.aligned,
        valid_for_ms=envelope.valid_for_ms,
        session=envelope.session,
        trigger=envelope.trigger,
    )
    pages = encode_pages(message, envelope.payload_capacity, envelope.word_order)
    if envelope.single_page and len(pages) > 1:
        raise ContourTooLarge(
            f"{contour.point_count} vertices need {len(pages)} pages of {envelope.payload_capacity} registers, "
            "a controller that cannot answer takes one: raise tolerance_mm or payload_capacity"
        )
    if envelope.part_capacity is None:
        return pages
    parts = [_placed(fit) for fit in measurement.laid]
    return with_parts(pages, parts, envelope.part_capacity, envelope.word_order)


def _placed(fit: PartFit) -> PlacedPart:
    pose = fit.placement.pose
    return PlacedPart(
        number=fit.number,
        x_um=round(pose.x * 1000),
        y_um=round(pose.y * 1000),
        angle_udeg=round(pose.angle_deg * MICRODEGREES),
        margin_um=math.floor(fit.margin_mm * 1000),
        needed_um=math.ceil(fit.needed_mm * 1000),
        rings_um=tuple(micrometres(ring) for ring in fit.placed.rings),
    )
