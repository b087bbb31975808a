"""Whether a new job can be numbered above `last_job`, the controller's own note of what it last decided."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # who reads the journal wants LARGEST_JOB, and no event loop with it
    from service.link.reading import LinkReading
    from service.link.writing import ServiceBlockWriting

LARGEST_JOB = (1 << 32) - 1
LARGEST_STEP = 1_000_000  # protocol: a last_job further above all that is known is a fault of the controller


class JobNumbers:
    """What is known of job numbers on both sides. highest_known: in the journal, or found in the service block."""

    def __init__(self, reading: LinkReading, writing: ServiceBlockWriting) -> None:
        self._reading = reading
        self._writing = writing
        self.highest_known = 0
        self._confirmed: int | None = None  # a last_job that a person took as right

    @property
    def highest(self) -> int:
        """The highest job number that is known on our side."""
        return max(self.highest_known, self._writing.published.job_id)

    def fault(self) -> str | None:
        """Why no job can be numbered above `last_job`, as a sentence; None where it can."""
        last_job = self._reading.last_job
        if last_job is None:
            return "last_job has not held over two changes of the controller's heartbeat yet"
        known = self.highest
        if last_job >= LARGEST_JOB:
            return f"last_job is {last_job}: no higher job number is left. Correct it at the controller"
        if last_job > known + LARGEST_STEP and last_job != self._confirmed:
            return (
                f"last_job is {last_job}, expected {known} or little more: this looks like a fault of the "
                "controller. Correct it there; where it is right, `combtrace confirm`"
            )
        return None

    def in_doubt(self) -> str | None:
        """Why a number that is given now may not be above `last_job`, as a sentence; None where it is."""
        view, last_job = self._reading.view, self._reading.last_job
        if view is None or last_job is None or view.last_job <= max(self.highest, last_job):
            return None
        return f"last_job seems to be {view.last_job}: whether that holds is being watched"

    def confirm(self) -> str | None:
        """A person's word that `last_job` is right: that as a sentence, None where nothing waits for it."""
        last_job = self._reading.last_job
        if last_job is None or self.fault() is None or last_job >= LARGEST_JOB:
            return None
        self._confirmed = last_job
        return f"last_job {last_job} is taken as right: jobs are numbered above it"
