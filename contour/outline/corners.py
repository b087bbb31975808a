"""Where neighbouring segments meet, and the ring of few vertices that follows: corners, smooth joins, arcs as
chords."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, median, rolled
from contour.outline.lines_and_arcs import Models, distance, feet
from contour.outline.runs import Segments
from contour.outline.witnesses import Witnesses

_REACH = 1.7
_SLACK = 0.8
# A single witness so much farther out on an edge's line than its corner is dust: alone it draws no spike.
_LONE = 1.6
_SMOOTH_SINE = 0.26
_ASIDE = 0.8
_STEPS, _SETTLED_PX = 6, 1e-9


@dataclass(frozen=True, eq=False)
class Joints:
    """Joint after each segment, shape (S,): where the segment ends and where the next begins (the same point but for
    a bevel).

    kink: how far the two are from flowing into one another, the turn in radians; infinite where they step aside.
    """

    end: Complexes
    begin: Complexes
    kink: Float64s


def ends(witnesses: Witnesses, segments: Segments, inlier: Bools, *, but: int = 0) -> tuple[Complexes, Complexes]:
    """Feet of each segment's first and last inlying witness on its model, shape (S,) each; `but` so many at either."""
    count = len(witnesses)
    places_first, places_last = segments.first.copy(), segments.first + segments.length - 1
    for k in range(len(segments)):
        inside = np.flatnonzero(inlier[segments.members(k, count)])
        if len(inside):
            skipped = min(but, (len(inside) - 1) // 2)
            places_first[k] = segments.first[k] + inside[skipped]
            places_last[k] = segments.first[k] + inside[-1 - skipped]
    first, _ = feet(segments.models, witnesses.points[places_first % count])
    last, _ = feet(segments.models, witnesses.points[places_last % count])
    return first, last


def joints(witnesses: Witnesses, segments: Segments, inlier: Bools) -> Joints:
    """The joint after each segment: a corner at the intersection where it lies within reach of the evidence, a smooth
    join where the two all but touch, else a bevel from the last witness of one to the first of the next."""
    first, last = ends(witnesses, segments, inlier)
    after = rolled(np.arange(len(segments)), -1)
    following = segments.models.take(after)
    near, far = last, first[after]
    point, met = intersections(segments.models, following, near, far)
    _, tangent = feet(segments.models, near)
    _, next_tangent = feet(following, far)
    gap = np.abs(far - near)
    turn = tangent.conj() * next_tangent
    half = np.tan(0.5 * np.maximum(np.pi - np.abs(np.angle(turn)), 0.2))
    reach = _REACH * witnesses.pitch_px * np.maximum(1.0, 0.5 / half) + gap
    slack = _SLACK * witnesses.pitch_px
    ahead = ((point - near) * tangent.conj()).real
    behind = ((far - point) * next_tangent.conj()).real
    lone = _LONE * witnesses.pitch_px
    inner_first, inner_last = ends(witnesses, segments, inlier, but=1)
    lone_last = (ahead > -lone) & (((point - inner_last) * tangent.conj()).real > 0.0)
    lone_first = (behind > -lone) & (((inner_first[after] - point) * next_tangent.conj()).real > 0.0)
    corner = (
        met & ((ahead > -slack) | lone_last) & (ahead < reach) & ((behind > -slack) | lone_first) & (behind < reach)
    )
    corner &= (np.abs(point - near) < 1.5 * reach) & (np.abs(point - far) < 1.5 * reach)
    middle = 0.5 * (near + far)
    one, one_tangent = feet(segments.models, middle)
    other, other_tangent = feet(following, middle)
    aside = np.abs(one - other)
    smooth_turn = np.abs((one_tangent.conj() * other_tangent).imag) < _SMOOTH_SINE
    smooth_turn &= (one_tangent.conj() * other_tangent).real > 0.0
    sigma = median(witnesses.outer)
    touching = smooth_turn & (aside < max(4.0 * sigma, 0.05 * witnesses.pitch_px))
    blend = 0.5 * (one + other)
    end = np.where(corner, point, np.where(touching, blend, near))
    begin = np.where(corner, point, np.where(touching, blend, far))
    kink = np.abs(np.angle(one_tangent.conj() * other_tangent))
    return Joints(end, begin, np.where(aside < _ASIDE * witnesses.pitch_px, kink, np.inf))


def intersections(models: Models, following: Models, near: Complexes, far: Complexes) -> tuple[Complexes, Bools]:
    """Where neighbours intersect nearest to the evidence (Newton on the two distances), and whether they do."""
    point = 0.5 * (near + far)
    foot, tangent = feet(models, near)
    other, other_tangent = feet(following, far)
    for _ in range(_STEPS):
        before = point
        sine = (tangent.conj() * other_tangent).imag
        sine = np.where(np.abs(sine) > 0.004, sine, np.nan)
        ahead = ((other - foot).conj() * other_tangent).imag / sine
        point = foot + ahead * tangent
        point = np.where(np.isfinite(point), point, 0.5 * (near + far))
        if (np.abs(point - before) < _SETTLED_PX).all():  # lines do after one step
            break
        foot, tangent = feet(models, point)
        other, other_tangent = feet(following, point)
    met = (np.abs(distance(models, point)) < 0.02) & (np.abs(distance(following, point)) < 0.02)
    return point, met


def without_reversed(witnesses: Witnesses, segments: Segments, inlier: Bools) -> tuple[Segments, Joints]:
    """Segments and joints after dropping short segments that their neighbours' corners leave no room for."""
    while True:
        found = joints(witnesses, segments, inlier)
        if len(segments) < 4:
            return segments, found
        begin = rolled(found.begin, 1)
        _, tangent = feet(segments.models, 0.5 * (begin + found.end))
        run = ((found.end - begin) * tangent.conj()).real
        sweep = np.abs(segments.models.curvature) * segments.length * witnesses.pitch_px
        reversed_ = (run < -1e-9) & (sweep < 3.0)
        if not reversed_.any():
            return segments, found
        worst = int(np.where(reversed_, run, np.inf).argmin())
        segments = _dropped(segments, worst)


def _dropped(segments: Segments, which: int) -> Segments:
    """The segments without one; its witnesses go to the segment before."""
    length = segments.length.copy()
    length[which - 1] += length[which]
    keep = np.arange(len(segments)) != which
    return replace(
        segments,
        models=segments.models.take(keep),
        bend=segments.bend[keep],
        first=segments.first[keep],
        length=length[keep],
    )


def sweep(model: Models, start: complex, stop: complex, run: float) -> tuple[float, float]:
    """Angle at which an arc starts, about its origin, and the angle it turns through until `stop` (radians, left
    positive).

    run: about how long the arc is, pixels; it tells a long way round from a short one back. Never more than a quarter
    over a whole turn: no outline does, whatever the run of a fit that went wrong.
    """
    curvature = float(model.curvature)
    origin, tangent = complex(model.origin), complex(model.tangent)
    from_, to = (float(np.angle(1.0 + 1j * curvature * ((p - origin) * tangent.conjugate()))) for p in (start, stop))
    turn = to - from_
    turn += 2.0 * np.pi * round((curvature * run - turn) / (2.0 * np.pi))
    return from_, turn if abs(turn) <= 2.5 * np.pi else float(np.fmod(turn, 2.0 * np.pi))


def arc_points(
    model: Models, start: complex, stop: complex, *, run: float, tolerance: float, whole: bool = False
) -> Complexes:
    """Inner vertices of an arc from `start` to `stop` (both on it, not included), chords within `tolerance` pixels.

    `run` is about the arc's length. Vertices stand out by two thirds of the sagitta, so that the area under the
    chords is the arc's. A whole circle takes `start` as its first vertex direction and includes it.
    """
    curvature = float(model.curvature)
    if abs(curvature) < 1e-12:
        return np.zeros(0, dtype=np.complex128)
    from_, turn = sweep(model, start, stop, run)
    if whole:
        turn = float(np.copysign(2.0 * np.pi, curvature))
    most = 2.0 * float(np.sqrt(2.0 * tolerance * abs(curvature)))
    chords = max(8 if whole else 1, int(np.ceil(abs(turn) / most - 1e-9)))
    turned = np.exp(1j * (from_ + turn * np.arange(0 if whole else 1, chords) / chords))
    sagitta = (1.0 - np.cos(0.5 * turn / chords)) / curvature
    origin, tangent = complex(model.origin), complex(model.tangent)
    inner: Complexes = (
        origin + 1j * tangent * (1.0 - turned) / curvature - 1j * tangent * turned * (2.0 / 3.0) * sagitta
    )
    return inner


def thinned(ring: Complexes, tolerance: float) -> Indices:
    """Indices of the vertices to keep: none twice, none within `tolerance` of the chord of its neighbours."""
    keep = np.arange(len(ring))
    while len(keep) > 3:
        points = ring[keep]
        back, ahead = rolled(points, 1), rolled(points, -1)
        chord = ahead - back
        length = np.maximum(np.abs(chord), 1e-12)
        off = np.abs((chord.conj() * (points - back)).imag) / length
        along = (chord.conj() * (points - back)).real / length
        off = np.where((along < 0.0) | (along > length), np.minimum(np.abs(points - back), np.abs(ahead - points)), off)
        worst = int(off.argmin())
        if off[worst] >= tolerance:
            break
        keep = np.delete(keep, worst)
    return keep
