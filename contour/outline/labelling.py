"""Which line or arc each witness belongs to: the cheapest cyclic labelling under description-length prices
(Viterbi)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, rolled
from contour.outline.lines_and_arcs import Models, distance, feet
from contour.outline.proposals import FEW, Proposals
from contour.outline.witnesses import Witnesses, cost

# Nats for one more line or arc: its parameters at the precision the witnesses give, and where it begins.
PRICE_LINE = 10.0
PRICE_ARC = 15.0
_CORNER = 1.0
# A missing cell only ever makes a dent: a reflex corner has to be earned (around a hole, where all sides of a rectangle
# meet in reflex corners, a convex one).
_REFLEX = 5.0
_REFLEX_PER_RADIAN = 6.0
_JUMP = 16.0
# Where a corner lies farther from its evidence than a witness's own distance, its cell must be missing: not unlikely,
# but what hides more of a right angle than this many pitches, both edges together, is no single cell.
_MISSING_CELL = 0.5
_UNSEEN_CORNER = 4.4
_UNSEEN_PER_PITCH = 4.0
# A wall or a cell broken out of an edge hides so much of it; in longer gaps each outlier counts more.
_UNSEEN_EDGE = 3.0
_DEARER_PER_PITCH = 0.25
_DEAREST = 2.0
_REACH = 1.6
_STATES = 8
_STATES_OF_FEW, _PLACES_OF_FEW = 48, 1500
_NEARBY = 3
# Gains above this mark models of the present labelling, which must stay available.
_PRESENT = 5e3
# Of what calling it an outlier costs, saved by a witness that lies on a model.
_LIES = 0.5
_FAR = 1e6


@dataclass(frozen=True, eq=False)
class _Reach:
    """From each state's foot along its model to the nearest witness that lies on it, back and ahead: shape (N, A),
    pixels, 0 where none does."""

    back: Float64s
    ahead: Float64s


def label(witnesses: Witnesses, proposals: Proposals) -> Indices:
    """The proposal of each witness, shape (N,): the cheapest labelling of the ring, each within its own stretch."""
    here, last, following = _states(witnesses, proposals)
    count = len(witnesses)
    models = proposals.models.take(np.maximum(here, 0))
    points = witnesses.points[:, None]
    signed = distance(models, points)
    unary = cost(witnesses, signed, np.arange(count)[:, None])
    foot, tangent = feet(models, points)
    reached = _reach(witnesses, models, foot, last=last, following=following)
    hidden = (reached.back + reached.ahead) / witnesses.pitch_px
    unary = unary * np.clip(1.0 + _DEARER_PER_PITCH * (hidden - _UNSEEN_EDGE), 1.0, _DEAREST)
    unary = np.where(here >= 0, unary, _FAR)
    unary = unary + _REFLEX_PER_RADIAN * np.maximum(witnesses.rare * models.curvature, 0.0) * witnesses.gap[:, None]
    facing = (tangent * witnesses.normal.conj()[:, None]).imag
    unary = np.where(facing > -0.2, unary, unary + 20.0)
    step = _steps(witnesses, proposals, here, foot, tangent, reached)
    step += rolled(unary, -1)[:, None, :]
    return here[np.arange(count), _cheapest_cycle(step, unary)]


def _states(witnesses: Witnesses, proposals: Proposals) -> tuple[Indices, Indices, Indices]:
    """The proposals that explain each witness's neighbourhood best, shape (N, A), -1 where fewer reach it; and the
    nearest witness back and ahead that lies on the proposal, -1 where none does."""
    count = len(witnesses)
    margin = np.maximum(proposals.length // 2, 4)
    reach = np.minimum(proposals.length + 2 * margin, count)
    which = np.repeat(np.arange(len(proposals)), reach)
    begin = np.cumsum(reach) - reach
    place = ((proposals.first - margin)[which] + np.arange(len(which)) - begin[which]) % count
    saved = witnesses.cap_inside[place] - cost(
        witnesses, distance(proposals.models.take(which), witnesses.points[place]), place
    )
    lies = (saved > _LIES * witnesses.cap_inside[place]) & ~witnesses.bound[place]
    last, following = supports(lies, place, begin[which], (begin + reach)[which])
    running = np.concatenate([[0.0], np.cumsum(saved)])
    here = np.arange(len(which))
    low = np.maximum(here - _NEARBY, begin[which])
    high = np.minimum(here + _NEARBY + 1, (begin + reach)[which])
    score = running[high] - running[low] + 0.1 * np.clip(proposals.gain[which], 0.0, 200.0)
    score = np.where(proposals.gain[which] > _PRESENT, 1e3 + score, score)
    order = _falling(score)
    order = order[np.argsort(place[order].astype(np.uint16), kind="stable")]
    ordered = place[order]
    many = np.bincount(ordered, minlength=count)
    rank = np.arange(len(place)) - (np.cumsum(many) - many)[ordered]
    most = _STATES if count > FEW else min(_STATES_OF_FEW, _PLACES_OF_FEW // count)
    fits = rank < most
    order, at, rank = order[fits], ordered[fits], rank[fits]
    wide = int(rank.max()) + 1
    states = np.full((3, count, wide), -1, dtype=np.intp)
    states[:, at, rank] = which[order], last[order], following[order]
    return states[0], states[1], states[2]


def _falling(values: Float64s) -> Indices:
    """The order in which values fall, equal ones as they come: sorting so takes five times as long where none are."""
    order = np.argsort(-values)
    ordered = values[order]
    return np.argsort(-values, kind="stable") if (ordered[1:] == ordered[:-1]).any() else order


def _steps(
    witnesses: Witnesses, proposals: Proposals, here: Indices, foot: Complexes, tangent: Complexes, reached: _Reach
) -> Float64s:
    """Price of going from state a at witness i to state b at witness i + 1, shape (N, A, A)."""

    def after(of_next: NDArray[Any]) -> NDArray[Any]:
        return rolled(of_next, -1)[:, None, :]

    following = rolled(here, -1)
    between = _Between(
        gap=witnesses.gap[:, None, None],
        unseen=reached.back[:, :, None] + after(reached.ahead),
        sigma=np.maximum(witnesses.outer, rolled(witnesses.outer, -1))[:, None, None],
    )
    last = _Foot(foot[:, :, None], tangent[:, :, None])
    step = _joint_cost(last, _Foot(after(foot), after(tangent)), between, witnesses.pitch_px, witnesses.rare)
    step += np.where(proposals.bend, PRICE_ARC, PRICE_LINE)[np.maximum(following, 0)][:, None, :]
    step[here[:, :, None] == following[:, None, :]] = 0.0
    return step


@dataclass(frozen=True, eq=False)
class _Foot:
    """Feet of a witness on models, and the models' tangents there, complex."""

    at: Complexes
    tangent: Complexes


