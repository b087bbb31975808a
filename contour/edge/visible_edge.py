"""The outline through what is seen of an edge: witnesses at the border of a thing that hides the edge are none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contour.edge.cut_material import cut_borders, joined
from contour.edge.flanks import out_of_flanks
from contour.edge.ring_places import runs_of, turns_deg
from contour.edge.table_look import TableLook, beside
from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, perimeter
from contour.geometry.signed_distance import depth_inside, nearest
from contour.outline.fit import FittedRing, fit_ring
from contour.walls.wall_evidence import BlockEvidence, EdgePoints, RingEvidence, WitnessKind

# Ends of walls beside a thing are the edge's own where they lie on the line of those that are seen well.
_AGREE_PITCHES = 0.22
_FEWEST, _FEW = 8, 3
# A place of the outline is seen where a witness lies within this of it; else a thing within that hides it, or an end of
# a wall at such a thing.
_SUPPORT_PITCHES, _HIDES_PITCHES, _FOOT_PITCHES = 0.8, 0.5, 1.5
_FILL_SIGMA_PX = 0.7
# A wall that ends at a thing so far outside of the outline is left out by it.
_OUT_PITCHES = 0.35
# A shadow along less of the edge than this may be a dark thing over a corner; and a dent that a thing leaves turns in
# by more than this, and out before and after, no farther from there.
_SHADOW_PITCHES, _DENT_DEG, _OUT_DEG = 8.0, 60.0, 30.0
# One beside a straight edge, so wide at these depths, cannot end at both of its corners where beside the next edges it
# had to be so wide; what is narrower is not told.
_WIDTHS, _TOLD_WIDTH, _CORNER_PLACES = np.arange(0.5, 6.0, 0.25), 1.5, 2
_LEAVES_PITCHES = 0.5
# What fills cells there is so wide, so far beyond the ends of walls.
_THING_PITCHES, _THING_ROOM = 1.0, 0.8
# At half a pitch a round outline of five pitches across turns by less.
_CORNER_DEG = 15.0
_LEAST_WITNESSES = 8
# Grain of what fills cells looks like ends of walls; but it goes on beyond them.
_GRAIN_PITCHES = (0.2, 0.4)

Fit = Callable[[RingEvidence], FittedRing]


@dataclass(frozen=True, eq=False)
class VisibleRing:
    """A fitted ring, the witnesses it went through, and the places (N, 2), pixels, where walls ended at something that
    lies over the edge. `filled`: witnesses of the evidence that are ends of filled cells, not of walls, shape (N,).
    `outside`: those of `distrusted` that lie outside of the ring, where the block goes on beyond it, shape (M, 2).
    """

    evidence: RingEvidence
    fitted: FittedRing
    distrusted: Float64s
    filled: Bools
    outside: Float64s

    def hidden(self, points: Float64s, look: TableLook) -> Bools:
        """Which places on the ring (N, 2), pixels, something hides, shape (N,)."""
        unseen = nearest(points, self.on_line) > _SUPPORT_PITCHES * look.pitch_px
        at_thing = look.foreign_at(points) < _HIDES_PITCHES * look.pitch_px
        foot = _FOOT_PITCHES * look.pitch_px
        known_of = unseen & (at_thing | (nearest(points, self.distrusted) < foot))
        return np.asarray(known_of | (nearest(points, self.outside) < foot))

    @property
    def on_line(self) -> Float64s:
        """The witnesses that lie on the ring, shape (N, 2), pixels."""
        return self.evidence.points[self.fitted.inlier]


def visible_rings(
    picture: Bytes, seen: BlockEvidence, look: TableLook, rectifier: Rectifier | None
) -> list[VisibleRing]:
    """The rings of a block, exterior first, fitted to what is seen of their edges. Raises NoBlockFound."""
    return [
        fit_visible(ring, picture, look, rectifier, lambda evidence: _fitted(evidence, seen, rectifier))
        for ring in seen.rings
        if not (ring.is_hole and look.fills(ring))
    ]


def fit_visible(
    evidence: RingEvidence, picture: Bytes, look: TableLook, rectifier: Rectifier | None, fit: Fit
) -> VisibleRing:
    """The ring fitted to those witnesses that do not lie at the border of something that is neither table nor comb, and
    to the ends of filled cells where these continue the edge. Raises NoBlockFound as `fit` does.
    """
    evidence = _without_grain(evidence, look)
    near = _unshaded(doubtful(evidence, look), evidence, picture, look, fit)
    if not near.any():
        return _plain(evidence, fit(evidence))
    if np.count_nonzero(~near) < _FEWEST:
        raise NoBlockFound(
            f"no block found: {np.count_nonzero(near)} of {len(near)} wall ends along an edge lie at something that is "
            "neither the table nor cells. Clear the table, and check the light"
        )
    clear = _without(evidence, near, look)
    ring = fit(clear).ring
    apart = np.abs(depth_inside(ring, evidence.points, rectifier))
    distrusted = near & ((apart > _AGREE_PITCHES * look.pitch_px) | _at_corners(near, evidence, ring, look.pitch_px))
    if not distrusted.any():
        return _plain(evidence, fit(evidence))
    walls = _without(evidence, distrusted, look)
    points = evidence.points[distrusted]
    fills = cut_borders(picture, clear, ring, points, look, _refit(walls, fit, look.pitch_px))
    walls = walls.take(~_behind(walls, fills, look.pitch_px))
    trusted, order = walls.joined_by(joined(fills), _FILL_SIGMA_PX, WitnessKind.BLUNT)
    fitted = fit(trusted)
    out = (1.0 if evidence.is_hole else -1.0) * depth_inside(fitted.ring, points, rectifier)
    return VisibleRing(trusted, fitted, points, order >= len(walls.points), points[out > _OUT_PITCHES * look.pitch_px])


def _without_grain(evidence: RingEvidence, look: TableLook) -> RingEvidence:
    """The evidence without witnesses beyond which material goes on that is no comb: walls end at cells or the table."""
    beyond = [evidence.points + out * look.pitch_px * evidence.normal for out in _GRAIN_PITCHES]
    grain = np.all([look.solid_at(points) for points in beyond], axis=0)
    return evidence.take(~grain) if grain.any() else evidence


def doubtful(evidence: RingEvidence, look: TableLook) -> Bools:
    """Which witnesses lie at something foreign, and not on the line of the edge on both sides of it, shape (N,)."""
    near = look.foreign_at(evidence.points) < beside(look)
    if not near.any() or np.count_nonzero(~near) < _FEWEST:
        return near
    clear = _without(evidence, near, look)
    for run in runs_of(near):
        stops = float(evidence.position[run[0]]), float(evidence.position[run[-1]])
        out = out_of_flanks(clear, stops, evidence.points[run], look.pitch_px)
        if out is not None:
            near[run] = np.abs(out) > _AGREE_PITCHES * look.pitch_px
    return near


def _at_corners(near: Bools, evidence: RingEvidence, ring: Ring, pitch_px: float) -> Bools:
    """The witnesses of `near` in runs along which a ring that was laid through the others turns a corner, shape (N,):
    where it went past none it closes a gap, and that ends of walls lie on it there is chance.
    """
    lengths, found = RingLengths.of(ring), np.zeros(len(near), np.bool_)
    for run in runs_of(near):
        beside = (run[0] - 1) % len(near), (run[-1] + 1) % len(near)
        first, long = _between(lengths, evidence.points[list(beside)])
        path = lengths.at(first + np.arange(-_FOOT_PITCHES * pitch_px, long + _FOOT_PITCHES * pitch_px, pitch_px / 2))
        found[run] = np.abs(turns_deg(path)).max(initial=0.0) > _CORNER_DEG
    return found


def _between(lengths: RingLengths, points: Float64s) -> tuple[float, float]:
    """Where on a ring the foot of the first of two points (2, 2) lies, and how far on from there that of the second."""
    first, last = lengths.feet(points).tolist()
    return first, (last - first) % lengths.length


def _unshaded(near: Bools, evidence: RingEvidence, picture: Bytes, look: TableLook, fit: Fit) -> Bools:
    """The witnesses of `near` that lie at no shadow along an edge, shape (N,). What ends on the line of the edge on its
    two sides is none: a shadow does not, but dark compound in cells does.
    """
    if not near.any():
        return near
    shaded = look.in_shade(evidence.points) & (look.foreign_at(evidence.points) < beside(look))
    if not (near & shaded).any():
        return near
    ring, kept = fit(evidence).ring, near.copy()
    for run in runs_of(_without_gaps(shaded)):
        if len(run) == len(near) or (
            _is_own_edge(run, evidence, ring, look) and not _flush(run, evidence, picture, look, fit)
        ):
            kept[run] &= ~shaded[run]
    return kept


def _flush(run: Indices, evidence: RingEvidence, picture: Bytes, look: TableLook, fit: Fit) -> bool:
    """Whether the outline goes into the block from the lines of the edge on both sides of a run of witnesses, and what
    is dark there ends on these lines.
    """
    dropped = np.isin(np.arange(len(evidence.points)), run)
    clear, points = _without(evidence, dropped, look), evidence.points[run]
    stops = float(evidence.position[run[0]]), float(evidence.position[run[-1]])
    out = out_of_flanks(clear, stops, points, look.pitch_px)
    if out is None or np.count_nonzero(out < -_LEAVES_PITCHES * look.pitch_px) < _FEW:
        return False
    beyond = points + _THING_PITCHES * look.pitch_px * evidence.normal[run]
    if np.count_nonzero(look.room_at(beyond) > _THING_ROOM * look.pitch_px) < _FEW:
        return False  # cells of a dark block whose walls fade
    return len(cut_borders(picture, clear, fit(clear).ring, points, look, _refit(clear, fit, look.pitch_px))) > 0


def _behind(walls: RingEvidence, fills: list[EdgePoints], pitch_px: float) -> Bools:
    """Which witnesses lie inside of filled cells' ends, where the coarse ring goes around what fills them, (N,)."""
    found, whole = np.zeros(len(walls.points), np.bool_), perimeter(walls.coarse)
    for one in fills:
        long = (one.position[-1] - one.position[0]) % whole
        within = (walls.position - one.position[0]) % whole < long
        found |= within & (nearest(walls.points, one.points) > _AGREE_PITCHES * pitch_px)
    return found


