"""Several parts in one block: as many as fit, those of the first priority first, the larger before the smaller.

One after the other each is laid as far towards a side of the block as it goes, in the best of its turns, on a grid that
says how much room every place has; then it is moved on exactly until it touches, and only what keeps its distances
exactly is laid. From several sides, the layout that holds most is taken (bottom-left filling, Baker, Coffman and Rivest
1980, on a grid as by Burke et al. 2006).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s
from contour.geometry.rings import Contour, area, bounding_box, densified, simplify_indices
from contour.placement.clearance import Outline, contacts, crosses
from contour.placement.field import DepthField
from contour.placement.place import Placement, check_can_be_laid
from contour.placement.pose import Pose, Turns

_NODES = 320
_MOST_SAMPLES = 320
_ANGLE_STEP = math.radians(15.0)
_TRIED_A_SIDE = 6
_ROUGH_MM = 0.05
_SLIDES = (2.0, 1.0, 0.5, 0.25, 0.12, 0.06)
"""Of a node's distance: how far a part is moved on towards its side, and across, while it keeps its distances."""

_PAD_SHARE = 0.01
"""Of the block's size, so that depths are known up to its edge."""

MOST_TRIES = 8
_FIRST_SIDE = 0.3
"""Radians: along no axis, so that of two places equally far one is preferred."""

_FAR = 1e6


@dataclass(frozen=True)
class Wanted:
    """A part that is to be cut `quantity` times. needed: its least distance to the block's edge, as the contours' unit.

    priority: 1 before 2 before 3. turns: those that it may take.
    """

    part: Contour
    quantity: int
    needed: float
    priority: int
    turns: Turns


@dataclass(frozen=True)
class Laid:
    """Where one of the wanted parts lies, by its index, and how far it keeps from the block's edge."""

    index: int
    placement: Placement


def lay_several(wanted: Sequence[Wanted], block: Contour, apart: float, tries: int = 2) -> tuple[Laid, ...]:
    """The best layout found: every part keeps `needed` from the block's edge and `apart` from every other part.

    Contours and distances in one unit, holes of the block no room for anything. tries: towards how many sides parts are
    moved, up to `MOST_TRIES`; the result depends on nothing else. Raises ParameterError where a shape is no contour
    that could be cut.
    """
    for name, shape in (("block", block), *((f"part {k}", one.part) for k, one in enumerate(wanted, start=1))):
        check_can_be_laid(name, shape)
    best: tuple[tuple[float, ...], tuple[Laid, ...]] = ((), ())
    for side in range(tries):
        laid = _Layout.on(block, apart, _FIRST_SIDE + side * 2 * math.pi / MOST_TRIES).filled(wanted)
        worth = _worth(wanted, laid)
        if worth > best[0]:
            best = worth, laid
        if len(laid) == sum(one.quantity for one in wanted):
            break
    return best[1]


def _worth(wanted: Sequence[Wanted], laid: Iterable[Laid]) -> tuple[float, ...]:
    """The area laid of each priority, the first first."""
    levels = sorted({one.priority for one in wanted})
    found = [wanted[one.index] for one in laid]
    return tuple(sum(area(one.part) for one in found if one.priority == level) for level in levels)