@dataclass(frozen=True, eq=False)
class _Between:
    """What lies between the last witness of one model and the next, of another: the gap between both, and the larger
    standard deviation of the two. unseen: pixels from the last witness that lies on the one model to its foot, and from
    the next foot to the first that lies on the other, together.
    """

    gap: Float64s
    unseen: Float64s
    sigma: Float64s


def _joint_cost(last: _Foot, following: _Foot, between: _Between, pitch_px: float, rare: float) -> Float64s:
    """Nats of a joint between two models, given their feet at the last and the next witness (shapes broadcast).

    rare: sign of the turns that have to be earned.

    A corner: the tangents meet ahead of the one and behind the other, within reach of the evidence. A smooth join:
    small turn, small step aside. Else a jump at a fixed price.
    """
    # By x and y, and in place: this is the most of what a labelling takes.
    (ax, ay), (bx, by) = ((foot.tangent.real.copy(), foot.tangent.imag.copy()) for foot in (last, following))
    way_x, way_y = following.at.real - last.at.real, following.at.imag - last.at.imag
    sine, cosine = ax * by - ay * bx, ax * bx + ay * by
    ahead, behind = way_x * by - way_y * bx, ax * way_y - ay * way_x
    aside = behind - ahead
    size = np.abs(sine)
    reflex = np.zeros(sine.shape)
    dear = rare * sine > 0.0
    reflex[dear] = _REFLEX_PER_RADIAN * np.arctan2(size[dear], cosine[dear])
    bent = size > 0.05
    sine[~bent] = 1.0
    ahead /= sine
    behind /= sine
    corner = _excess(ahead, pitch_px, between.gap)
    corner += _excess(behind, pitch_px, between.gap)
    corner *= 8.0 / pitch_px**2
    corner += _CORNER
    corner += reflex
    corner += _REFLEX * dear
    # A cell in a corner touches its edges at a distance that goes with the cotangent of half the angle between them.
    hidden = ahead
    hidden += behind
    hidden += between.unseen
    hidden /= pitch_px
    hidden += 1.0 - _UNSEEN_CORNER
    hidden -= size / np.maximum(1.0 + cosine, 0.2)
    missing = np.maximum(hidden + 2.0, 0.0)
    corner += np.multiply(np.minimum(missing, 1.0, out=missing), _MISSING_CELL, out=missing)
    corner += np.multiply(np.maximum(hidden, 0.0, out=hidden), _UNSEEN_PER_PITCH, out=hidden)
    corner[~bent] = np.inf
    aside /= np.maximum(np.sqrt((ax + bx) ** 2 + (ay + by) ** 2), 1e-6)
    smooth = _smooth(aside, between.sigma, size, ahead=cosine > 0.0)
    reflex += _JUMP
    return np.minimum(np.minimum(corner, smooth, out=corner), reflex, out=corner)


