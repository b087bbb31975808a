"""Raw pixels to a plane without lens distortion and back: what fitting needs to know of a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from contour.geometry.arrays import Float64s


class Rectifier(Protocol):
    """Maps raw pixels to a plane without lens distortion, in units of about a pixel, and back.

    Both verbs take and return shape (N, 2), float64.
    """

    def rectify(self, points_px: Float64s) -> Float64s: ...

    def unrectify(self, points: Float64s) -> Float64s: ...


def rectified(points_px: Float64s, rectifier: Rectifier | None) -> Float64s:
    """Points, (N, 2), in the rectified plane; as they are without a rectifier."""
    return points_px if rectifier is None else rectifier.rectify(points_px)


@dataclass(frozen=True, eq=False)
class CroppedRectifier:
    """A rectifier for the pixels of a part of the picture, whose first one is `first` (x, y) of the whole."""

    whole: Rectifier
    first: Float64s

    def rectify(self, points_px: Float64s) -> Float64s:
        return self.whole.rectify(points_px + self.first)

    def unrectify(self, points: Float64s) -> Float64s:
        return self.whole.unrectify(points) - self.first


@dataclass(frozen=True, eq=False)
class EnlargedRectifier:
    """A rectifier for the pixels of a picture that is shown so many `times` as large."""

    whole: Rectifier
    times: int

    def rectify(self, points_px: Float64s) -> Float64s:
        return self.whole.rectify((points_px + 0.5) / self.times - 0.5) * self.times

    def unrectify(self, points: Float64s) -> Float64s:
        return (self.whole.unrectify(points / self.times) + 0.5) * self.times - 0.5
