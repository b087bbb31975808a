"""Segments that flow into one another without a corner: one free curve, where that explains their witnesses better."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices, rolled
from contour.outline.corners import Joints
from contour.outline.free_curves import Curve, Guide, smooth_curve
from contour.outline.labelling import PRICE_ARC, PRICE_LINE
from contour.outline.lines_and_arcs import feet
from contour.outline.runs import Segments
from contour.outline.witnesses import Witnesses, cost

# A straight edge longer than this is an edge, not a part of a free curve.
_LONGEST_LINE_PITCHES = 8.0
_PRICE_OF_FREEDOM = 4.0
_SHARPEST = 0.7
_MOST_TRIES = 10


@dataclass(frozen=True, eq=False)
class Chain:
    """Segments (their indices, in order) that one curve replaces, and the witnesses it runs through."""

    segments: tuple[int, ...]
    curve: Curve
    witnesses: Indices

    @property
    def price(self) -> float:
        """Nats for the curve's parameters."""
        return _PRICE_OF_FREEDOM * self.curve.freedom


def free_curves(witnesses: Witnesses, segments: Segments, found: Joints, signed: Float64s) -> list[Chain]:
    """Chains whose spline is the shorter description: its misfit and parameters cost less than those of its lines and
    arcs.

    A run that is not is cut at its sharpest joint, and its parts are tried. A ring that is mostly bent and has a single
    corner is tried as one curve before: where few cells leave a bend unseen, two edges that meet far outside are cheap.
    """
    whole = (
        _as_curve(witnesses, segments, list(range(len(segments))), True, signed)
        if _bent(witnesses, segments, found)
        else None
    )
    if whole is not None:
        return [whole]
    chains: list[Chain] = []
    linked = _links(witnesses, segments, found)
    waiting = _runs(segments, linked)
    tries = 0
    while waiting and tries < _MOST_TRIES:
        members, closed = waiting.pop(0)
        tries += 1
        chain = _as_curve(witnesses, segments, members, closed, signed)
        if chain is not None:
            chains.append(chain)
            continue
        inner = members if closed else members[:-1]
        sharpest = max(inner, key=lambda k: float(found.kink[k]))
        at = members.index(sharpest) + 1
        parts = [members[at:] + members[:at]] if closed else [members[:at], members[at:]]
        waiting += [(part, False) for part in parts if len(part) > 1 and bool(segments.bend[part].any())]
    return chains


def _as_curve(
    witnesses: Witnesses, segments: Segments, members: list[int], closed: bool, signed: Float64s
) -> Chain | None:
    """The members as one curve, or None where lines and arcs are the shorter description."""
    index = np.concatenate([segments.members(k, len(witnesses)) for k in members])
    if len(index) < 8:
        return None
    guide = _guide(witnesses, segments, members, index, closed)
    sound = np.abs(signed[index]) < 4.0 * witnesses.outer[index]
    curve = smooth_curve(witnesses, index, guide, sound)
    price = sum(PRICE_ARC if segments.bend[k] else PRICE_LINE for k in members)
    present = float(cost(witnesses, signed[index], index).sum()) + price
    if curve.nats + _PRICE_OF_FREEDOM * curve.freedom < present:
        return Chain(tuple(members), curve, index)
    return None


def _bent(witnesses: Witnesses, segments: Segments, found: Joints) -> bool:
    """Whether a ring is of arcs for the greater part, without a long straight edge, and has but one corner."""
    arcs = int(segments.bend.sum())
    corners = int((found.kink >= _SHARPEST).sum())
    return bool(_supple(witnesses, segments, found).all()) and 2 * arcs > len(segments) > 1 and corners == 1


def _supple(witnesses: Witnesses, segments: Segments, found: Joints) -> Bools:
    """Which segments may be part of a free curve: arcs, and straight edges that are short."""
    length = np.abs(found.end - rolled(found.begin, 1))
    return np.asarray(segments.bend | (length < _LONGEST_LINE_PITCHES * witnesses.pitch_px), np.bool_)


def _links(witnesses: Witnesses, segments: Segments, found: Joints) -> Bools:
    """True where a segment may flow into the next: no sharp turn, an arc on either side, no long straight edge."""
    supple = _supple(witnesses, segments, found)
    links: Bools = (found.kink < _SHARPEST) & supple & rolled(supple, -1) & (segments.bend | rolled(segments.bend, -1))
    return links


def _runs(segments: Segments, linked: Bools) -> list[tuple[list[int], bool]]:
    """Longest runs of linked segments, at least two, and whether the run is the whole ring."""
    total = len(segments)
    if total > 1 and linked.all():
        return [(list(range(total)), True)]
    found: list[tuple[list[int], bool]] = []
    for begin in np.flatnonzero(~rolled(linked, 1)):
        members = [int(begin)]
        while linked[members[-1]]:
            members.append((members[-1] + 1) % total)
        if len(members) > 1:
            found.append((members, False))
    return found


def _guide(witnesses: Witnesses, segments: Segments, members: list[int], index: Indices, closed: bool) -> Guide:
    """Feet of the witnesses at `index` on their own members."""
    owner = np.repeat(members, segments.length[members])
    foot, tangent = feet(segments.models.take(owner), witnesses.points[index])
    way = rolled(foot, -1) - foot
    middle = tangent + rolled(tangent, -1)
    forward = np.maximum((way * middle.conj()).real / np.maximum(np.abs(middle), 1e-9), 0.0)
    place = np.concatenate([[0.0], np.cumsum(forward[:-1])])
    return Guide(foot, place, float(place[-1] + (forward[-1] if closed else 0.0)), closed)
