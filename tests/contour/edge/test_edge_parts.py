"""Changes of light around a ring."""

from __future__ import annotations

import numpy as np

from contour.edge.edge_parts import changes
from contour.geometry.arrays import with_sides


def test_changes_are_those_of_the_windows_about_each_place() -> None:
    light = np.random.default_rng(1).normal(100.0, 20.0, (3, 50))
    assert (changes(light, 13.0) == np.ptp(with_sides(light, 13.0), axis=2)).all()
