"""One way in: a picture and settings become a traced contour in pixels, whatever the method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from contour.geometry import Contour

Method = Literal["wall-tips", "sliding-matrix", "direct-scan", "find-contours"]
Polarity = Literal["bright", "dark"]
OnStage = Callable[[str], None]


class Rectifier(Protocol):
    """Maps raw pixels to a plane without lens distortion, in units of about a pixel, and back.

    Both verbs take and return shape (N, 2), float64.
    """

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]: ...

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class TraceSettings:
    """What to trace with. Sizes left at None follow from the picture's own cell pitch."""

    method: Method = "sliding-matrix"
    polarity: Literal["auto", "bright", "dark"] = "auto"
    binarize: Literal["flat", "otsu"] | int = "flat"
    edge: Literal["cut", "cells"] = "cut"
    core_px: int | None = None
    step_px: int | None = None
    threshold: float | None = None
    max_gap_px: int | None = None
    min_width_px: int | None = None


@dataclass(frozen=True)
class Trace:
    """A traced contour in pixels: exterior counter-clockwise as seen in the work frame (negative shoelace in pixels)."""

    method: Method
    polarity: Polarity
    pitch_px: float | None
    contour: Contour
    uncertainty_px: float | None = None


def trace(
    picture: NDArray[np.uint8],
    settings: TraceSettings,
    *,
    rectifier: Rectifier | None = None,
    on_stage: OnStage = lambda _name: None,
) -> Trace:
    """The block's contour in `picture` (shape (H, W) grey or (H, W, 3) BGR, uint8), in pixels.

    `on_stage` is called with "mask" and "trace" when each of these stages has ended. `rectifier`, where the lens is
    known, lets a method fit straight edges in undistorted coordinates; methods on pixel centres ignore it.
    Raises PictureError, ParameterError, NoBlockFound.
    """
    raise NotImplementedError
