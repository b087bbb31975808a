"""A picture with its contour drawn on it, for people to look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, Int32s
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring
from contour.image import opencv as _cv
from contour.image.picture_check import check_picture

Colour = tuple[int, int, int]

ACCEPTED: Colour = (80, 220, 60)
REFUSED: Colour = (60, 60, 240)
HOLE: Colour = (230, 170, 40)
VERTEX: Colour = (40, 220, 250)
DOUBTED: Colour = (85, 138, 255)
PART: Colour = (240, 110, 220)
"""Blue, green, red. Readable on both dark and bright, and apart for people who tell red from green poorly."""

_TEXT: Colour = (235, 235, 235)

_FRACTION_BITS = 4
"""OpenCV draws at sixteenths of a pixel with these."""

_UNIT_PX = 800
"""Line widths and letters are made for a picture this wide and grow with it."""

_VEIL = 0.35
"""Share of the veil's colour over what the contour may be off by."""

_MOST_MARKS = 400
"""More vertices than this are a line of dots: they are left out."""

_DASH_PX = 20.0
"""From dash to dash, on a picture of `_UNIT_PX`."""


@dataclass(frozen=True)
class Hidden:
    """A part of a contour's ring (0 the exterior, holes follow) that was not seen, by lengths from its first vertex on.

    Where it is not covered it is bridged.
    """

    ring: int
    from_px: float
    to_px: float
    covered: bool


@dataclass(frozen=True)
class DrawnPart:
    """A part laid into the block, in pixels: its outline, how wide a margin it needs around it, where it is tightest
    (a place on its outline and one on the block's), and whether it fits. number: among several; None = the only one.
    """

    outline: Contour
    margin_px: float
    tightest: tuple[tuple[float, float], tuple[float, float]]
    fits: bool
    number: int | None = None


def draw_overlay(
    picture: Bytes,
    contour_px: Contour | None,
    *,
    caption: Sequence[str] = (),
    refused: bool = False,
    marks: bool = True,
    uncertainty_px: float | None = None,
    shown_px: Sequence[Float64s] = (),
    hidden: Sequence[Hidden] = (),
    parts: Sequence[DrawnPart] = (),
    ribbon: tuple[tuple[float, float], tuple[float, float]] | None = None,
) -> Bytes:
    """The picture as BGR, shape (H + h, W, 3), with the contour and its vertices, below h rows with lines of text.

    Exterior green, or red where `refused`, holes blue, vertices yellow (without `marks` none). The first caption line
    is the largest. Where `uncertainty_px` is wider than the line, a veil covers what lies within it. `shown_px`,
    paths (N, 2) that show why it is refused, lie over all in yellow. Of `hidden` parts bridged ones are
    dashed, covered ones red and wide; the rest of a refused exterior then is orange. `parts` are drawn in violet, or
    red where one does not fit, margins as veils around them, tightest places as lines with dots, numbers within.
    `ribbon` is a white line from end to end with an L, the core's direction. Raises PictureError.
    """
    check_picture(picture)
    canvas = _cv.bgr(picture)
    unit = max(max(canvas.shape[:2]) / _UNIT_PX, 1.0)
    text = _Caption.fitted(caption, canvas.shape[1], unit)
    if contour_px is not None:
        if uncertainty_px is not None:
            _draw_band(canvas, contour_px, uncertainty_px, unit)
        for hole in contour_px.holes:
            _draw_ring(canvas, hole, HOLE, unit)
        doubted = any(one.covered for one in hidden)
        _draw_ring(canvas, contour_px.exterior, (DOUBTED if doubted else REFUSED) if refused else ACCEPTED, unit)
        for one in hidden:
            _draw_hidden(canvas, RingLengths.of(contour_px.rings[one.ring]), one, unit)
        if marks and contour_px.point_count <= _MOST_MARKS:
            for ring in contour_px.rings:
                _mark_vertices(canvas, ring, unit)
    for part in parts:
        _draw_part(canvas, part, unit)
    if ribbon is not None:
        _draw_ribbon(canvas, np.array(ribbon), unit)
    for path in shown_px:
        _draw_path(canvas, path, (0, 0, 0), 2 * _line_width(unit) + 2)
        _draw_path(canvas, path, VERTEX, 2 * _line_width(unit))
    canvas = text.above(canvas)
    text.write(canvas, REFUSED if refused else ACCEPTED, unit)
    return canvas


