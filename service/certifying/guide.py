"""What to lay and photograph: the plan at the start, and what is missing as pictures come."""

from __future__ import annotations

from collections.abc import Sequence

from contour.length_test.coverage import FEWEST_A_DIRECTION, FEWEST_PLACES, Missing, missing
from service.certifying.sight import Eye, Sight

DIRECTIONS = {
    "x": "along x",
    "y": "along y",
    "rising": "rising to the right (45 degrees)",
    "falling": "falling to the right (135 degrees)",
}


def plan(places: int) -> str:
    """What is wanted, in words."""
    return (
        f"wanted: {places} places of the gauge or more (at least {FEWEST_PLACES}), each in a picture of its own: the "
        "middle, then the corners of the field, turned differently each time. Together they must reach all nine parts "
        f"of the field, and show {FEWEST_A_DIRECTION} lengths or more along x, along y and along both diagonals"
    )


def still_missing(kept: Sequence[Sight], eye: Eye, height_mm: float, places: int) -> Missing:
    """What the pictures that serve lack."""
    gauges = [sight.gauge for sight in kept if sight.gauge is not None]
    return missing(gauges, eye.calibration, height_mm, places)


def told(lack: Missing) -> str:
    """What is missing, and how to lay the gauge next."""
    parts = []
    if lack.places:
        parts.append(f"{lack.places} more place{'s' if lack.places > 1 else ''}")
    if lack.zones:
        parts.append(f"the gauge in these parts of the picture: {', '.join(_zone(zone) for zone in lack.zones)}")
    parts += [f"{count} more length{'s' if count > 1 else ''} {DIRECTIONS[name]}" for name, count in lack.directions]
    return "; ".join(parts)


def _zone(zone: tuple[str, str]) -> str:
    column, row = zone
    return "middle" if column == row == "middle" else f"{row} {column}"