def _refit(seen: RingEvidence, fit: Fit, pitch_px: float) -> Callable[[list[EdgePoints]], Ring]:
    """What fits the outline through filled cells' ends and what is seen, but for what lies behind those."""

    def through(fills: list[EdgePoints]) -> Ring:
        clear = seen.take(~_behind(seen, fills, pitch_px))
        return fit(clear.joined_by(joined(fills), _FILL_SIGMA_PX, WitnessKind.BLUNT)[0]).ring

    return through


def _without_gaps(chosen: Bools) -> Bools:
    """The witnesses around a ring that are chosen, and those between two that are, a few at most."""
    steps = range(-_FEW, _FEW + 1)
    grown = np.any([np.roll(chosen, step) for step in steps], axis=0)
    return np.asarray(np.all([np.roll(grown, step) for step in steps], axis=0))


def _is_own_edge(run: Indices, evidence: RingEvidence, ring: Ring, look: TableLook) -> bool:
    """Whether an outline, at a run of witnesses in what may be a shadow, is long there and nowhere turns into the
    block: what lies over an edge leaves a dent, or takes a corner off.
    """
    pitch_px, points = look.pitch_px, evidence.points[run]
    lengths = RingLengths.of(ring)
    first, long = _between(lengths, points[[0, -1]])
    if long < _SHADOW_PITCHES * pitch_px:
        return False
    reach = _SHADOW_PITCHES * pitch_px
    path = lengths.at(first + np.arange(-reach, long + reach, pitch_px))
    # With positive shoelace, material on the left, turns into it are negative.
    out, into = (np.maximum(way * turns_deg(path), 0.0) for way in (1.0, -1.0))
    ends = round(_SHADOW_PITCHES)
    for k in np.flatnonzero(into[ends:-ends]) + ends:
        less, more = sorted(out[part].sum() for part in (slice(k - ends, k), slice(k, k + ends + 1)))
        turned = into[k - ends : k + ends + 1].sum()
        if (turned > _DENT_DEG and less > _OUT_DEG) or (turned > 2.0 * _DENT_DEG and more > _OUT_DEG):
            return False  # the second where a thing lies in a corner that points into the block
    one, other = (
        float(np.radians(out[k - _CORNER_PLACES : k + _CORNER_PLACES + 1].sum())) for k in (ends - 1, len(out) - ends)
    )
    turned = (out + into)[ends + _CORNER_PLACES : -ends - _CORNER_PLACES].sum()
    return bool(turned > _CORNER_DEG) or _may_end(one, other, points, evidence.normal[run], look)


