"""Small pictures of a job for a report: as it was, as it is now, and where the outlines lie farthest apart."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour, farthest
from contour.image.overlay import ACCEPTED, REFUSED
from service.records.replay import Apart
from service.replays.rows import Side

WIDTH = 360  # of a picture in the report: forty of them weigh about a megabyte
PLACE_PX = 90  # half the side of the place that is shown, of the frame's pixels
QUALITY = 75
_FRACTION_BITS = 4


@dataclass(frozen=True)
class Thumbnails:
    """JPEGs. place: both outlines, before thick and red, after thin and green; None where they do not differ."""

    before: bytes
    after: bytes
    place: bytes | None


def thumbnails(frame: Bytes, before: Side, after: Side, apart: Apart | None) -> Thumbnails:
    """Drawn from the frame, shape (H, W) or (H, W, 3), and both sides' outlines in pixels."""
    was, now = before.contour("pixels"), after.contour("pixels")
    colours = [REFUSED if side.codes else ACCEPTED for side in (before, after)]
    whole = [_jpeg(_whole(frame, outline, colour)) for outline, colour in zip((was, now), colours, strict=True)]
    place = None if apart is None or apart.distance == 0 or was is None or now is None else _place(frame, was, now)
    return Thumbnails(whole[0], whole[1], None if place is None else _jpeg(place))


def _whole(frame: Bytes, outline: Contour | None, colour: tuple[int, int, int]) -> Bytes:
    scale = min(WIDTH / frame.shape[1], 1.0)
    size = round(frame.shape[1] * scale), max(round(frame.shape[0] * scale), 1)
    small = _bgr(np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), dtype=np.uint8))
    if outline is not None:
        _draw(small, outline, colour, 2, scale, np.zeros(2))
    return small


def _place(frame: Bytes, was: Contour, now: Contour) -> Bytes:
    """The frame around the place where the outlines are farthest apart, enlarged, with both."""
    _, place = farthest(was, now, 1.0)
    corner = np.clip(np.round(place).astype(int) - PLACE_PX, 0, None)
    part = frame[corner[1] : corner[1] + 2 * PLACE_PX, corner[0] : corner[0] + 2 * PLACE_PX]
    scale = WIDTH / (2 * PLACE_PX)
    shown = _bgr(np.asarray(cv2.resize(part, None, fx=scale, fy=scale), dtype=np.uint8))
    _draw(shown, was, REFUSED, 3, scale, corner.astype(np.float64))
    _draw(shown, now, ACCEPTED, 1, scale, corner.astype(np.float64))
    return shown


def _bgr(picture: Bytes) -> Bytes:
    if picture.ndim == 3:
        return picture
    return np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def _draw(
    picture: Bytes, outline: Contour, colour: tuple[int, int, int], width: int, scale: float, corner: Float64s
) -> None:
    """Rings over the picture, which shows the frame from `corner` on; pixels' centres stay pixels' centres."""
    for ring in outline.rings:
        points = ((ring - corner + 0.5) * scale - 0.5) * (1 << _FRACTION_BITS)
        cv2.polylines(picture, [np.round(points).astype(np.int32)], True, colour, width, cv2.LINE_AA, _FRACTION_BITS)


def _jpeg(picture: Bytes) -> bytes:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return data.tobytes()
