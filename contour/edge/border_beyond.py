"""Borders of light on the table that go on where an edge of the outline ends.

Walls end at the border of a tape or a sheet that lies over a block as they do at its cut edge. What is as light as the
table, or takes a whole edge away, is told from it by nothing else: but its border mostly is longer than the block is
wide there, and runs on past the corner that the outline makes. A table has no reason to change just there, along just
that line. A block's own shadow has where light comes along an edge: then it is what lies on the other side that is
darker than beside most of the block, and at one end of that edge alone. So a border at both ends of an edge is a
thing's, and so is one at both ends of a notch that a sheet's corner leaves: no light comes along both of its edges.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from contour.edge.edge_parts import EdgePart
from contour.edge.ring_places import runs_of
from contour.geometry.arrays import Bools, Bytes, Complexes, Float64s, Indices, median, quantile, rolled
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, signed_area
from contour.geometry.signed_distance import depth_inside
from contour.image.pixel_sampling import light_beside, sample_at

# Places along a ring, pitches apart; a corner is where it turns by more between its chords before and behind, degrees,
# so many places long and away from it, and most among its neighbours, or less by so much, radians.
_SPACING, _CHORD, _SKIP, _CORNER_DEG, _NEIGHBOURS, _ALIKE = 0.1, 20, 2, 25.0, 8, 1e-6
# Pitches beyond the corner at which a ray begins, where the block's next edge is so far out of the way; its parts, and
# how many places each has. A short one counts at both ends of an edge alone: what ends at the block hardly looks out.
_NEAREST, _FREE, _PARTS, _OF_PART, _OF_SHORT_PART = 0.6, 0.75, 5, 5, 3
# Pitches across the ray, and how far from each place its two sides are, so many of them: a border is sharp, shades and
# shadows of a table are not. So near to the ray a border is the edge's own, so far from it another one; by how much it
# may turn from the edge.
_ACROSS, _SIDES, _OWN, _ANOTHER = 0.05 * np.arange(-38, 39), (1, 4), 0.3, 0.7
_TURNS = np.tan(np.radians(np.arange(-8.0, 9.0, 2.0)))
# The block is no nearer than that, pitches, looked at every so many places.
_CLEAR, _EVERY = 0.35, 4
# A step of light in the weakest part of a border: times the largest of others, times the noise, and grey levels.
_OVER_OTHERS, _OVER_NOISE, _LEAST = 2.0, 2.5, 1.0
# Less is thought of one that is not so many times the ninth decile of those along lines laid anywhere on the table:
# those of 18 of 19 sheets have 5.3 and more, those by chance 3.3 mostly and once 4.1. Fewer lines than the least tell
# nothing.
_OVER_TABLE, _LINES, _FEWEST_LINES, _DECILE = 4.2, 200, 20, 0.9
# Both ends of one edge run on along the same line: the cosine between them, and pitches across it; by so much more, and
# on short ways: of 400 right outlines one has 1.07 at both ends, the others 0.7 at most; along a sheet it was 1.45.
_STRAIGHT, _ASIDE, _MORE, _SHORT_MORE = 0.99, 0.5, 1.4, 1.25
# Light on beside the border is that along the edge, within a share of the step, the more the clearer a border is, since
# sheets are mottled and lit unevenly: by 0.17 of that at most along sheets, 0.27 and more by chance; and at most by the
# second. Where it is looked at, pitches.
_SAME, _MOST_ASTRAY = 0.2, 0.85
_BESIDE, _ALONG = np.array([0.4, 0.5, 0.6]), np.arange(-3.0, -0.4, 0.1)


@dataclass(frozen=True, eq=False)
class _Rays:
    """Edges of a ring, going on past its corners: the corner and the ray's origin, unit vectors along it and out of
    the material across it, (R, 2) each, and the length from which on it is free, (R,). All in pixels. inner: whether
    the ring turns into the material at each corner, (R,). Corners come twice: edges before them, then those behind.
    """

    corner: Float64s
    origin: Float64s
    along: Float64s
    across: Float64s
    begin: Float64s
    inner: Bools

    def take(self, some: Bools) -> _Rays:
        """Some of them, (R,)."""
        ways = self.along[some], self.across[some], self.begin[some]
        return _Rays(self.corner[some], self.origin[some], *ways, self.inner[some])

    def at(self, ahead: Float64s, out: Float64s) -> Float64s:
        """Places so far along the rays and out across them, (R, ...) both, shape (R, ..., 2)."""
        shape = (len(self.begin), *[1] * (ahead.ndim - 1), 2)
        parts = ahead[..., None] * self.along.reshape(shape) + out[..., None] * self.across.reshape(shape)
        return np.asarray(self.origin.reshape(shape) + parts)


@dataclass(frozen=True, eq=False)
class _Reach:
    """How far rays go: places ahead, (R, T), pixels, and whether each place across is away from the block in each part
    of them, (R, O, K).
    """

    ahead: Float64s
    clear: Bools


@dataclass(frozen=True, eq=False)
class _Plane:
    """A plane of light, (H, W). table: makes rays anywhere on the table, which are looked along when asked for."""

    light: Bytes
    table: Callable[[], _Rays]
    pitch_px: float

    @cached_property
    def _on_table(self) -> Float64s:
        return _sampled(self.light, self.table(), self.pitch_px)

    def usual_step(self, of_part: int) -> float:
        """What most borders by chance keep below, so many places to a part; 0 where too little of the table shows."""
        rays = self.table()
        if len(rays.begin) < _FEWEST_LINES:
            return 0.0
        parts = _parts(self._on_table, of_part)
        clear = np.ones(parts.shape, np.bool_)
        steps, *_ = _clearest(parts, clear, _middles(_ahead(rays, of_part, self.pitch_px)) / self.pitch_px)
        return quantile(steps, _DECILE)


def border_beyond(
    planes: Sequence[Bytes], contour: Contour, pitch_px: float, *, of_any_light: bool = False
) -> EdgePart | None:
    """The clearest border in planes of light, (H, W) each, that goes on from an edge of the contour past its corner:
    the length looked at, and the corner. None where there is none. of_any_light: even where light beyond is another
    than along the edge, or a shadow's: on an even table nothing else has borders.

    The contour's holes run the other way around than its exterior.
    """
    side = float(np.sign(signed_area(contour.exterior)))
    table = cache(lambda: _rays_on_table(planes[0].shape, contour.exterior, pitch_px))
    shown = [_Plane(light, table, pitch_px) for light in planes]
    found = [one for ring in contour.rings for one in _borders(shown, ring, side, pitch_px, of_any_light)]
    if not found:
        return None
    return EdgePart(_SPACING * _PARTS * _OF_PART, max(found)[1])


def _borders(
    planes: Sequence[_Plane], ring: Ring, side: float, pitch_px: float, of_any_light: bool
) -> list[tuple[float, tuple[float, float]]]:
    """How far borders past corners of a ring stand out of the noise, and the corners."""
    rays = _rays(ring, side, pitch_px)
    if not len(rays.begin):
        return []
    hole = float(np.sign(signed_area(ring))) != side
    whole, short = (_reach(rays, ring, each, pitch_px, inside=hole) for each in (_OF_PART, _OF_SHORT_PART))
    found = []
    for plane in planes:
        light = plane.light
        sampled = _sampled(light, rays, pitch_px)
        over, lines = _over(sampled, whole, plane)
        chosen = over > 1.0
        if chosen.any() and not of_any_light:
            usual = _usual_light(light, ring, side * pitch_px)
            chosen = _of_things(light, rays, over, lines, usual, pitch_px)
        shorter, lines = _over(sampled, short, plane)
        clear = shorter > _SHORT_MORE
        if clear.any():
            outer, inner = _both_sides(light, rays, lines, pitch_px)
            signed = np.where(clear, shorter * np.sign(outer - inner), 0.0)
            chosen = chosen | _at_both_ends(rays, signed, _SHORT_MORE, pitch_px)
            over = np.maximum(over, shorter)
        found += [(float(over[k]), rays.corner[k]) for k in np.flatnonzero(chosen).tolist()]
    return [(over, (float(x), float(y))) for over, (x, y) in found]


def _sampled(light: Bytes, rays: _Rays, pitch_px: float) -> Float64s:
    """Light along rays from where they are free, and farther on, (R, O, T)."""
    ahead, out = _ahead(rays, _OF_PART, pitch_px), _ACROSS * pitch_px
    shape = (len(ahead), len(out), ahead.shape[1])
    places = rays.at(np.broadcast_to(ahead[:, None], shape), np.broadcast_to(out[:, None], shape))
    return np.asarray(sample_at(light, places[..., 0], places[..., 1])).reshape(shape)


def _ahead(rays: _Rays, of_part: int, pitch_px: float) -> Float64s:
    """Places along rays from where they are free, so many in each part, (R, T), pixels."""
    return np.asarray(rays.begin[:, None] + _SPACING * pitch_px * np.arange(_PARTS * of_part))


def _over(sampled: Float64s, reach: _Reach, plane: _Plane) -> tuple[Float64s, tuple[Float64s, Float64s]]:
    """How many times the noise, or other borders, the clearest one near each ray is, (R,), with its places ahead and
    out, pixels; less where there are as clear ones anywhere on the table. sampled: light along the rays and farther on.
    """
    of_part = reach.ahead.shape[1] // _PARTS
    parts = _parts(sampled, of_part)
    step, at, turn, other = _clearest(parts, reach.clear, _middles(reach.ahead) / plane.pitch_px)
    noise = np.abs(np.diff(parts, axis=1)).mean(axis=(1, 2))
    over = step / np.maximum(np.maximum(_OVER_OTHERS * other, _OVER_NOISE * noise), _LEAST)
    if (over > 1.0).any():
        over *= np.minimum(step / max(_OVER_TABLE * plane.usual_step(of_part), _LEAST), 1.0)
    return over, (reach.ahead, at[:, None] * plane.pitch_px + turn[:, None] * reach.ahead)


def _of_things(
    light: Bytes, rays: _Rays, over: Float64s, lines: tuple[Float64s, Float64s], usual: float, pitch_px: float
) -> Bools:
    """Which rays' borders, `over` the noise so many times, (R,), are those of things. lines: places ahead and out."""
    outer, inner = _both_sides(light, rays, lines, pitch_px)
    edge = np.broadcast_to(_ALONG * pitch_px, (len(rays.begin), len(_ALONG)))
    own = _mean_light(light, rays, edge, np.zeros_like(edge), pitch_px)
    shadow = (inner < outer) & (np.abs(inner - usual) > np.abs(outer - usual))
    # A line on the table is dark or light between sides that are alike.
    border = (over > 1.0) & (np.abs(outer - inner) > _LEAST)
    alone = (np.abs(outer - own) < np.minimum(_SAME * over, _MOST_ASTRAY) * np.abs(outer - inner)) & ~shadow
    signed = np.where(border, over * np.sign(outer - inner), 0.0)
    twice = _at_both_ends(rays, signed, _MORE, pitch_px) | _around_notch(rays, signed)
    return np.asarray((border & alone) | twice)


