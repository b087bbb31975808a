"""Photographs with outlines drawn by hand: a folder of NAME.png beside NAME.json, which is not part of the project.

The JSON holds `outer` and `holes`, rings of [x, y] in pixels. `EDGE` says with which edge each known one is traced.
"""

from __future__ import annotations

import json
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
from tests.support.scenes.metrics import Agreement, agreement
from tests.support.scenes.rivals import RIVALS, Hints, RivalFailed
from tests.support.scenes.trials import OWN_METHODS, Stopwatch

ROOT = Path(__file__).resolve().parents[3]
EDGE: dict[str, Literal["cut", "cells"]] = {
    "lattice_rpu": "cells",
    "protoboard_10x5": "cells",
    "alfoam_closed": "cut",
}


@dataclass(frozen=True)
class Photograph:
    """A picture, its outline drawn by hand (about 1 % sure), and the edge it is traced with."""

    name: str
    picture: NDArray[np.uint8]
    outline: Contour
    dark: bool
    edge: Literal["cut", "cells"]


@dataclass(frozen=True)
class PhotographTrial:
    """What a method made of a photograph."""

    photograph: str
    method: str
    edge: str
    agreement: Agreement | None
    total_ms: float
    failure: str = ""
    contour: Contour | None = None


def photographs() -> tuple[list[Photograph], Path]:
    """All photographs in the folder that COMBTRACE_PHOTOS names (default ../shared/real), and that folder."""
    folder = Path(os.environ.get("COMBTRACE_PHOTOS", ROOT.parent / "shared" / "real"))
    found = []
    for description in sorted(folder.glob("*.json")) if folder.is_dir() else []:
        data = json.loads(description.read_text(encoding="utf-8"))
        picture = cv2.imread(str(folder / data["image"]), cv2.IMREAD_COLOR)
        if picture is None:
            continue
        outer, *holes = (np.array(ring, dtype=np.float64) for ring in (data["outer"], *data["holes"]))
        found.append(
            Photograph(
                description.stem,
                np.asarray(picture, dtype=np.uint8),
                Contour(outer, tuple(holes)),
                data["polarity"] == "dark-on-bright",
                EDGE.get(description.stem, "cut"),
            )
        )
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
        spent = watch.milliseconds["trace"]
        return PhotographTrial(photograph.name, method, photograph.edge, None, spent, str(error))
    watch.lap("trace")
    return PhotographTrial(
        photograph.name,
        method,
        photograph.edge,
        agreement(contour, photograph.outline),
        watch.milliseconds["trace"],
        contour=contour,
    )


def cell_pitch_px(photograph: Photograph) -> float:
    """The pitch that a user would read off the picture, for the ready-made ways: what our mask measures, else 20 px."""
    try:
        found = trace(photograph.picture, TraceSettings(method="find-contours"))
    except ContourError:
        return 20.0
    return found.pitch_px or 20.0
