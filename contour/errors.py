"""Errors of the numeric core.

ContourError
├── PictureError        the array is no usable picture (shape, dtype, empty)
├── ParameterError      a method's or renderer's parameter is out of its range
├── NoBlockFound        the picture was usable, but no block could be traced in it
│   └── NoCellsFound    no part of it has cells of one size
├── EdgeContradicted    the block's border is not of the kind that was promised
├── BoardNotSeen        the picture shows no calibration board that could be used
├── GaugeNotSeen        the picture shows no gauge, or not all of it
├── MarginImpossible    a contour that a margin tears, closes up or lets vanish
├── CalibrationFailed   views or points from which no calibration can be had
└── CalibrationError    a calibration that contradicts itself, or does not fit the picture
"""

from typing import Literal


class ContourError(Exception):
    """Base of all errors of the numeric core."""


class PictureError(ContourError):
    """The array is no usable picture: what was seen, what is expected."""


class ParameterError(ContourError):
    """A parameter is out of its range: its name, what was seen, the range."""


class NoBlockFound(ContourError):
    """The picture is usable, but no block could be traced in it; the message says what was found instead, and `edge`
    what kind of border it has where that was told.
    """

    edge: Literal["cut"] | None = None


class NoCellsFound(NoBlockFound):
    """No part of the picture has cells of one size, however it is looked at."""


class EdgeContradicted(ContourError):
    """The block's border is not of the kind that was promised: what was promised, and what was seen (`edge`)."""

    def __init__(self, message: str, edge: Literal["cut", "cells", "mixed"]) -> None:
        super().__init__(message)
        self.edge = edge


class CalibrationError(ContourError):
    """The calibration contradicts itself, or does not fit the picture."""


class BoardNotSeen(ContourError):
    """The picture shows no calibration board that could be used; the message says what was seen instead."""


class GaugeNotSeen(ContourError):
    """The picture does not show the whole gauge; the message says what was seen instead."""


class CalibrationFailed(ContourError):
    """No calibration can be had from these views or points; the message says why, and what to do."""


class MarginImpossible(ContourError):
    """The contour has no counterpart at that margin: a ring would vanish, split or run into another."""
