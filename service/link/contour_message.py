"""A measured contour becomes the pages of a job: the one way there, for a job as for its replay."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.controller.errors import ContourTooLarge
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, micrometres
from drivers.controller.mailbox.words import WordOrder
from service.measuring.measurement import Measurement

UNCERTAINTY_FACTOR = 1000.0  # mm to µm


@dataclass(frozen=True)
class Envelope:
    """What stands in a job's pages and was not measured, and how they are laid out.

    captured_at, valid_for_ms: on the controller's clock, ms. trigger: the counter it answers, 0 = another kind.
    single_page: nobody answers, so nobody knows when a page was read, and the next would overwrite it unseen.
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
    return pages