def _fixed_point(points: Float64s) -> Int32s:
    limit = 2**30
    return np.asarray(np.clip(np.round(points * (1 << _FRACTION_BITS)), -limit, limit), np.int32)


def _draw_ring(canvas: Bytes, ring: Ring, colour: Colour, unit: float) -> None:
    points = _fixed_point(ring).reshape(-1, 1, 2)
    width = _line_width(unit)
    # A dark line below keeps the colour visible on bright walls.
    for tone, thickness in (((0, 0, 0), width + 2), (colour, width)):
        cv2.polylines(canvas, [points], True, tone, thickness, cv2.LINE_AA, _FRACTION_BITS)


def _draw_hidden(canvas: Bytes, ring: RingLengths, part: Hidden, unit: float) -> None:
    """Over the line of its ring."""
    if part.covered:
        _draw_path(canvas, ring.path(part.from_px, part.to_px), (0, 0, 0), 2 * _line_width(unit) + 2)
        _draw_path(canvas, ring.path(part.from_px, part.to_px), REFUSED, 2 * _line_width(unit))
        return
    count = max(round((part.to_px - part.from_px) / (_DASH_PX * unit)), 1)
    # Gaps are drawn: a quarter of the way each, which the line's round ends make longer.
    ends = np.linspace(part.from_px, part.to_px, 8 * count + 1)
    for start, end in zip(ends[3::8].tolist(), ends[5::8].tolist(), strict=True):
        _draw_path(canvas, ring.path(start, end), (0, 0, 0), _line_width(unit) + 2)


def _draw_path(canvas: Bytes, path: Float64s, colour: Colour, width: int) -> None:
    points = _fixed_point(path).reshape(-1, 1, 2)
    cv2.polylines(canvas, [points], False, colour, width, cv2.LINE_AA, _FRACTION_BITS)


def _draw_band(canvas: Bytes, contour_px: Contour, half_px: float, unit: float) -> None:
    width = round(2.0 * half_px)
    if width <= _line_width(unit) + 2:
        return
    band = np.zeros(canvas.shape[:2], np.uint8)
    for ring in contour_px.rings:
        cv2.polylines(
            band, [_fixed_point(ring).reshape(-1, 1, 2)], True, 255, min(width, 255), cv2.LINE_8, _FRACTION_BITS
        )
    inside = band > 0
    canvas[inside] = (canvas[inside] * (1.0 - _VEIL) + np.array(VERTEX) * _VEIL).astype(np.uint8)


def _draw_part(canvas: Bytes, part: DrawnPart, unit: float) -> None:
    rings = [_fixed_point(ring).reshape(-1, 1, 2) for ring in part.outline.rings]
    around, inside = np.zeros(canvas.shape[:2], np.uint8), np.zeros(canvas.shape[:2], np.uint8)
    # OpenCV draws no wider than 32767 px, and no picture has a margin of so many.
    width = max(min(round(2.0 * part.margin_px), 32_767), 1)
    cv2.polylines(around, rings, True, 255, width, cv2.LINE_8, _FRACTION_BITS)
    cv2.fillPoly(inside, rings, 255, cv2.LINE_8, _FRACTION_BITS)
    veiled = (around > 0) & (inside == 0)
    canvas[veiled] = (canvas[veiled] * (1.0 - _VEIL) + np.array(PART) * _VEIL).astype(np.uint8)
    for ring in part.outline.rings:
        _draw_ring(canvas, ring, PART if part.fits else REFUSED, unit)
    ends = np.array(part.tightest)
    _draw_path(canvas, ends, (0, 0, 0), _line_width(unit) + 4)
    _draw_path(canvas, ends, VERTEX, _line_width(unit) + 2)
    _mark_vertices(canvas, ends, 1.6 * unit)
    if part.number is not None:
        _draw_number(canvas, str(part.number), inside, unit)