def _may_end(one: float, other: float, points: Float64s, normal: Float64s, look: TableLook) -> bool:
    """Whether a shadow beside a straight edge, seen beyond witnesses (N, 2) on it, may end at both of its corners,
    where the outline turns out by so much, radians. A block's shadow is the block itself, moved away from the light:
    beside each edge it is as wide as that lies across it.
    """
    if min(one, other) < np.radians(_CORNER_DEG) or one + other >= np.pi:
        return True
    shaded = [look.foreign_at(points + deep * look.pitch_px * normal) <= 0.0 for deep in _WIDTHS]
    width = float(np.median(np.logical_and.accumulate(shaded).sum(axis=0)) * (_WIDTHS[1] - _WIDTHS[0]))
    return bool(width * np.sin(one + other) / (np.sin(one) + np.sin(other)) < _TOLD_WIDTH)


def _plain(evidence: RingEvidence, fitted: FittedRing) -> VisibleRing:
    return VisibleRing(evidence, fitted, np.empty((0, 2)), np.zeros(len(evidence.points), np.bool_), np.empty((0, 2)))


def _without(evidence: RingEvidence, dropped: Bools, look: TableLook) -> RingEvidence:
    """The evidence without these witnesses, and without walls at the border of things."""
    return replace(
        evidence.take(~dropped),
        walls=evidence.walls.take(look.foreign_at(evidence.walls.points) >= beside(look)),
        beside=evidence.beside[look.foreign_at(evidence.beside) >= beside(look)],
    )


def _fitted(ring: RingEvidence, seen: BlockEvidence, rectifier: Rectifier | None) -> FittedRing:
    if len(ring.points) < _LEAST_WITNESSES:
        what = "a hole's edge" if ring.is_hole else "the block's edge"
        raise NoBlockFound(
            f"no block found: {len(ring.points)} wall ends along {what}, expected at least {_LEAST_WITNESSES}. "
            "Check focus and light"
        )
    return fit_ring(ring, pitch_px=seen.pitch_px, wall_px=seen.wall_px, rectifier=rectifier)