def _smooth(aside: Float64s, sigma: Float64s, sine: Float64s, *, ahead: Bools) -> Float64s:
    """Nats of a smooth join with such a step aside and such a turn, in the place of both."""
    aside /= sigma
    aside *= aside
    aside *= 0.25
    sine *= sine
    sine[~ahead] = 1.0
    sine *= 12.0
    aside += sine
    return aside


def _excess(reach: Float64s, pitch_px: float, gap: Float64s) -> Float64s:
    """The square of how far corners lie beyond what was seen, pixels."""
    excess = np.maximum(reach - (_REACH * pitch_px + gap), -0.3 * pitch_px - reach)
    np.maximum(excess, 0.0, out=excess)
    excess *= excess
    return excess


def _cheapest_cycle(step: Float64s, first: Float64s) -> Indices:
    """Cheapest closed path: step[i] holds prices from i to i + 1 (cyclic), with the price of being there.

    An open pass finds the path's longest run; where it does not close, a second pass starts and ends in the middle of
    that, in its state.
    """
    count = len(step)
    start = int((first < _FAR).sum(axis=1).argmin())
    path = _cheapest_path(rolled(step, -start), first[start], None)
    if step[start - 1, path[-1], path[0]] == first[start, path[0]]:
        return rolled(path, start)  # it ends in the model that it began with: no closed path is cheaper
    change = np.flatnonzero(np.diff(path, prepend=-1, append=-1))
    longest = int(np.diff(change).argmax())
    anchor = int(change[longest] + change[longest + 1]) // 2
    state = int(path[anchor])
    anchor = (anchor + start) % count
    initial = np.full(step.shape[1], _FAR)
    initial[state] = 0.0
    return rolled(_cheapest_path(rolled(step, -anchor), initial, state), anchor)


def _cheapest_path(step: Float64s, initial: Float64s, closing: int | None) -> Indices:
    """Cheapest path from the initial prices, open or (where `closing` is a state) back to that state; of `step` it
    makes the prices of coming that way.
    """
    totals = np.empty(step.shape[:2])
    totals[0] = initial
    add, least = np.add, np.minimum.reduce
    for before, price, after in zip(totals[:, :, None], step, totals[1:], strict=False):
        least(add(before, price, price), 0, None, after)
    last = totals[-1] if closing is None else totals[-1] + step[-1, :, closing]
    path = [int(last.argmin())]
    for coming in step[-2::-1].argmin(axis=1).tolist():
        path.append(coming[path[-1]])
    return np.array(path[::-1], np.intp)


def _reach(witnesses: Witnesses, models: Models, foot: Complexes, *, last: Indices, following: Indices) -> _Reach:
    """The reach of each state: its model, foot and supporting witnesses (see `supports`), shape (N, A) each."""
    return _Reach(_away(witnesses, models, foot, last), _away(witnesses, models, foot, following))


def supports(lies: Bools, place: Indices, begin: Indices, end: Indices) -> tuple[Indices, Indices]:
    """The witness at or before each entry, and at or after it, that `lies` on the same model; -1 where none does.

    Entries of one model run from `begin` to `end`, one for each witness (at `place`) that it may explain.
    """
    here = np.arange(len(place))
    last = np.maximum.accumulate(np.where(lies, here, -1))
    following = np.minimum.accumulate(np.where(lies, here, len(place))[::-1])[::-1]
    back = np.where(last >= begin, place[np.maximum(last, 0)], -1)
    ahead = np.where(following < end, place[np.minimum(following, len(place) - 1)], -1)
    return back, ahead


def _away(witnesses: Witnesses, models: Models, foot: Complexes, support: Indices) -> Float64s:
    there, _ = feet(models, witnesses.points[support])
    return np.where(support >= 0, np.abs(there - foot), 0.0)
