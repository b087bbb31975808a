"""Where filled cells end: potting compound, adhesive and crushed cells, cut with the walls around them.

What lies over the edge sticks out of it. What was cut with the block ends on the line of the edges on its two sides, or
inside of both where these meet in a corner.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from contour.edge.flanks import out_of_flanks
from contour.edge.ring_places import runs_of
from contour.edge.table_look import TableLook
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, oriented
from contour.geometry.signed_distance import depth_inside
from contour.image.pixel_grid import fill, pixels_of, samples_of
from contour.image.pixel_sampling import planes_of, sample_at
from contour.walls.coarse_block import CLOSING_PITCHES
from contour.walls.wall_evidence import EdgePoints, RingEvidence

# How near to its border on the map the material's edge lies, and how far beyond the table may begin: in between is the
# block's shadow.
_EDGE_PITCHES = 0.5
_TABLE_PITCHES = (0.5, 0.75, 1.0, 1.25)
# Ends of walls that belong to a thing lie this near to it.
_TOUCHES_PITCHES = 1.0
# What sticks out of the edge by more than this was not cut with it, nor was what ends so far inside of its two sides'
# lines, as on a curve. So much of a border must be cut.
_FLUSH_PITCHES, _SUNK_PITCHES = 0.18, 0.5
_CUT_SHARE = 0.8
# What is darker than the table, as walls that fade are, must end on the line.
_DARK_FLUSH_PITCHES = 0.1
# So much lies on an outline that was laid through it, and so little off but in open cells, so deep.
_ON_SHARE, _MOST_OFF, _OPEN_PITCHES = 0.45, 0.1, 0.75
# Outlines laid through what lies along more of an edge than that tell nothing, nor through one thing along so much: one
# that goes around a hand goes on smoothly, too. Of 24 outlines with filled cells in them none is so along 0.16.
_MOST, _LONGEST = 0.5, 0.33
# Near its ends the outline through it turns by no more than that over a pitch: blocks are ten cells across and more.
_FOOT_PITCHES, _SMOOTH, _BESIDE_PITCHES, _CORNER = 1.0, np.radians(15.0), 3.0, np.radians(45.0)
_STEP_PX = 0.5
_LEAST_CONTRAST = 6.0
# Pixels and pitches about a sharp step, and how much of it there is to be there.
_NEAR_PX, _NEAR_PITCHES, _SHARP = 2.0, 0.08, 0.6

Refit = Callable[[list[EdgePoints]], Ring]


def cut_borders(
    picture: Bytes,
    clear: RingEvidence,
    fitted: Ring,
    distrusted: Float64s,
    look: TableLook,
    refit: Refit | None = None,
) -> list[EdgePoints]:
    """The ends of what fills cells up to the edge, run by run, in a picture, grey (H, W) or BGR (H, W, 3), uint8.

    `clear`: the ring's witnesses that lie at nothing foreign; `fitted`: the outline through them, pixels. `distrusted`:
    ends of walls at something foreign, (N, 2). `refit` makes the outline through what is seen and more points.
    """
    ring = _with_things(clear, distrusted, look)
    at_thing = look.foreign_at(ring) < _EDGE_PITCHES * look.pitch_px + look.step
    if at_thing.all() or not at_thing.any():
        return []
    border = ring, _normals(ring, max(1, round(0.5 * look.pitch_px / look.step)))
    runs = [_Border.of(picture, clear, border, run, look) for run in runs_of(at_thing)]
    too_long = np.mean(at_thing) > _MOST or max(len(one.told) for one in runs) > _LONGEST * len(ring)
    lines = None if refit is None or too_long else _outline_through(runs, refit)
    cut = [one.cut(clear, fitted, lines, look.pitch_px) for one in runs]
    return [one for one in cut if len(one.points)]


@dataclass(frozen=True, eq=False)
class _Border:
    """A run of the border of a ring and things at it: where it ends, which of these places table follows that differs
    from them, (N,), and which of them are lighter, (N,).
    """

    ends: EdgePoints
    told: Bools
    lit: Bools

    @classmethod
    def of(
        cls,
        picture: Bytes,
        clear: RingEvidence,
        border: tuple[Ring, Float64s],
        run: Indices,
        look: TableLook,
    ) -> _Border:
        """The run of such a border, with outward normals."""
        place, normal = border[0][run], border[1][run]
        pitch_px = look.pitch_px
        off, sure, sharp = _steps(picture, place, normal, pitch_px)
        beyond = np.any([look.table_at(place + reach * pitch_px * normal) for reach in _TABLE_PITCHES], axis=0)
        # What is darker than the table may be a shadow: these are softer than what was cut.
        lit = look.lighter_at(place - _EDGE_PITCHES * pitch_px * normal)
        lengths = RingLengths.of(clear.coarse)
        nearest = [int(((clear.coarse - place[end]) ** 2).sum(axis=1).argmin()) for end in (0, -1)]
        first, last = lengths.starts[nearest].tolist()
        position = (first + np.linspace(0.0, (last - first) % lengths.length, len(run))) % lengths.length
        return cls(EdgePoints(place + off[:, None] * normal, position, normal), sure & beyond & (lit | sharp), lit)

    @property
    def may_be_cut(self) -> bool:
        """Whether table follows most of it."""
        return bool(np.mean(self.told) >= _CUT_SHARE)

    def cut(self, clear: RingEvidence, fitted: Ring, through: RingLengths | None, pitch_px: float) -> EdgePoints:
        """The run where it is cut material; none of it where not.

        It ends on the outline `through` it and what is seen, which goes on smoothly from there; or on the edges on both
        sides, which go on straight, or as the outline does that was fitted to what is seen of them.
        """
        found = EdgePoints()
        if through is not None and self.may_be_cut and _goes_on(through, self.ends.points, pitch_px):
            found = self._on(self._out_of(through.ring, clear), pitch_px)
        if len(found.points):
            return found
        stops = float(self.ends.position[0]), float(self.ends.position[-1])
        straight = out_of_flanks(clear, stops, self.ends.points, pitch_px)
        lines = [self._out_of(fitted, clear), *([] if straight is None else [straight])]
        return max((self._flush(out, pitch_px) for out in lines), key=lambda one: len(one.points))

    def _out_of(self, ring: Ring, clear: RingEvidence) -> Float64s:
        """How far it stands out of a ring, (N,), negative inside, pixels."""
        return (1.0 if clear.is_hole else -1.0) * depth_inside(ring, self.ends.points)

    def _on(self, out: Float64s, pitch_px: float) -> EdgePoints:
        """The run where it lies on an outline that it stands so far out of, (N,), if half of it does, and what does not
        lies inside, no deeper than open cells are; else none of it.
        """
        cut = self.told & (np.abs(out) < _FLUSH_PITCHES * pitch_px)
        off = (out > _FLUSH_PITCHES * pitch_px) | (out < -_OPEN_PITCHES * pitch_px)
        return EdgePoints() if np.mean(off) > _MOST_OFF or np.mean(cut) < _ON_SHARE else self.ends.take(cut)

    def _flush(self, out: Float64s, pitch_px: float) -> EdgePoints:
        """The run where it stands so far out of the edge, (N,), if most of it is flush; else none of it."""
        most = np.where(self.lit, _FLUSH_PITCHES, _DARK_FLUSH_PITCHES) * pitch_px
        least = np.where(self.lit, -_SUNK_PITCHES, -_DARK_FLUSH_PITCHES) * pitch_px
        cut = self.told & (out < most) & (out > least)
        return self.ends.take(cut) if np.mean(cut) >= _CUT_SHARE else EdgePoints()


def _outline_through(runs: Sequence[_Border], refit: Refit) -> RingLengths | None:
    """The outline through those runs that may be cut material, and what is seen; None without any."""
    some = [one.ends for one in runs if one.may_be_cut]
    return RingLengths.of(refit(some)) if some else None


def _goes_on(lengths: RingLengths, points: Float64s, pitch_px: float) -> bool:
    """Whether an outline goes on smoothly from both ends of a run of points: what lies over an edge leaves it at an
    angle. And where it turns a corner on it, whether it is straight beside it: a curved edge has none.
    """
    feet = lengths.feet(points[[0, -1]])
    reach = np.arange(-_FOOT_PITCHES, _FOOT_PITCHES + 0.1, 0.25) * pitch_px
    if np.abs(lengths.turns((feet[:, None] + reach).ravel(), pitch_px)).max() > _SMOOTH:
        return False
    amidst = np.arange(0.0, max((feet[1] - feet[0]) % lengths.length, 1.0), 0.25 * pitch_px)
    beside = feet + np.array([-1.0, 1.0]) * 0.5 * _BESIDE_PITCHES * pitch_px
    straight = np.abs(lengths.turns(beside, _BESIDE_PITCHES * pitch_px)).max() < _SMOOTH
    return bool(straight or np.abs(lengths.turns(feet[0] + amidst, pitch_px)).max() < _CORNER)


def joined(parts: Sequence[EdgePoints]) -> EdgePoints:
    """All the points of some parts."""
    if not parts:
        return EdgePoints()
    return EdgePoints(
        np.concatenate([one.points for one in parts]),
        np.concatenate([one.position for one in parts]),
        np.concatenate([one.normal for one in parts]),
    )


def _with_things(clear: RingEvidence, distrusted: Float64s, look: TableLook) -> Ring:
    """The border of the coarse block together with the things that its walls end at, pixels, positive shoelace."""
    count, parts = cv2.connectedComponents(look.foreign.astype(np.uint8), connectivity=8)
    touching = np.zeros(count, np.bool_)
    grid = np.rint(samples_of(distrusted, look.step)).astype(int)
    reach = round(_TOUCHES_PITCHES * look.pitch_px / look.step)
    for x, y in grid:
        near = parts[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
        touching[near] = True
    touching[0] = False
    union = touching[parts].astype(np.uint8)
    fill(union, clear.coarse, look.step)
    # An open cell beside filled ones is bridged.
    size = 2 * round(CLOSING_PITCHES * look.pitch_px / look.step) + 1
    union = np.asarray(
        cv2.morphologyEx(union, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))), np.uint8
    )
    chains, _ = cv2.findContours(union, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    chain = max(chains, key=len)[:, 0, :].astype(np.float64)
    return pixels_of(oriented(chain, counter_clockwise=True), look.step)


def _normals(ring: Ring, half: int) -> Float64s:
    """Outward unit normals of a ring with positive shoelace, over `half` vertices to each side, shape (N, 2)."""
    along = np.roll(ring, -half, axis=0) - np.roll(ring, half, axis=0)
    along = along / np.maximum(np.hypot(*along.T)[:, None], 1e-9)
    return np.stack([along[:, 1], -along[:, 0]], axis=1)


def _steps(picture: Bytes, place: Float64s, normal: Float64s, pitch_px: float) -> tuple[Float64s, Bools, Bools]:
    """Distance from each place along its normal to the step in the picture there, shape (N,), pixels, whether the two
    sides of it differ, and whether they do so within few pixels.
    """
    reach = _EDGE_PITCHES * pitch_px
    along = np.arange(-reach, reach + _STEP_PX, _STEP_PX)
    x, y = (place[:, axis, None] + along * normal[:, axis, None] for axis in (0, 1))
    profiles = np.stack([sample_at(plane, x, y) for plane in planes_of(picture)])
    count = np.arange(1, len(along))
    total = np.cumsum(profiles, axis=2)
    low = total[:, :, :-1] / count
    high = (total[:, :, -1:] - total[:, :, :-1]) / count[::-1]
    # The split that leaves the least variance has the most between its sides.
    between = (high - low) ** 2 * (count * count[::-1])
    best = between.max(axis=2).argmax(axis=0)
    row = np.arange(len(place))
    split = between[best, row].argmax(axis=1)
    step = high[best, row, split] - low[best, row, split]
    near = max(_NEAR_PX, _NEAR_PITCHES * pitch_px)
    ends = (np.clip(split + side * round(near / _STEP_PX), 0, len(along) - 1) for side in (1, -1))
    far, back = (profiles[best, row, end] for end in ends)
    sharp = (far - back) * np.sign(step) > _SHARP * np.abs(step)
    return along[split] + 0.5 * _STEP_PX, np.abs(step) > _LEAST_CONTRAST, sharp
