"""How things are laid over the block's edge or a hole, or beside it on the table."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.fifth_hand.outlines import dense
from benchmarks.fifth_hand.parts import Part, parts_mask
from benchmarks.fifth_hand.plans import BUILDERS, Builder, LitBuilder, Plan
from benchmarks.other_hand.fields import Rng
from contour.geometry.arrays import Bools, Float64s


def things_over(rng: Rng, plan: Plan, rings: Sequence[Float64s], comb: Bools, table_light: float) -> list[Part]:
    """All that a plan lays over the block. comb: where the block is, (H, W)."""
    if plan.plug is not None:
        return _plugs(rng, plan.plug, rings)
    builder = plan.over
    if plan.like_table is not None:
        builder = _lit(plan.like_table, float(np.clip(table_light + rng.normal(0, 0.025), 0, 1)))
    if builder is None:
        return []
    count = int(rng.choice([1, 2, 3], p=[0.5, 0.3, 0.2]))
    return [part for _ in range(count) for part in _over_edge(rng, builder, rings, comb)]


def _lit(builder: LitBuilder, light: float) -> Builder:
    """The builder of things of this light."""
    return lambda rng, size: builder(rng, size, light)


def things_beside(rng: Rng, count: int, rings: Sequence[Float64s], comb: Bools, *, near: bool) -> list[Part]:
    """At most so many things on the table apart from the block, close to its edge if `near`."""
    gap = 3 if near else int(rng.integers(4, 14))
    shape = (comb.shape[0], comb.shape[1])
    block = np.asarray(cv2.dilate(comb[::4, ::4].astype(np.uint8), np.ones((gap, gap), np.uint8)) > 0)
    small = block[: shape[0] // 4, : shape[1] // 4]
    line = dense(rings[0])
    placed: list[Part] = []
    for _ in range(count):
        builder = BUILDERS[rng.integers(len(BUILDERS))]
        index, size = int(rng.integers(len(line))), comb.shape[1] * rng.uniform(0.04, 0.15)
        away = _outward(line, index, comb)
        body = builder(rng, size)
        turn = away + rng.uniform(-0.6, 0.6)
        heading = np.array([np.cos(away), np.sin(away)])
        for distance in np.linspace(0.2, 6, 24) * size + (0 if near else rng.uniform(0, 2) * size):
            parts = _set_down(body, turn, line[index] + heading * distance)
            if not (parts_mask(parts, shape) & small).any():
                placed += parts
                break
    return placed


def _plugs(rng: Rng, builder: Builder, rings: Sequence[Float64s]) -> list[Part]:
    """A thing in one or more of the holes."""
    holes = list(rings[1:])
    parts: list[Part] = []
    for index in rng.permutation(len(holes))[: int(rng.integers(1, len(holes) + 1))]:
        centre = holes[index].mean(0)
        radius = float(np.hypot(*(holes[index] - centre).T).max())
        parts += _set_down(builder(rng, radius), rng.uniform(0, 6.3), centre + rng.normal(0, 0.04 * radius, 2))
    return parts


def _over_edge(rng: Rng, builder: Builder, rings: Sequence[Float64s], comb: Bools) -> list[Part]:
    """A thing over an edge, a corner or a hole's edge, tried anew until it lies well."""
    lines = [dense(ring) for ring in rings]
    parts: list[Part] = []
    for attempt in range(14):
        which = int(rng.integers(len(lines))) if rng.random() < 0.35 else 0
        corner = rng.random() < 0.3
        index = int(rng.integers(len(lines[which])))
        if corner:
            spot = rings[which][rng.integers(len(rings[which]))]
            index = int(np.argmin(np.hypot(*(lines[which] - spot).T)))
        size = comb.shape[1] * np.exp(rng.uniform(np.log(0.06), np.log(0.3))) * (1 + 0.05 * attempt)
        body = builder(rng, size)
        spread = np.concatenate([points for part in body for points in part.shape])
        shift = rng.uniform(-0.3, 0.3, 2) * np.minimum(np.ptp(spread, axis=0), 1.5 * size)
        swing = rng.normal(0, 0.5) if rng.random() < 0.65 else rng.uniform(0, 2 * np.pi)
        angle = _outward(lines[which], index, comb) + swing
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        parts = _set_down(body, angle, lines[which][index] + turn @ shift)
        if _lies_well(parts, comb, lines):
            return parts
    return parts


def _outward(ring: Float64s, index: int, comb: Bools) -> float:
    """The way off the block at a point of a ring, radians."""
    ahead = ring[(index + 3) % len(ring)] - ring[index - 3]
    normal = np.array([ahead[1], -ahead[0]]) / max(1e-6, float(np.hypot(*ahead)))
    spot = np.clip(np.rint(ring[index] + 5 * normal), 0, np.array(comb.shape[::-1]) - 1).astype(int)
    return float(np.arctan2(*(-normal if comb[spot[1], spot[0]] else normal)[::-1]))


def _set_down(parts: Sequence[Part], angle: float, spot: Float64s) -> list[Part]:
    """Parts turned by radians and moved into the picture."""
    return [part.placed(angle, spot) for part in parts]


def _lies_well(parts: Sequence[Part], comb: Bools, rings: Sequence[Float64s]) -> bool:
    """Whether parts hide some but not most of the block, and a stretch of a ring."""
    mask = parts_mask(parts, (comb.shape[0], comb.shape[1]))
    small = comb[::4, ::4][: mask.shape[0], : mask.shape[1]]
    share = float((mask & small).sum()) / max(1, int(small.sum()))
    points = np.clip((np.concatenate(rings) / 4).astype(int), 0, np.array(mask.shape[::-1]) - 1)
    edge = int(mask[points[:, 1], points[:, 0]].sum())
    return 0.0015 < share < 0.3 and edge >= 4
