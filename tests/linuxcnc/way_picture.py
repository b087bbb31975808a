"""A picture of the block, the contour that was sent, and the way that the machine went; for `docs/`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.support.scenes.sample_scenes import CAMERA, THICKNESS_MM

SAMPLE = Path(__file__).parents[2] / "service" / "samples" / "4-with-holes.jpg"
GREEN, BLUE, ORANGE, WHITE = (80, 220, 80), (255, 160, 40), (0, 140, 255), (255, 255, 255)
ZOOM, CUTOUT = 16, 40  # pixels of the inset for one of the picture, and its side in pixels of the picture

Rings = list[NDArray[np.float64]]


def draw_way(path: Path, truth: Rings, sent: Rings, went: Rings) -> None:
    """Write the picture: all in mm of the work frame, `went` one open line of samples."""
    picture = cv2.imread(str(SAMPLE))
    corner = _pixels(sent[0])[np.argmin(_pixels(sent[0])[:, 0])]
    origin = np.round(corner - CUTOUT / 2)
    inset = cv2.resize(_cut(picture, origin), None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_NEAREST)
    for ring in sent:
        _line(picture, _pixels(ring), BLUE, 2)
    for part in went:
        for x, y in np.round(_pixels(part)[::25]).astype(int):
            cv2.circle(picture, (x, y), 4, ORANGE, -1, cv2.LINE_AA)
    for rings, colour, thickness in ((truth, GREEN, 5), (sent, BLUE, 3)):
        for ring in rings:
            _line(inset, (_pixels(ring) - origin + 0.5) * ZOOM - 0.5, colour, thickness)
    for x, y in np.round((_pixels(went[0]) - origin + 0.5) * ZOOM - 0.5).astype(int):
        cv2.circle(inset, (int(x), int(y)), 3, ORANGE, -1, cv2.LINE_AA)
    cv2.rectangle(picture, *[tuple(np.round(origin + shift).astype(int).tolist()) for shift in (0, CUTOUT)], WHITE, 2)
    side = CUTOUT * ZOOM
    sheet = np.full((picture.shape[0], picture.shape[1] + side + 20, 3), 32, np.uint8)
    sheet[:, : picture.shape[1]] = picture
    sheet[40 : 40 + side, picture.shape[1] + 10 : picture.shape[1] + 10 + side] = inset
    legend = (("true outline", GREEN), ("contour sent", BLUE), ("way of the machine", ORANGE))
    for number, (text, colour) in enumerate(legend):
        place = (picture.shape[1] + 20, side + 100 + 50 * number)
        cv2.putText(sheet, text, place, cv2.FONT_HERSHEY_SIMPLEX, 1.1, colour, 2, cv2.LINE_AA)
    small = cv2.resize(sheet, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(path), small, [cv2.IMWRITE_JPEG_QUALITY, 88])


def _pixels(ring: NDArray[np.float64]) -> NDArray[np.float64]:
    return CAMERA.project(ring, THICKNESS_MM)


def _cut(picture: NDArray[np.uint8], origin: NDArray[np.float64]) -> NDArray[np.uint8]:
    x, y = origin.astype(int)
    return picture[y : y + CUTOUT, x : x + CUTOUT]


def _line(picture: NDArray[np.uint8], ring: NDArray[np.float64], colour: tuple[int, int, int], thickness: int) -> None:
    cv2.polylines(picture, [np.round(ring * 16).astype(np.int32)], True, colour, thickness, cv2.LINE_AA, 4)