@dataclass
class _Layout:
    """A block that is being filled. room: how far each node is from the block's edge; taken: from the parts laid."""

    block: Contour
    apart: float
    towards: Float64s
    room: DepthField
    taken: Float32s
    rough: Outline
    laid: list[tuple[Laid, Contour]] = field(default_factory=list)

    @classmethod
    def on(cls, block: Contour, apart: float, side: float) -> _Layout:
        """Nothing laid; side: the direction towards which parts are moved, radians."""
        box = bounding_box(block.exterior)
        room = DepthField.of(block, _PAD_SHARE * max(box.width, box.height), _NODES)
        taken = np.full(room.depth.shape, _FAR, np.float32)
        towards = np.array([math.cos(side), math.sin(side)])
        return cls(block, apart, towards, room, taken, Outline.of(_simpler(block)))

    def filled(self, wanted: Sequence[Wanted]) -> tuple[Laid, ...]:
        """All that can be laid, in order."""
        order = sorted(range(len(wanted)), key=lambda k: (wanted[k].priority, -area(wanted[k].part)))
        for index in order:
            for _ in range(wanted[index].quantity):
                if not self._lay(index, wanted[index]):
                    break
        return tuple(one for one, _ in self.laid)

    def _lay(self, index: int, one: Wanted) -> bool:
        """Lay one more of these; False where there is no room for it."""
        slack = np.minimum(self.room.depth - np.float32(one.needed), self.taken - np.float32(self.apart))
        free = (slack > 0).astype(np.uint8)
        rough = _simpler(one.part)
        for pose in self._candidates(free, one):
            if not self._has_room(rough, pose, one.needed):
                continue
            placement = self._exactly(one, self._moved_on(rough, pose, one.needed))
            if placement is not None:
                placed = placement.pose.placed(one.part)
                self.laid.append((Laid(index, placement), placed))
                self.taken = np.minimum(self.taken, _distance_from(placed, self.room))
                return True
        return False

    def _candidates(self, free: Bytes, one: Wanted) -> list[Pose]:
        """Poses on the grid that seem to have room, those farthest towards the side first."""
        samples = _samples(one.part, self.room.spacing_mm)
        found: list[tuple[float, Pose]] = []
        for angle in _angles(one.turns, one.part, self.block):
            turned = Pose(0.0, 0.0, angle).moved(samples)
            low = turned.min(axis=0)
            shifts, ahead = self._free(free, turned - low, low)
            found += [(far, Pose(x, y, angle)) for far, (x, y) in zip(ahead, shifts.tolist(), strict=True)]
        return [pose for _, pose in sorted(found, key=lambda one: -one[0])[: 2 * _TRIED_A_SIDE]]

    def _free(self, free: Bytes, turned: Float64s, low: Float64s) -> tuple[Float64s, list[float]]:
        """Shifts at which no sample lies where there is no room, and how far towards the side each brings the part."""
        step = self.room.spacing_mm
        nodes = np.unique(np.round(turned / step).astype(np.intp), axis=0)
        width, height = (nodes.max(axis=0) + 1).tolist()
        rows, columns = free.shape[0] - height + 1, free.shape[1] - width + 1
        if rows < 1 or columns < 1:
            return np.empty((0, 2)), []
        element = np.zeros((height, width), np.uint8)
        element[nodes[:, 1], nodes[:, 0]] = 1
        eroded = cv2.erode(free, element, anchor=(0, 0), borderType=cv2.BORDER_CONSTANT, borderValue=(0, 0, 0, 0))
        y, x = np.nonzero(eroded[:rows, :columns] > 0)
        if not len(x):
            return np.empty((0, 2)), []
        shifts = np.column_stack([x, y]) * step + self.room.origin - low
        # The part's middle counts, so that a turn that makes it lie flatter counts as farther.
        ahead = (shifts + low + (turned.max(axis=0) + turned.min(axis=0)) / 2) @ self.towards
        ahead -= np.abs(self.towards) @ (turned.max(axis=0) - turned.min(axis=0)) / 2
        count = min(_TRIED_A_SIDE, len(ahead))
        best = np.argpartition(-ahead, count - 1)[:count]
        return shifts[best], ahead[best].tolist()

    def _moved_on(self, rough: Contour, pose: Pose, needed: float) -> Pose:
        """The pose moved towards the side, and across, as far as it keeps its distances."""
        across = np.array([-self.towards[1], self.towards[0]])
        for share in _SLIDES:
            for way in (self.towards, across):
                x, y = (way * share * self.room.spacing_mm).tolist()
                moved = Pose(pose.x + x, pose.y + y, pose.angle)
                if self._has_room(rough, moved, needed):
                    pose = moved
        return pose

    def _has_room(self, rough: Contour, pose: Pose, needed: float) -> bool:
        """True where the part, drawn with few vertices, keeps its distances and what that may hide."""
        placed = pose.placed(rough)
        outline = Outline.of(placed)
        if contacts(outline, self.rough, 0.0).least < needed + _ROUGH_MM:
            return False
        return all(_keeps_apart(outline, other, self.apart + _ROUGH_MM) for other in self._beside(placed))

    def _exactly(self, one: Wanted, pose: Pose) -> Placement | None:
        """The placement there; None where the part as drawn keeps too little of its distances, or edges cross."""
        placed = pose.placed(one.part)
        outline = Outline.of(placed)
        near = contacts(outline, Outline.of(self.block), 0.0)
        if near.least < one.needed or crosses(placed, self.block):
            return None
        for other in self._beside(placed):
            if not _keeps_apart(outline, other, self.apart) or crosses(placed, other):
                return None
        nearest = near.take(np.argmin(near.distance, keepdims=True))
        (x, y), (u, v) = nearest.of_part[0].tolist(), nearest.of_block[0].tolist()
        return Placement(pose, nearest.least, ((x, y), (u, v)))

    def _beside(self, placed: Contour) -> list[Contour]:
        """The parts laid that are not too far off to matter."""
        box, reach = bounding_box(placed.exterior), self.apart + _ROUGH_MM
        found = []
        for _, other in self.laid:
            beside = bounding_box(other.exterior)
            gaps = (
                beside.min_x - box.max_x,
                box.min_x - beside.max_x,
                beside.min_y - box.max_y,
                box.min_y - beside.max_y,
            )
            if max(gaps) <= reach:
                found.append(other)
        return found


