"""Why a job was not accepted: name, code, outcome, a sentence, and what a person does next.

The one table behind registers, journal, serial replies, log and commands; codes and names are the protocol's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, StrEnum


class Outcome(StrEnum):
    """How a job ends: the block or picture was not good enough (refused), or something did not work (failed)."""

    ACCEPTED = "accepted"
    WRITTEN = "written"
    REFUSED = "refused"
    FAILED = "failed"


class Reason(IntEnum):
    """Reject reasons by code; `reject_reason` in the service block. The first (lowest) that applies is told."""

    NO_FRAME = 100
    STALE_FRAME = 101
    IMAGE_QUALITY = 102
    SCENE_MOVED = 103
    NO_BLOCK_FOUND = 110
    TOUCHES_BORDER = 111
    AREA_OUT_OF_LIMITS = 112
    METHODS_DISAGREE = 113
    UNCERTAINTY_TOO_LARGE = 114
    OUTSIDE_WORK_AREA = 115
    SEVERAL_BLOCKS = 116
    BUSY = 120
    NOT_READY = 121
    UNKNOWN_RECIPE = 122
    TOO_MANY_POINTS = 130
    SELF_INTERSECTING = 131
    CALIBRATION_MISSING = 140
    CALIBRATION_MISMATCH = 141
    SENTINEL_MOVED = 142
    CONTROLLER_TIMEOUT = 150
    CONTROLLER_REFUSED = 151
    CONTROLLER_LOST = 152
    CONTROLLER_RESTARTED = 153
    SERVICE_RESTARTED = 154
    OTHER_SERVICE = 155
    EXPIRED = 156
    STORAGE_FULL = 160
    ABORTED = 161
    INTERNAL_ERROR = 190

    @property
    def label(self) -> str:
        """The protocol's name of the reason: `no_block_found`."""
        return self.name.lower()

    @property
    def outcome(self) -> Outcome:
        """Refused for 101 to 142 and 151, failed for 100 and all others (protocol, "Reject reasons")."""
        refused = Reason.STALE_FRAME <= self <= Reason.SENTINEL_MOVED or self is Reason.CONTROLLER_REFUSED
        return Outcome.REFUSED if refused else Outcome.FAILED


@dataclass(frozen=True)
class Explanation:
    """What a reason means, in one sentence, and the next action for the person at the machine."""

    sentence: str
    next_action: str


EXPLANATIONS: dict[Reason, Explanation] = {
    Reason.NO_FRAME: Explanation(
        "The camera gave no usable picture.", "Check the camera's power and cable, or the file it reads."
    ),
    Reason.STALE_FRAME: Explanation(
        "The picture was exposed before the trigger.", "Trigger again; if it comes back, check the camera's driver."
    ),
    Reason.IMAGE_QUALITY: Explanation(
        "The picture is too blurred, too dark or too bright.", "Clean the lens, check focus, exposure and light."
    ),
    Reason.SCENE_MOVED: Explanation("The scene moved while it was measured.", "Keep hands away and trigger again."),
    Reason.NO_BLOCK_FOUND: Explanation(
        "No block was found in the picture.", "Check that a block lies on the table, the light, and the recipe."
    ),
    Reason.TOUCHES_BORDER: Explanation(
        "The block's contour reaches the edge of the picture.", "Move the block to the middle of the camera's view."
    ),
    Reason.AREA_OUT_OF_LIMITS: Explanation(
        "The contour's area is outside the recipe's limits.", "Check that the right block lies there, or the recipe."
    ),
    Reason.METHODS_DISAGREE: Explanation(
        "An independent estimate of the contour differs too much.", "Check light and table; look at the overlay."
    ),
    Reason.UNCERTAINTY_TOO_LARGE: Explanation(
        "The contour is less certain than the recipe allows.", "Check light, focus and the block's edge."
    ),
    Reason.OUTSIDE_WORK_AREA: Explanation(
        "The contour leaves the machine's work area.", "Move the block into the work area."
    ),
    Reason.SEVERAL_BLOCKS: Explanation(
        "More than one block lies on the table.", "Leave one block on the table, or use a recipe for several."
    ),
    Reason.BUSY: Explanation("A job is being executed.", "Wait for it to end and trigger again."),
    Reason.NOT_READY: Explanation(
        "The service or the controller is not ready.", "See the service's state and its reason."
    ),
    Reason.UNKNOWN_RECIPE: Explanation(
        "The trigger names a recipe that the configuration does not have.", "Add the recipe, or correct its number."
    ),
    Reason.TOO_MANY_POINTS: Explanation(
        "The contour has more vertices than the recipe or the mailbox holds.",
        "Raise tolerance_mm, max_vertices or payload_capacity.",
    ),
    Reason.SELF_INTERSECTING: Explanation(
        "The contour crosses itself or its holes.", "Look at the overlay; check light and method."
    ),
    Reason.CALIBRATION_MISSING: Explanation(
        "There is no calibration file, so pixels cannot become millimetres.", "Calibrate, and name the file."
    ),
    Reason.CALIBRATION_MISMATCH: Explanation(
        "The calibration does not fit the camera or the picture.", "Use the file made for this camera and resolution."
    ),
    Reason.SENTINEL_MOVED: Explanation(
        "A fixed mark is not where the calibration saw it.", "Check that the camera was not moved; calibrate again."
    ),
    Reason.CONTROLLER_TIMEOUT: Explanation(
        "The controller did not answer in time; the job was withdrawn.", "Check the controller's program."
    ),
    Reason.CONTROLLER_REFUSED: Explanation(
        "The controller refused the contour.", "See its answer at the controller or in the journal."
    ),
    Reason.CONTROLLER_LOST: Explanation(
        "The connection to the controller was lost.", "Check the controller's power, cable and address."
    ),
    Reason.CONTROLLER_RESTARTED: Explanation(
        "The controller's program restarted during the job.", "Trigger again; check whether it had accepted before."
    ),
    Reason.SERVICE_RESTARTED: Explanation("The service restarted during the job.", "Trigger again."),
    Reason.OTHER_SERVICE: Explanation(
        "Another service writes to this controller.", "Stop one of the two; one controller has one service."
    ),
    Reason.EXPIRED: Explanation(
        "The contour became too old before the controller took it.", "Check why the controller was not ready."
    ),
    Reason.STORAGE_FULL: Explanation("The disk is full.", "Free space on the state and archive disk."),
    Reason.ABORTED: Explanation("The job was ended by a halt or shutdown.", "Trigger again when the service is Ready."),
    Reason.INTERNAL_ERROR: Explanation(
        "The service met an error of its own.", "Keep the log and the picture, and report them."
    ),
}
