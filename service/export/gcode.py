"""G-code for LinuxCNC: along the holes, then along the exterior, each begun and ended clear of the material; where a
part is laid into the block, along the part's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from string import Template
from typing import Literal

import numpy as np

from contour.geometry.rings import Contour, Ring, oriented
from contour.geometry.segments import contains, distances_to_ring
from service.export.document import ExportDocument, ExportError

TEMPLATE = """\
(combtrace: $note)
($moves)
G17 G21 G40 G49 G80 G90 G94
G64 P$path_tolerance_mm
G0 Z$safe_z_mm
$rings
G0 Z$safe_z_mm
M2
"""
PLACEHOLDERS = frozenset({"note", "moves", "path_tolerance_mm", "safe_z_mm", "cut_z_mm", "feed_mm_min", "rings"})
Direction = Literal["climb", "conventional"]


@dataclass(frozen=True)
class GcodeSettings:
    """How a machine moves along a contour; heights above the table, mm.

    cut_z_mm: height of the tool along the rings; None = it stays at the safe height, which only shows the way.
    direction: climb has the material on the right of the way, as a clockwise turning tool wants it.
    lead_in_mm: length of a straight way onto each ring through what is no material; 0 = straight down onto the ring.
    template: the program around `$rings`, a string.Template with the names of PLACEHOLDERS.
    """

    feed_mm_min: float = 3000.0
    plunge_mm_min: float = 600.0
    safe_z_mm: float | None = None
    cut_z_mm: float | None = None
    path_tolerance_mm: float = 0.01
    direction: Direction = "climb"
    lead_in_mm: float = 0.0
    template: str = TEMPLATE


SAFE_ABOVE_MM = 20.0  # above the block, where no safe height is set


def to_gcode(document: ExportDocument, settings: GcodeSettings | None = None) -> bytes:
    """The program, ASCII, absolute millimetres; raise ExportError where heights, lead-in or template do not fit."""
    settings = settings or GcodeSettings()
    safe_z_mm = document.thickness_mm + SAFE_ABOVE_MM if settings.safe_z_mm is None else settings.safe_z_mm
    cut_z_mm = safe_z_mm if settings.cut_z_mm is None else settings.cut_z_mm
    _check_heights(document, settings, safe_z_mm, cut_z_mm)
    parts = document.oriented_parts()
    lines: list[str] = []
    for count, contour in enumerate(parts or [document.oriented()], 1):
        whose = "" if not parts else "part's " if len(parts) == 1 else f"part {count}'s "
        for name, ring in _rings(contour, settings):
            start, lead = _begin(ring, contour, settings.lead_in_mm, whose + name)
            lines += [f"({whose}{name}, {len(ring)} vertices)", *_along(start, lead, settings, safe_z_mm, cut_z_mm)]
    words = {
        "note": document.note,
        "moves": "dry run: no height of cut is set" if settings.cut_z_mm is None else f"cuts at Z {cut_z_mm:g}",
        "path_tolerance_mm": _number(settings.path_tolerance_mm),
        "safe_z_mm": _number(safe_z_mm),
        "cut_z_mm": _number(cut_z_mm),
        "feed_mm_min": _number(settings.feed_mm_min),
        "rings": "\n".join(lines),
    }
    return filled(settings.template, words).encode("ascii")


def _rings(contour: Contour, settings: GcodeSettings) -> list[tuple[str, Ring]]:
    """The rings in the order in which they are cut, holes first, each with its name."""
    clockwise = settings.direction == "climb"
    holes = [oriented(ring, counter_clockwise=clockwise) for ring in contour.holes]
    named = [(f"hole {number}", ring) for number, ring in enumerate(holes, 1)]
    return [*named, ("exterior", oriented(contour.exterior, counter_clockwise=not clockwise))]


def filled(template: str, words: dict[str, str]) -> str:
    """The template with its placeholders filled in; raise ExportError for one that is not known or not closed."""
    try:
        text = Template(template).substitute(words)
    except (KeyError, ValueError) as error:
        known = ", ".join(f"${name}" for name in sorted(PLACEHOLDERS))
        raise ExportError(f"G-code template: {error}; expected only {known}; write $$ for a dollar sign") from error
    if words["rings"] not in text:
        raise ExportError("G-code template: no $rings in it; expected it where the moves go. Add it")
    if not text.isascii():
        raise ExportError("G-code template: letters beyond ASCII, which controllers do not read. Take them out")
    return text


def _check_heights(document: ExportDocument, settings: GcodeSettings, safe_z_mm: float, cut_z_mm: float) -> None:
    if safe_z_mm <= document.thickness_mm:
        raise ExportError(
            f"safe_z_mm {safe_z_mm:g} is not above the block of {document.thickness_mm:g} mm; "
            "expected a height at which the tool passes over it. Raise it"
        )
    if cut_z_mm > safe_z_mm:
        raise ExportError(f"cut_z_mm {cut_z_mm:g} is above safe_z_mm {safe_z_mm:g}; expected it below. Correct one")
    for name in ("feed_mm_min", "plunge_mm_min", "path_tolerance_mm"):
        if not getattr(settings, name) > 0:
            raise ExportError(f"{name} {getattr(settings, name):g}: expected above 0")


def _along(ring: Ring, lead: Ring | None, settings: GcodeSettings, safe_z_mm: float, cut_z_mm: float) -> Iterator[str]:
    """Moves to the ring, down, around it, and up."""
    first = ring[0] if lead is None else lead
    yield f"G0 Z{_number(safe_z_mm)}"
    yield f"G0 {_point(first)}"
    yield f"G1 Z{_number(cut_z_mm)} F{_number(settings.plunge_mm_min)}"
    rest = [*ring[1:], ring[0]] if lead is None else [*ring, ring[0], lead]
    for index, point in enumerate(rest):
        yield f"G1 {_point(point)}" + (f" F{_number(settings.feed_mm_min)}" if index == 0 else "")
    yield f"G0 Z{_number(safe_z_mm)}"


def _begin(ring: Ring, contour: Contour, length_mm: float, name: str) -> tuple[Ring, Ring | None]:
    """The ring from where it is begun, and where the lead-in begins; raise ExportError where none is free.

    The lead-in comes at right angles to an edge's middle, through what is no material: outside of the exterior, inside
    of a hole. Only from there on is the way free, so it must not come nearer to any ring than its own end does.
    """
    if length_mm <= 0:
        return ring, None
    following = np.roll(ring, -1, axis=0)
    lengths = np.hypot(*(following - ring).T)
    for edge in np.argsort(-lengths):
        middle = (ring[edge] + following[edge]) / 2
        along = (following[edge] - ring[edge]) / lengths[edge]
        for normal in (np.array([along[1], -along[0]]), np.array([-along[1], along[0]])):
            start = middle + normal * length_mm
            if _free(start, middle, length_mm, contour):
                return np.vstack([middle[None], np.roll(ring, -int(edge) - 1, axis=0)]), start
    raise ExportError(
        f"{name}: no edge has {length_mm:g} mm free before it for the lead-in; expected one. Shorten lead_in_mm"
    )


def _free(start: Ring, end: Ring, length_mm: float, contour: Contour) -> bool:
    """Whether the way from start to its end on a ring runs through what is no material."""
    share = np.linspace(0, 0.98, max(math.ceil(length_mm / 0.5), 8))[:, None]
    points = start + (end - start) * share
    inside = contains(contour.exterior, points)
    for hole in contour.holes:
        inside &= ~contains(hole, points)
    if inside.any():
        return False
    left_mm = length_mm * (1 - share[:, 0])
    return all(bool((distances_to_ring(points, ring) >= left_mm * 0.999 - 1e-9).all()) for ring in contour.rings)


def _point(point: Ring) -> str:
    return f"X{_number(point[0])} Y{_number(point[1])}"


def _number(value: float) -> str:
    """A number as G-code has it: a tenth of a micrometre, no exponent, no -0."""
    text = f"{float(value):.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
