"""Pictures of a block on a table, with or without things over it, and what is true of them."""

from __future__ import annotations

import numpy as np

from benchmarks.other_hand.fields import Rng
from benchmarks.sixth_hand.camera import shoot
from benchmarks.sixth_hand.plans import PLANS, Plan
from benchmarks.sixth_hand.stage import Stage, raise_block, set_stage
from benchmarks.sixth_hand.things import put_beside, put_over
from benchmarks.third_hand.scene import Scene

KINDS: tuple[str, ...] = tuple(PLANS)


def scene(kind: str, seed: int) -> Scene:
    """A scene of one of `KINDS`, the same for the same seed; ValueError for a kind that is none."""
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is no kind: expected one of {', '.join(KINDS)}")
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    plan = PLANS[kind]
    stage = _built(plan, rng)
    while plan.over and not stage.hidden.any():
        stage = _built(plan, rng)
    picture = shoot(stage.picture, plan.lens, rng)
    comb = stage.solid > 0.5
    walls = comb & (stage.cells.tops > 0.4) & ~stage.hidden
    return Scene(picture, tuple(stage.rings), stage.pitch, stage.hidden, walls, comb)


def _built(plan: Plan, rng: Rng) -> Stage:
    """A stage with all that a plan asks for, from the table up."""
    stage = set_stage(plan.wish, rng)
    for thing in plan.beside:
        put_beside(stage, thing, rng)
    raise_block(stage, plan.wish, rng)
    for thing in plan.over:
        put_over(stage, thing, rng)
    return stage
