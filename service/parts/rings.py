"""Strokes joined to closed rings, and rings to one outline with its holes: nothing is closed or left out by guess."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring, contour_defect, oriented_contour, ring_defect, signed_area
from contour.geometry.segments import contains
from service.parts.part import JOIN_MM, MOST_VERTICES, PartFileError, Stroke

_LEAST_AREA_MM2 = 0.01
_SAME_POINT_MM = 1e-6

End = tuple[int, int]
"""A stroke's number, and 0 for its first point, 1 for its last."""


def outline_of(strokes: Sequence[Stroke], factor: float) -> Contour:
    """The contour that the strokes draw, millimetres (`factor` to their unit); raise PartFileError without the file.

    Ends that lie within `JOIN_MM` of one another are joined. One ring holds all others, and none of these another.
    """
    scaled = [Stroke(stroke.points * factor, stroke.closed, stroke.name) for stroke in strokes]
    _bounded(scaled)
    closed = [stroke for stroke in scaled if stroke.closed]
    rings = [(_cleaned(stroke.points), stroke.name) for stroke in closed]
    rings += [(_cleaned(points), name) for points, name in _joined([one for one in scaled if not one.closed])]
    if not rings:
        raise PartFileError("holds no outline. Draw the part as closed lines and arcs")
    for ring, name in rings:
        defect = ring_defect(ring)
        if defect:
            raise PartFileError(f"{name} {defect}, in mm of the drawing. Correct the outline")
        if abs(signed_area(ring)) < _LEAST_AREA_MM2:
            raise PartFileError(
                f"{name} encloses {abs(signed_area(ring)):.2g} mm² {_at(ring[0])}, expected {_LEAST_AREA_MM2:g} or "
                "more. Take it out, or check the units"
            )
    return _nested(rings)


def _bounded(strokes: Iterable[Stroke]) -> None:
    count = 0
    for stroke in strokes:
        count += len(stroke.points)
        if not np.isfinite(stroke.points).all():
            raise PartFileError(f"{stroke.name} has a point that is no number. Correct it")
        if np.abs(stroke.points).max() > 1e6:
            raise PartFileError(
                f"{stroke.name} reaches {np.abs(stroke.points).max():.3g} mm from the drawing's origin, expected 1 km "
                "at most. Check the units"
            )
    if count > MOST_VERTICES:
        raise PartFileError(f"has {count} points, expected {MOST_VERTICES} at most. Draw curves as arcs or splines")


def _cleaned(points: Float64s) -> Ring:
    """Without points that the next one repeats."""
    steps = np.hypot(*(points - np.roll(points, -1, axis=0)).T)
    return np.asarray(points[steps > _SAME_POINT_MM])


def _joined(strokes: list[Stroke]) -> list[tuple[Float64s, str]]:
    """Rings of open strokes, end to end, each with the name of its first stroke."""
    mates = _mates(strokes)
    left = dict.fromkeys(range(len(strokes)))
    rings = []
    while left:
        first = next(iter(left))
        way, end = [], (first, 0)
        while end[0] in left:
            number, side = end
            del left[number]
            points = strokes[number].points
            way.append(points[:-1] if side == 0 else points[:0:-1])
            end = mates[(number, 1 - side)]
        rings.append((np.concatenate(way), f"the outline from {strokes[first].name} on"))
    return rings


def _mates(strokes: list[Stroke]) -> dict[End, End]:
    """The end that each end is joined to; raise PartFileError where there is none, or more than one."""
    ends: list[End] = [(number, side) for number in range(len(strokes)) for side in (0, 1)]
    places = np.array([strokes[number].points[-side] for number, side in ends]).reshape(-1, 2)
    cells: dict[tuple[int, int], list[int]] = defaultdict(list)
    keys = [(int(x), int(y)) for x, y in np.floor(places / JOIN_MM).astype(np.int64).tolist()]
    for index, key in enumerate(keys):
        cells[key].append(index)
    mates: dict[End, End] = {}
    for index, (x, y) in enumerate(keys):
        beside = [other for dx in (-1, 0, 1) for dy in (-1, 0, 1) for other in cells.get((x + dx, y + dy), ())]
        near = [k for k in beside if k != index and np.hypot(*(places[k] - places[index])) <= JOIN_MM]
        if len(near) != 1:
            raise PartFileError(_not_one(strokes, ends, places, index, len(near)))
        mates[ends[index]] = ends[near[0]]
    return mates


def _not_one(strokes: list[Stroke], ends: list[End], places: Float64s, index: int, count: int) -> str:
    """Why an end has no mate, in words."""
    name, place = strokes[ends[index][0]].name, _at(places[index])
    if count > 1:
        return f"{name} meets {count} other ends {place}, expected one: is a line drawn twice, or does one branch off?"
    gaps = np.hypot(*(places - places[index]).T)
    gaps[index] = np.inf
    nearest = f"; the nearest other end is {gaps.min():.3g} mm away" if len(gaps) > 1 else ""
    return f"is open: {name} ends {place}{nearest}, expected {JOIN_MM:g} mm at most. Close the outline"


def _nested(rings: list[tuple[Ring, str]]) -> Contour:
    """The largest ring with the others as its holes; raise PartFileError where they are no one part."""
    rings = sorted(rings, key=lambda one: -abs(signed_area(one[0])))
    (exterior, outer), *rest = rings
    contour = oriented_contour(Contour(exterior, tuple(ring for ring, _ in rest)), counter_clockwise=True)
    defect = contour_defect(contour)
    if defect is None:
        return contour
    if " meet " not in defect:
        for ring, name in rest:
            if not contains(exterior, ring[:1])[0]:
                raise PartFileError(
                    f"holds more than one part: {name} {_at(ring[0])} lies outside of {outer}. Keep one, or name its "
                    "layer"
                )
    raise PartFileError(f"{defect}, in mm of the drawing (holes by size). Correct the outline")


def _at(place: Float64s) -> str:
    x, y = place.tolist()
    return f"at ({x:.3f}, {y:.3f}) mm"
