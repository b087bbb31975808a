"""Parts drawn at random, as large as to lie well, barely, or not at all in a block."""

from __future__ import annotations

import numpy as np

from contour.geometry.rings import Contour, area
from contour.synthetic import blob, convex, crescent, disc_ring, l_shape, moved, rectangle, u_shape, with_holes

_ORIGIN = (0.0, 0.0)


def random_part(block: Contour, seed: int) -> Contour:
    """A part of 8 to 50 % of the block's area, drawn anywhere near its own origin."""
    rng = np.random.default_rng([seed, 41])
    kind = int(rng.integers(0, 7))
    long, short = 100.0, float(rng.uniform(40.0, 100.0))
    shape = (
        lambda: rectangle(_ORIGIN, long, short),
        lambda: l_shape(_ORIGIN, long, short, 0.45 * short),
        lambda: u_shape(_ORIGIN, long, short, 25.0, 0.4 * short),
        lambda: convex(_ORIGIN, 50.0, seed),
        lambda: blob(_ORIGIN, 40.0, seed),
        lambda: crescent(_ORIGIN, 50.0, 40.0, 30.0),
        lambda: with_holes(rectangle(_ORIGIN, long, max(short, 60.0)), disc_ring((10.0, 5.0), 20.0)),
    )[kind]()
    factor = float(np.sqrt(rng.uniform(0.08, 0.5) * area(block) / area(shape)))
    scaled = Contour(shape.exterior * factor, tuple(hole * factor for hole in shape.holes))
    x, y, turn = rng.uniform([-200.0, -200.0, -180.0], [200.0, 200.0, 180.0]).tolist()
    return moved(scaled, (x, y), turn)
