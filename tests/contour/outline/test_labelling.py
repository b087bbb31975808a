"""The cheapest way around a ring: where an open one closes, nothing cheaper does, and no second is looked for."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from contour.geometry.arrays import Float64s, Indices
from contour.outline import labelling

COUNT, STATES = 6, 3


def ring(seed: int) -> tuple[Float64s, Float64s]:
    """Prices of steps (N, A, A), none for staying with a model, with those of being there, and these (N, A)."""
    rng = np.random.default_rng(seed)
    there = rng.uniform(0.0, 3.0, (COUNT, STATES))
    models = rng.permuted(np.tile(np.arange(STATES), (COUNT, 1)), axis=1)
    same = models[:, :, None] == np.roll(models, -1, axis=0)[:, None, :]
    changes = np.where(same, 0.0, rng.uniform(0.5, 2.0, same.shape))
    return changes + np.roll(there, -1, axis=0)[:, None, :], there


def price(step: Float64s, path: tuple[int, ...]) -> float:
    return float(sum(step[k, state, path[(k + 1) % COUNT]] for k, state in enumerate(path)))


def test_a_path_that_closes_is_the_cheapest_and_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[int | None] = []
    cheapest_path = labelling._cheapest_path

    def counted(step: Float64s, initial: Float64s, closing: int | None) -> Indices:
        looks.append(closing)
        return cheapest_path(step, initial, closing)

    monkeypatch.setattr(labelling, "_cheapest_path", counted)
    once = 0
    for seed in range(20):
        step, there = ring(seed)
        looks.clear()
        found = tuple(labelling._cheapest_cycle(step.copy(), there).tolist())
        if looks == [None]:
            once += 1
            cheapest = min(price(step, path) for path in product(range(STATES), repeat=COUNT))
            assert price(step, found) == pytest.approx(cheapest)
    assert once > 5
