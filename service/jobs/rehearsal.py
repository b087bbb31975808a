"""A first trace that nobody waits for: what numpy and OpenCV load and set up once is there when the first job comes."""

from __future__ import annotations

import logging
import time

import cv2
import numpy as np
from numpy.typing import NDArray

from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer

log = logging.getLogger("combtrace.rehearsal")

_SIDE_PX = 6.0
_CELLS = 6  # a row and a column; with four the outline has too few walls to be traced


def rehearse() -> None:
    """Trace a drawn comb, a tenth of a second of work; touches no device, file or record. A failure is logged."""
    begun = time.perf_counter()
    try:
        measurement = Measurer(None).measure(drawn_comb(), PlainRecipe(), 0.0)
    except Exception as error:  # noqa: BLE001 - whatever it is: the first job will tell, and may well succeed
        log.warning("rehearsal: %s: %s", type(error).__name__, error)
        return
    told = "; ".join(measurement.texts) or "traced"
    log.debug("rehearsal: %s, %.0f ms", told, (time.perf_counter() - begun) * 1000)


def drawn_comb() -> NDArray[np.uint8]:
    """A block of bright walls on a dark table, (120, 150), uint8."""
    picture = np.full((120, 150), 25, np.uint8)
    angles = np.arange(6) * np.pi / 3
    corners = _SIDE_PX * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    for row in range(_CELLS):
        for column in range(_CELLS):
            centre = (40 + (column + row % 2 / 2) * _SIDE_PX * np.sqrt(3), 35 + row * _SIDE_PX * 1.5)
            points = np.round((centre + corners) * 16).astype(np.int32)
            cv2.polylines(picture, [points], True, (220,), 2, cv2.LINE_AA, shift=4)
    return picture