def _both_sides(
    light: Bytes, rays: _Rays, lines: tuple[Float64s, Float64s], pitch_px: float
) -> tuple[Float64s, Float64s]:
    """Mean light beyond and within lines along the rays, (R,) each."""
    outer, inner = (_mean_light(light, rays, *lines, sign * pitch_px) for sign in (1.0, -1.0))
    return outer, inner


def _at_both_ends(rays: _Rays, over: Float64s, least: float, pitch_px: float) -> Bools:
    """Which rays have a border of the same sign at the other end of their edge, on one line with it, if both together
    stand out so far on (geometric) average. over: how far each does, with its sign, (R,).
    """
    one = np.arange(len(over) // 2)
    other = len(one) + np.roll(one, 1)  # from the corner before, backwards
    straight = -(rays.along[one] * rays.along[other]).sum(axis=1) > _STRAIGHT
    aside = np.abs(((rays.origin[one] - rays.origin[other]) * rays.across[other]).sum(axis=1))
    both = straight & (aside < _ASIDE * pitch_px) & (over[one] * over[other] > least**2)
    return np.concatenate([both, np.roll(both, -1)])


def _around_notch(rays: _Rays, over: Float64s) -> Bools:
    """Which rays have a border of the same sign at the other end of a notch with one corner inside; over: as above."""
    last = np.arange(len(over) // 2)
    first = len(last) + np.roll(last, 2)  # from the corner before the one inside, backwards
    notch = np.roll(rays.inner[last], 1) & ~rays.inner[last] & ~rays.inner[first]
    both = notch & (over[last] * over[first] > 0.0)
    return np.concatenate([both, np.roll(both, -2)])


def _usual_light(light: Bytes, ring: Ring, out_px: float) -> float:
    """Median light beside a ring; out_px: the pitch, negative where material lies to the right of its direction."""
    lengths = RingLengths.of(ring)
    at = np.arange(0.0, lengths.length, abs(out_px))
    return median(light_beside(light, lengths.at(at), out_px * lengths.normals(at, abs(out_px)), _BESIDE))


def _rays(ring: Ring, side: float, pitch_px: float) -> _Rays:
    """Both edges of each corner of a ring. side: 1.0 where the contour's exterior has a positive area, or -1.0."""
    lengths = RingLengths.of(ring)
    points = lengths.at(np.arange(0.0, lengths.length, _SPACING * pitch_px))
    count = len(points)
    if count < 3 * _CHORD:
        empty = np.empty((0, 2))
        return _Rays(empty, empty, empty, empty, np.empty(0), np.empty(0, np.bool_))
    place: Complexes = points[:, 0] + 1j * points[:, 1]
    before = rolled(place, _SKIP) - rolled(place, _SKIP + _CHORD)
    behind = rolled(place, -_SKIP - _CHORD) - rolled(place, -_SKIP)
    turned = np.angle(behind * before.conj())
    turn = np.abs(turned)
    most = np.max([rolled(turn, k) for k in range(-_NEIGHBOURS, _NEIGHBOURS + 1)], axis=0)
    # Between straight edges several places turn alike, but for rounding: the middle one is the corner.
    alike = runs_of((turn > most - _ALIKE) & (turn > np.radians(_CORNER_DEG)))
    corners = np.array([run[len(run) // 2] for run in alike], np.intp)
    index: Indices = np.concatenate([corners, corners])
    way = np.repeat([1, -1], len(corners))
    heading: Complexes = np.where(way > 0, before[index], -behind[index])
    heading = heading / np.maximum(np.abs(heading), 1e-9)
    near = place[(index[:, None] - way[:, None] * np.arange(_SKIP + 1, _SKIP + _CHORD + 1)) % count].mean(axis=1)
    origin = near + heading * ((place[index] - near) * heading.conj()).real
    across: Complexes = -1j * side * way * heading
    sine = np.sin(np.minimum(turn[index], 0.5 * np.pi))
    begin = pitch_px * np.maximum(_NEAREST, _FREE / np.maximum(sine, 1e-3))
    return _Rays(points[index], _pairs(origin), _pairs(heading), _pairs(across), begin, side * turned[index] < 0.0)


def _pairs(places: Complexes) -> Float64s:
    return np.column_stack([places.real, places.imag])


def _rays_on_table(shape: tuple[int, ...], exterior: Ring, pitch_px: float) -> _Rays:
    """Rays on a picture (H, W), spread evenly over places and ways, where all of them and of what is beside them shows
    table.
    """
    count = np.arange(1.0, _LINES + 1.0)
    # Steps of the plastic number's powers fill a rectangle evenly, those of the golden section a circle.
    origin = np.column_stack([count * 0.7548776662, count * 0.5698402910]) % 1.0 * [shape[1], shape[0]]
    heading = np.exp(2j * np.pi * 0.6180339887 * count)
    rays = _Rays(origin, origin, _pairs(heading), _pairs(-1j * heading), np.zeros(_LINES), np.zeros(_LINES, np.bool_))
    long, wide = _SPACING * _PARTS * _OF_PART * pitch_px, float(_ACROSS[-1]) * pitch_px
    ends = rays.at(
        np.broadcast_to([0.0, 0.0, 0.5 * long, long, long], (_LINES, 5)),
        np.broadcast_to([-wide, wide, 0.0, -wide, wide], (_LINES, 5)),
    )
    seen = np.all((ends > 0.0) & (ends < [shape[1] - 1.0, shape[0] - 1.0]), axis=(1, 2))
    off = np.all(depth_inside(exterior, ends.reshape(-1, 2)).reshape(_LINES, 5) < -_CLEAR * pitch_px, axis=1)
    return rays.take(np.asarray(seen & off))


def _reach(rays: _Rays, ring: Ring, of_part: int, pitch_px: float, *, inside: bool) -> _Reach:
    """So many places in each part of rays. inside: whether these are in a hole."""
    ahead = _ahead(rays, of_part, pitch_px)
    middle = _middles(ahead)
    out = _ACROSS[::_EVERY] * pitch_px
    shape = (len(middle), len(out), _PARTS)
    places = rays.at(np.broadcast_to(middle[:, None], shape), np.broadcast_to(out[:, None], shape))
    depth = depth_inside(ring, places.reshape(-1, 2)).reshape(shape)
    clear = (depth if inside else -depth) > _CLEAR * pitch_px
    return _Reach(ahead, np.repeat(clear, _EVERY, axis=1)[:, : len(_ACROSS)])


def _parts(sampled: Float64s, of_part: int) -> Float64s:
    """Mean light in each part of rays, so many places long, (R, O, K); sampled: light along them, (R, O, T)."""
    return np.asarray(sampled[..., : _PARTS * of_part].reshape(*sampled.shape[:2], _PARTS, of_part).mean(axis=3))


def _middles(ahead: Float64s) -> Float64s:
    """The middles of the parts of rays, (R, K), by places ahead, (R, T)."""
    return np.asarray(ahead.reshape(len(ahead), _PARTS, -1).mean(axis=2))


def _clearest(parts: Float64s, clear: Bools, middle: Float64s) -> tuple[Float64s, Float64s, Float64s, Float64s]:
    """The largest step across lines near each ray, where that line begins and how it turns, and the largest step across
    other lines, (R,) each. A line's step is that of its weakest part.

    parts: light in each part of the rays, (R, O, K). middle: how far along the parts lie, (R, K), pitches.
    """
    near, far = _SIDES
    total = np.concatenate([np.zeros_like(parts[:, :1]), np.cumsum(parts, axis=1)], axis=1)
    index = np.arange(far, parts.shape[1] - far)
    above = total[:, index + far + 1] - total[:, index + near]
    below = total[:, index - near + 1] - total[:, index - far]
    steps = (above - below) / (far - near + 1)
    free = clear[:, index - far] & clear[:, index] & clear[:, index + far]
    steps = np.where(free, steps, np.nan)
    at = _ACROSS[index]
    shift = np.rint(_TURNS[:, None, None] * middle / (_ACROSS[1] - _ACROSS[0])).astype(np.intp)
    rows = np.arange(len(at))[:, None] + shift[:, :, None]
    inner = (rows >= 0) & (rows < len(at))
    taken = np.take_along_axis(steps[None], np.clip(rows, 0, len(at) - 1), axis=2)
    taken = np.where(inner, taken, np.nan)
    parts_taken = np.moveaxis(taken, 3, 0)  # five slices: a last axis of five takes several times longer
    low, high = parts_taken[0], parts_taken[0]
    for part in parts_taken[1:]:
        low, high = np.minimum(low, part), np.maximum(high, part)
    weakest = np.maximum(low, -high)  # nan where a part is nan
    weakest = np.where(np.isnan(weakest), 0.0, weakest)
    own = np.where(np.abs(at) <= _OWN, weakest, 0.0).transpose(1, 0, 2)
    other = np.where(np.abs(at) >= _ANOTHER, weakest, 0.0).max(axis=(0, 2))
    best = own.reshape(len(own), -1).argmax(axis=1)
    turn, place = np.unravel_index(best, own.shape[1:])
    step = np.asarray(own[np.arange(len(own)), turn, place])
    return step, np.asarray(at[place]), np.asarray(_TURNS[turn]), np.asarray(other)


def _mean_light(light: Bytes, rays: _Rays, ahead: Float64s, out: Float64s, beside_px: float) -> Float64s:
    """Mean light beside lines along the rays, (R,); ahead, out: places on the lines, (R, T), pixels."""
    places = rays.at(ahead[:, None] + 0.0 * _BESIDE[:, None], out[:, None] + beside_px * _BESIDE[:, None])
    return np.asarray(sample_at(light, places[..., 0], places[..., 1]).mean(axis=(1, 2)))