def _draw_number(canvas: Bytes, number: str, inside: Bytes, unit: float) -> None:
    """The number, its middle where it is farthest from the border of `inside`."""
    left, top, width, height = cv2.boundingRect(inside)
    framed = np.pad(inside[top : top + height, left : left + width], 1)
    depth = cv2.distanceTransform(framed, cv2.DIST_L2, cv2.DIST_MASK_3)
    _, _, _, (x, y) = cv2.minMaxLoc(depth)
    _draw_text(canvas, number, (left + int(x) - _text_width(number, unit) // 2, top + int(y) + round(11 * unit)), unit)


def _draw_ribbon(canvas: Bytes, ends: Float64s, unit: float) -> None:
    for tone, width in (((0, 0, 0), _line_width(unit) + 4), (_TEXT, _line_width(unit) + 1)):
        _draw_path(canvas, ends, tone, width)
    x, y = np.round(ends[1] + 6 * unit).astype(int).tolist()
    _draw_text(canvas, "L", (x, y), unit)


def _draw_text(canvas: Bytes, text: str, place: tuple[int, int], unit: float) -> None:
    for tone, stroke in (((0, 0, 0), round(5 * unit)), (_TEXT, max(round(2 * unit), 1))):
        cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, unit, tone, stroke, cv2.LINE_AA)


def _line_width(unit: float) -> int:
    return max(round(1.5 * unit), 1)


def _mark_vertices(canvas: Bytes, ring: Ring, unit: float) -> None:
    radius = round(2.5 * unit) << _FRACTION_BITS
    for x, y in _fixed_point(ring).tolist():
        cv2.circle(canvas, (x, y), radius, VERTEX, -1, cv2.LINE_AA, _FRACTION_BITS)


@dataclass(frozen=True)
class _Caption:
    """Lines of text with their place, shrunk so that the longest fits the picture's width."""

    lines: Sequence[str]
    sizes: Sequence[float]
    margin: int
    line_height: int

    @classmethod
    def fitted(cls, lines: Sequence[str], width: int, unit: float) -> _Caption:
        margin = round(8 * unit)
        sizes = [0.62 * unit] + [0.5 * unit] * (len(lines) - 1)
        longest = max((_text_width(line, size) for line, size in zip(lines, sizes, strict=False)), default=0)
        shrink = min(1.0, max(width - 2 * margin, 1) / max(longest, 1))
        return cls(lines, [size * shrink for size in sizes], margin, max(round(24 * unit * shrink), 1))

    @property
    def height(self) -> int:
        """Rows that the text takes."""
        return self.margin + self.line_height * len(self.lines) if self.lines else 0

    def above(self, canvas: Bytes) -> Bytes:
        """The canvas with black rows above it that the text will stand on."""
        return np.vstack([np.zeros((self.height, *canvas.shape[1:]), np.uint8), canvas])

    def write(self, canvas: Bytes, colour: Colour, unit: float) -> None:
        stroke = max(round(1.2 * unit), 1)
        for k, (line, size) in enumerate(zip(self.lines, self.sizes, strict=False)):
            place = (self.margin, self.margin + self.line_height * (k + 1) - round(0.35 * self.line_height))
            tone = colour if k == 0 else _TEXT
            cv2.putText(canvas, line, place, cv2.FONT_HERSHEY_SIMPLEX, size, tone, stroke, cv2.LINE_AA)


def _text_width(line: str, size: float) -> int:
    # A stroke of 2 and more takes the bold, wider letters.
    return int(cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, size, 2)[0][0])
