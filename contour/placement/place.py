"""The pose of a part in a block whose least margin is largest, and where it is tightest.

From each candidate on, the contacts nearest to the least are taken for straight and the least of them is made as large
as a small move allows: a linear program in shift, turn and margin, again and again with moves that shrink where the
promise was not kept (sequential linear programming with a trust region, Fletcher and Sainz de la Maza, 1989).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, contour_defect, signed_area, simplify_indices
from contour.placement.clearance import Contacts, Outline, contacts, crosses
from contour.placement.field import DepthField
from contour.placement.pose import Pose, Turns
from contour.placement.search import Candidate, candidates, pivot_of

_MEASURED = 24
"""Candidates that are measured exactly: more found nothing better on drawn blocks and parts."""

_MOST_MOVES = 40
_GIVEN_UP_MOVES = 12
_ROUGH_SHAPE_MM = 0.05
_ROUGH_MOVE_MM = 0.05
_LEAST_MOVE_MM = 1e-4
_MOST_GROWTH = 4.0
"""Times the first move: larger ones have more contacts than they gain."""

_FINISHED = 3
"""Candidates that are followed from the rough to the least move."""

_FIRST_MOVE_NODES = 2.0
_PART_NODES = 320
_PART_PAD = 0.1
"""Of the part's size: vertices farther off are known to be as far at least."""

_MOST_CONTACTS = 48
_KEPT_SHARE = 0.1
"""Of the gain that a move promised; with less it is not made."""


@dataclass(frozen=True)
class Placement:
    """Where the part lies best: `pose` of its drawing, `margin` the least distance from its outline to the block's.

    Negative where it does not lie inside even without a margin: then by how far it stands out at the worst place, at
    least. tightest: the places of that distance on the part's outline and on the block's, (x, y) each. In the unit of
    the outlines.
    """

    pose: Pose
    margin: float
    tightest: tuple[tuple[float, float], tuple[float, float]]


def best_placement(part: Contour, block: Contour, turns: Turns) -> Placement:
    """The part, as drawn in its own axes, laid into the block's material, mm; a hole of the block may lie in one of
    the part's. Raises ParameterError where one of the two is no contour that could be cut.
    """
    check_can_be_laid("part", part)
    check_can_be_laid("block", block)
    rough_part, rough_block = _simpler(part), _simpler(block)
    found, field = candidates(rough_part, rough_block, turns)
    first_move = _FIRST_MOVE_NODES * field.spacing_mm
    lying = _Lying.of(rough_part, rough_block, field)
    rough: list[tuple[Candidate, Placement]] = []
    for candidate in found[:_MEASURED]:
        known = [placement for _, placement in rough]
        best_so_far = max((placement.margin for placement in known), default=-np.inf)
        # What the field may be off by, and a climb on it may have left, decide whether it can still win.
        if candidate.depth_mm < best_so_far - 2 * first_move:
            break
        rough.append((candidate, lying.improved(candidate, first_move, _ROUGH_MOVE_MM, known)))
    lying = _Lying.of(part, block, field)
    final: list[Placement] = []
    for candidate, placement in _best_apart(rough, part):
        moved = replace(candidate, pose=placement.pose)
        final.append(lying.improved(moved, _ROUGH_MOVE_MM, _LEAST_MOVE_MM, final))
    return max((_checked(part, block, one) for one in final), key=lambda placement: placement.margin)


def placement_at(part: Contour, block: Contour, pose: Pose) -> Placement:
    """The part laid as the pose says: the margin that it has there, and where it is tightest."""
    near = contacts(Outline.of(part).moved(pose), Outline.of(block), 0.0)
    return _checked(part, block, _placement(pose, near))


def _placement(pose: Pose, near: Contacts) -> Placement:
    nearest = near.take(np.argmin(near.distance, keepdims=True))
    (x, y), (u, v) = nearest.of_part[0].tolist(), nearest.of_block[0].tolist()
    return Placement(pose, nearest.least, ((x, y), (u, v)))


def _best_apart(rough: list[tuple[Candidate, Placement]], part: Contour) -> list[tuple[Candidate, Placement]]:
    """The best `_FINISHED` of them, without those that moves have led to where a better one lies."""
    far = np.array([part.exterior.min(axis=0), part.exterior.max(axis=0)])
    kept: list[tuple[Candidate, Placement]] = []
    for one in sorted(rough, key=lambda one: -one[1].margin):
        lies = one[1].pose.moved(far)
        if all(np.abs(other.pose.moved(far) - lies).max() > 2 * _ROUGH_MOVE_MM for _, other in kept):
            kept.append(one)
    return kept[:_FINISHED]


def check_can_be_laid(name: str, shape: Contour) -> None:
    """Raise ParameterError where the shape is no contour that could be cut, or has a ring without area."""
    defect = contour_defect(shape)
    if defect:
        raise ParameterError(f"The {name} cannot be placed: {defect}.")
    if not all(signed_area(ring) for ring in shape.rings):
        raise ParameterError(f"The {name} cannot be placed: a ring has no area.")


def _simpler(shape: Contour) -> Contour:
    """The shape with as few vertices as tell candidates apart."""
    return Contour.of(ring[simplify_indices(ring, _ROUGH_SHAPE_MM)] for ring in shape.rings)


