"""Photographs with outlines drawn by hand: a folder of NAME.png beside NAME.json, which is not part of the project.

The JSON is as `combtrace judge` reads it, with `polarity` besides, by which the ready-made ways go.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.errors import ContourError
from contour.geometry.rings import Contour
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from service.judging.truth_file import parsed_truth, read_object
from tests.support.scenes.metrics import Agreement, agreement
from tests.support.scenes.rivals import RIVALS, Hints, RivalFailed
from tests.support.scenes.trials import OWN_METHODS, Stopwatch

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Photograph:
    """A picture, its outline drawn by hand, and the edge it is traced with. sure: to about 1 % of the size."""

    name: str
    picture: NDArray[np.uint8]
    outline: Contour
    dark: bool
    edge: Literal["cut", "cells"]
    sure: bool


@dataclass(frozen=True)
class PhotographTrial:
    """What a method made of a photograph."""

    photograph: Photograph
    method: str
    agreement: Agreement | None
    total_ms: float
    failure: str = ""


def photographs() -> tuple[list[Photograph], Path]:
    """All photographs in the folder that COMBTRACE_PHOTOS names (default ../shared/real), and that folder."""
    folder = Path(os.environ.get("COMBTRACE_PHOTOS", ROOT.parent / "shared" / "real"))
    found = []
    for description in sorted(folder.glob("*.json")) if folder.is_dir() else []:
        picture = cv2.imread(str(description.with_suffix(".png")), cv2.IMREAD_COLOR)
        if picture is None:
            continue
        data = read_object(description)
        truth = parsed_truth(data, description)
        dark = data["polarity"] == "dark-on-bright"
        edge: Literal["cut", "cells"] = "cells" if truth.edge == "cells" else "cut"
        pixels, sure = np.asarray(picture, np.uint8), data.get("tier") == "A"
        found.append(Photograph(description.stem, pixels, truth.outline, dark, edge, sure))
    return found, folder


def run_photograph(photograph: Photograph, method: str, pitch_px: float) -> PhotographTrial:
    """One method on a photograph; own methods find polarity and pitch themselves, ready-made ways are given both."""
    watch = Stopwatch()
    watch.restart()
    try:
        if method in RIVALS:
            contour = RIVALS[method](photograph.picture, Hints(pitch_px, photograph.dark))
        else:
            own = next(name for name in OWN_METHODS if name == method)
            contour = trace(photograph.picture, TraceSettings(method=own, edge=photograph.edge)).contour
    except (ContourError, RivalFailed) as error:
        watch.lap("trace")
        return PhotographTrial(photograph, method, None, watch.milliseconds["trace"], str(error))
    watch.lap("trace")
    found = agreement(contour, photograph.outline)
    return PhotographTrial(photograph, method, found, watch.milliseconds["trace"])


def cell_pitch_px(photograph: Photograph) -> float:
    """The pitch that a user would read off the picture, for the ready-made ways: what our mask measures, else 20 px."""
    try:
        found = trace(photograph.picture, TraceSettings(method="find-contours"))
    except ContourError:
        return 20.0
    return found.pitch_px or 20.0
