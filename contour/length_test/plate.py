"""A plate or bar with a board on it: the distances between its corners, and how straight its rows and columns are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration, CameraCalibration
from contour.errors import GaugeNotSeen
from contour.geometry.arrays import Float64s, Int64s
from contour.image.opencv import rotation_matrix
from contour.image.opencv_boards import solve_pose
from contour.length_test.seen_gauge import SeenGauge, SeenLength, SeenLine, straightness_mm

HEIGHT_STEP_MM = 1.0
FEWEST_IN_LINE = 5
"""Four corners of a straight row hardly show how it is bent: two of them hold the line."""


@dataclass(frozen=True)
class CornerPair:
    """A calibrated distance between two inner corners, each column and row from the board's lower left, 1 the first."""

    name: str
    first: tuple[int, int]
    second: tuple[int, int]


@dataclass(frozen=True, eq=False)
class SeenCorners:
    """Inner corners in a picture: numbers (N,), row by row from the top left; pixels (N, 2); where they lie on the
    plate, (N, 2), mm; how many there are each way.
    """

    ids: Int64s
    pixels: Float64s
    plate_mm: Float64s
    columns: int
    rows: int


def seen_plate(seen: SeenCorners, pairs: Sequence[CornerPair], calibration: Calibration, height_mm: float) -> SeenGauge:
    """The plate whose pattern lies at z = `height_mm`; raise GaugeNotSeen where a length's end is hidden, and
    CalibrationError.
    """
    places = _machine(calibration, seen.pixels, height_mm)
    higher = _machine(calibration, seen.pixels, height_mm + HEIGHT_STEP_MM)
    index = {int(number): at for at, number in enumerate(seen.ids)}
    lengths = []
    for pair in pairs:
        both = (pair.first, pair.second)
        ends = [index[number] for corner in both if (number := _number(seen, corner)) in index]
        if len(ends) < 2:
            hidden = next(corner for corner in both if _number(seen, corner) not in index)
            raise GaugeNotSeen(
                f"the gauge is not whole: corner {list(hidden)}, an end of length {pair.name}, is not seen. Clear it, "
                "or move the gauge into view"
            )
        measured = float(np.linalg.norm(np.subtract(*places[ends])))
        grown = float(np.linalg.norm(np.subtract(*higher[ends]))) - measured
        lengths.append(SeenLength(pair.name, measured, places[ends], grown / HEIGHT_STEP_MM))
    lines = _lines(seen, places)
    if not lines:
        raise GaugeNotSeen(f"the gauge is not whole: no row or column of {FEWEST_IN_LINE} corners is seen. Clear it")
    heights = _heights(seen, calibration) if isinstance(calibration, CameraCalibration) else None
    return SeenGauge(tuple(lengths), lines, _around(places), _turn_deg(seen, places), heights)


def _heights(seen: SeenCorners, camera: CameraCalibration) -> Float64s:
    """z of the corners of the box around the seen part of the plate, work frame, (4,): by the pose of the plate.

    A wrong size of the plate raises or lowers all of them alike, in every picture.
    """
    flat = np.column_stack([seen.plate_mm, np.zeros(len(seen.plate_mm))])
    rotation, shift = solve_pose(flat, seen.pixels, camera.camera_matrix, camera.distortion_coefficients)
    (left, low), (right, high) = seen.plate_mm.min(axis=0), seen.plate_mm.max(axis=0)
    box = np.array([[left, low, 0.0], [right, low, 0.0], [right, high, 0.0], [left, high, 0.0]])
    before_camera = box @ rotation_matrix(rotation).T + shift
    return np.asarray(((before_camera - camera.translation_mm) @ rotation_matrix(camera.rotation_vector))[:, 2])


def _machine(calibration: Calibration, pixels: Float64s, height_mm: float) -> Float64s:
    return calibration.to_machine(calibration.to_work(pixels, height_mm))


def _number(seen: SeenCorners, corner: tuple[int, int]) -> int:
    column, row = corner
    return (seen.rows - row) * seen.columns + column - 1


def _turn_deg(seen: SeenCorners, places: Float64s) -> float:
    """How the rows run, degrees against the x axis: least squares over all corners that are seen."""
    down, across = np.divmod(seen.ids, seen.columns)
    steps, *_ = np.linalg.lstsq(np.column_stack([across, down, np.ones(len(across))]), places, rcond=None)
    return float(np.degrees(np.arctan2(steps[0, 1], steps[0, 0])))


def _lines(seen: SeenCorners, places: Float64s) -> tuple[SeenLine, ...]:
    lines = []
    down, across = np.divmod(seen.ids, seen.columns)
    for name, which, count in (("row", seen.rows - down, seen.rows), ("column", across + 1, seen.columns)):
        for number in range(1, count + 1):
            points = places[which == number]
            if len(points) >= FEWEST_IN_LINE:
                lines.append(SeenLine(f"{name} {number}", straightness_mm(points)))
    return tuple(lines)


def _around(places: Float64s) -> Float64s:
    """The smallest box around the corners, along their main axes, shape (4, 2)."""
    middle = places.mean(axis=0)
    _, _, axes = np.linalg.svd(places - middle, full_matrices=False)
    low, high = (rest := (places - middle) @ axes.T).min(axis=0), rest.max(axis=0)
    box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return np.asarray(box @ axes + middle)
