"""What keeps the remnants of accepted jobs, as configured."""

from __future__ import annotations

import logging
from collections.abc import Callable

from service.config.config import RemnantsSettings
from service.parts.part import PartFileError
from service.parts.remnant import Worth
from service.reasons import Outcome
from service.records.evidence import Evidence, overlay_bytes
from service.records.remnants import Remnants, RemnantsError

log = logging.getLogger("combtrace.archive")


def remnants_keeper(settings: RemnantsSettings) -> Callable[[Evidence], None]:
    """What notes what is left of a block whose parts the controller took; a list that fails is told, never raised."""
    remnants = Remnants(settings.path)
    worth = Worth(settings.kerf_mm, settings.min_area_mm2, settings.min_width_mm)

    def keep(evidence: Evidence) -> None:
        job, seen, frame = evidence.job, evidence.measurement, evidence.frame
        if job.outcome not in (Outcome.ACCEPTED, Outcome.WRITTEN) or seen is None or frame is None or not seen.laid:
            return
        try:
            numbers = remnants.keep(f"job {job.job_id}", seen, worth, overlay_bytes(frame, seen))
        except (RemnantsError, PartFileError) as error:
            log.warning("job %d: its remnants are not kept: %s", job.job_id, error)
            return
        if numbers:
            log.info("job %d: remnants %s", job.job_id, ", ".join(map(str, numbers)))

    return keep
