"""What speaks against a picture: how walls show in it, the picture as a whole, and the taught table."""

from __future__ import annotations

from contour.acceptance.findings import Finding, Refusal
from contour.acceptance.quality import QualityLimits, picture_faults, quality_faults
from contour.acceptance.trace_check import CheckedTrace
from contour.geometry.arrays import Bytes
from contour.image.taught_table import TableLimits, TableLook

# An edge is carried across as much where ends of walls are lost.
_MOST_ALIKE_PITCHES = 4.0


def badly_seen(traced: CheckedTrace | None, limits: QualityLimits) -> list[Finding]:
    """What is too bad about how the block's walls are seen, all in one finding."""
    if traced is None or traced.quality is None:
        return []
    faults = quality_faults(traced.quality, limits)
    return [_bad_picture(". Besides, ".join(faults))] if faults else []


def alike_table(traced: CheckedTrace | None) -> Finding | None:
    """An edge beside which the table is as light as walls, along more than what things hide of it."""
    if traced is None or traced.alike is None or traced.trace.pitch_px is None:
        return None
    alike, stretches = traced.alike, traced.trace.evidence or ()
    hidden_px = sum(stretch.length_px for stretch in stretches if stretch.state != "seen")
    if alike.length_pitches <= max(_MOST_ALIKE_PITCHES, hidden_px / traced.trace.pitch_px):
        return None
    x, y = alike.place_px
    return _bad_picture(
        f"along {alike.length_pitches:.0f} cells of the edge, near ({x:.0f}, {y:.0f}) px, what lies beside the block "
        f"is as light as its walls, so that their ends do not show; {_MOST_ALIKE_PITCHES:g} cells are allowed. Use a "
        "table that is darker or of another colour, and light that leaves it dark"
    )


def useless_picture(picture: Bytes | None) -> list[Finding]:
    """What is wrong with a picture as a whole, whatever it shows."""
    return [] if picture is None else [_bad_picture(fault) for fault in picture_faults(picture)]


def _bad_picture(fault: str) -> Finding:
    return Finding(Refusal.IMAGE_QUALITY, f"The picture is not good enough: {fault}.")


def judge_table(look: TableLook, limits: TableLimits) -> tuple[Finding, ...]:
    """Why the picture cannot be trusted: light or camera are not as they were when the table was taught."""
    if look.shift_px is not None and look.shift_px > limits.max_shift_px:
        return (
            Finding(
                Refusal.SCENE_MOVED,
                f"The table's pattern has moved by {look.shift_px:.1f} px since it was taught, at most "
                f"{limits.max_shift_px:g} px is allowed. If camera or table were moved, calibrate and teach the table "
                "again.",
            ),
        )
    low, high = limits.gain
    if not low <= look.gain <= high:
        return (
            Finding(
                Refusal.IMAGE_QUALITY,
                f"The table's light is {100 * look.gain:.0f} % of what it was when it was taught, {100 * low:.0f} to "
                f"{100 * high:.0f} % is allowed. Check lamp and exposure, or teach the table again.",
            ),
        )
    if look.rim_share < limits.min_rim_share:
        return (
            Finding(
                Refusal.IMAGE_QUALITY,
                f"Of the picture's rim {100 * look.rim_share:.0f} % looks as the table was taught, at least "
                f"{100 * limits.min_rim_share:.0f} % is needed. Clear the table, check that light and camera are as "
                "they were, or teach the table again.",
            ),
        )
    return ()