def _keeps_apart(outline: Outline, other: Contour, apart: float) -> bool:
    """True where no vertex of one of two parts is nearer to the other's material than that."""
    everywhere = np.array([[-_FAR, -_FAR], [_FAR, -_FAR], [_FAR, _FAR], [-_FAR, _FAR]])
    rings = (everywhere, *(ring for ring in other.rings))
    around = Outline(np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings]))
    return contacts(outline, around, 0.0).least >= apart


def _distance_from(part: Contour, room: DepthField) -> Float32s:
    """How far each node is from the part's material; 0 within it."""
    mask = np.ones(room.depth.shape, np.uint8)
    rings = [
        np.round((ring - room.origin) / room.spacing_mm * 256).astype(np.int32).reshape(-1, 1, 2) for ring in part.rings
    ]
    cv2.fillPoly(mask, rings, 0, cv2.LINE_8, 8)
    return np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32) * np.float32(
        room.spacing_mm
    )


def _samples(part: Contour, step: float) -> Float64s:
    """Points of the part that stand for it: along its rings and in its material, (N, 2)."""
    length = sum(float(np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).sum()) for ring in part.rings)
    along = [densified(ring, max(length / _MOST_SAMPLES, step)) for ring in part.rings]
    box = bounding_box(part.exterior)
    pace = max(step, math.sqrt(box.width * box.height / _MOST_SAMPLES))
    x, y = np.meshgrid(np.arange(box.min_x, box.max_x, pace), np.arange(box.min_y, box.max_y, pace))
    grid = np.column_stack([x.ravel(), y.ravel()])
    inner = contacts(Outline(grid, grid), Outline.of(part), np.inf, np.arange(len(grid)))
    return np.concatenate([*along, grid[np.unique(inner.vertex[inner.distance > 0])]])


def _simpler(shape: Contour) -> Contour:
    return Contour.of(ring[simplify_indices(ring, _ROUGH_MM / 2)] for ring in shape.rings)


def _angles(turns: Turns, part: Contour, block: Contour) -> list[float]:
    """Turns to try: all single ones; of an interval its ends, every 15 degrees, and what lays long edges parallel."""
    own, others = _directions(part)[:2], _directions(block)[:4]
    parallel = [(other - mine) % math.pi + half for mine in own for other in others for half in (0.0, math.pi)]
    every = np.arange(0.0, 2 * math.pi, _ANGLE_STEP).tolist()
    angles: set[float] = set()
    for low, high in turns.intervals:
        if low == high:
            angles.add(low)
        elif math.isinf(low):
            angles |= {round(angle % (2 * math.pi), 6) for angle in (*every, *parallel)}
        else:
            shifted = (low + (angle - low) % (2 * math.pi) for angle in (*every, *parallel))
            angles |= {low, high, (low + high) / 2, *(angle for angle in shifted if angle <= high)}
    return sorted(angles)


def _directions(shape: Contour) -> list[float]:
    """Directions of the exterior's edges, the longest first, radians."""
    way = np.roll(shape.exterior, -1, axis=0) - shape.exterior
    longest = np.argsort(-np.hypot(*way.T), kind="stable")
    directions: list[float] = np.arctan2(way[longest, 1], way[longest, 0]).tolist()
    return directions