def _checked(part: Contour, block: Contour, placement: Placement) -> Placement:
    """The placement; where edges cross though no vertex lies on the wrong side, it does not lie inside."""
    if placement.margin > 0 and crosses(placement.pose.placed(part), block):
        return replace(placement, margin=-_LEAST_MOVE_MM)
    return placement


@dataclass(frozen=True)
class _Lying:
    """The two outlines, how deep places lie in each, and the point of the drawing about which it is turned."""

    part: Outline
    block: Outline
    in_part: DepthField
    in_block: DepthField
    pivot: Float64s

    @classmethod
    def of(cls, part: Contour, block: Contour, in_block: DepthField) -> _Lying:
        in_part = DepthField.of(part, _PART_PAD * float(np.ptp(part.exterior, axis=0).max()), _PART_NODES)
        return cls(Outline.of(part), Outline.of(block), in_part, in_block, pivot_of(part))

    def improved(
        self, candidate: Candidate, move_mm: float, least_mm: float, known: Sequence[Placement] = ()
    ) -> Placement:
        """From the candidate on, as far as moves lead, the first of them up to `move_mm`, the last `least_mm`.

        It is given up where a dozen more of its moves would not reach a margin that a known one has, and where it has
        come so near to a known one with a larger margin that the next move could lead there.
        """
        corners = np.array([self.part.start.min(axis=0), self.part.start.max(axis=0)])
        beaten_by = max((one.margin for one in known), default=-np.inf)
        others = np.array([one.pose.moved(corners) for one in known]).reshape(-1, 2, 2)
        margins = np.array([one.margin for one in known])
        pose, limits = candidate.pose, candidate.turn_range
        arm = max(float(np.hypot(*(self.part.start - self.pivot).T).max()), 1e-9)
        largest = _MOST_GROWTH * move_mm
        near = self._contacts(pose, 3 * move_mm)
        for _ in range(_MOST_MOVES):
            if move_mm < least_mm or near.least + _GIVEN_UP_MOVES * move_mm < beaten_by:
                break
            apart = np.abs(others - pose.moved(corners)).max(axis=(1, 2))
            if bool(((apart < move_mm) & (margins >= near.least)).any()):
                break
            turns = (limits[0] - pose.angle, limits[1] - pose.angle)
            step = _best_step(near, self._place(pose), arm, move_mm, turns)
            moved = self._stepped(pose, step)
            then = self._contacts(moved, 4.5 * move_mm)
            gain, promised = then.least - near.least, float(step[3]) - near.least
            if gain > _KEPT_SHARE * promised:
                pose, near = moved, then
            move_mm *= 1.5 if gain > 0.75 * promised else 0.7 if gain > _KEPT_SHARE * promised else 0.35
            move_mm = min(move_mm, largest)
        return _placement(pose, near)

    def _contacts(self, pose: Pose, reach: float) -> Contacts:
        """Those no farther than the nearest and `reach` more; the fields say which vertices cannot be among them."""
        part, back = self.part.moved(pose), pose.undone(self.block.start)
        low, high = self.in_block.bounds(part.start)
        back_low, back_high = self.in_part.bounds(back)
        nearest, farthest = np.concatenate([low, -back_high]), np.concatenate([high, -back_low])
        return contacts(part, self.block, reach, np.flatnonzero(nearest <= farthest.min() + reach))

    def _place(self, pose: Pose) -> Float64s:
        return np.asarray(pose.moved(self.pivot[None])[0])

    def _stepped(self, pose: Pose, step: Float64s) -> Pose:
        """The pose after a step (shift x, y, and turn about the pivot)."""
        turned = Pose(0.0, 0.0, pose.angle + float(step[2]))
        x, y = (self._place(pose) + step[:2] - self._place(turned)).tolist()
        return Pose(x, y, turned.angle)


def _best_step(near: Contacts, place: Float64s, arm: float, move_mm: float, turns: tuple[float, float]) -> Float64s:
    """The shift x, y (mm) and turn (radians) that make the least contact largest, and what it is then, (4,).

    Contacts count as straight. No shift is larger than `move_mm`, no turn moves a point `arm` away by more.
    """
    used = near.take(near.distance <= near.least + 3 * move_mm)
    if len(used.distance) > _MOST_CONTACTS:
        used = used.take(np.argsort(used.distance, kind="stable")[:_MOST_CONTACTS])
    off = used.of_part - place
    turning = (off[:, 0] * used.away[:, 1] - off[:, 1] * used.away[:, 0]) / arm
    gains = np.column_stack([used.away, turning])
    lowest = np.array([-move_mm, -move_mm, max(-move_mm, arm * turns[0])])
    highest = np.array([move_mm, move_mm, min(move_mm, arm * turns[1])])
    # The solver knows no negative unknowns: moves count from the lowest, the margin from one that no move can reach.
    floor = near.least - 4 * move_mm
    rows = np.vstack(
        [
            np.column_stack([-gains, np.ones(len(gains)), used.distance + gains @ lowest - floor]),
            np.column_stack([np.eye(3), np.zeros(3), np.maximum(highest - lowest, 0.0)]),
        ]
    )
    status, solved = cv2.solveLP(np.array([[0.0, 0.0, 0.0, 1.0]]), rows)
    if status < 0:
        return np.array([0.0, 0.0, 0.0, near.least])
    move = np.asarray(solved, np.float64).ravel()
    x, y, turn = (np.clip(move[:3] + lowest, lowest, highest)).tolist()
    return np.array([x, y, turn / arm, move[3] + floor])
