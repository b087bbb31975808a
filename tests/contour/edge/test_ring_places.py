"""Places along a ring, runs around it, and turns of a path."""

from __future__ import annotations

import numpy as np

from contour.edge.ring_places import places_along, runs_of, turns_deg
from contour.geometry.signed_distance import nearest
from tests.support.pictures.rings import SQUARE


class Bent:
    """A plane whose straight lines are curves in the picture."""

    def rectify(self, points_px: np.ndarray) -> np.ndarray:
        return np.column_stack([points_px[:, 0], points_px[:, 1] + 0.01 * points_px[:, 0] ** 2])

    def unrectify(self, points: np.ndarray) -> np.ndarray:
        return np.column_stack([points[:, 0], points[:, 1] - 0.01 * points[:, 0] ** 2])


def test_places_hold_all_vertices_and_are_no_farther_apart_than_asked() -> None:
    ring = SQUARE * 10.0
    places = places_along(ring, 0.3, None)
    around = np.vstack([places.points, places.points[:1]])
    steps = np.hypot(*np.diff(around, axis=0).T)
    assert steps.max() <= 0.3 + 1e-9
    assert nearest(ring, places.points).max() < 1e-9
    assert np.allclose(np.diff(np.append(places.at, places.whole)), steps)
    assert places.whole == np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).sum()


def test_with_a_lens_they_lie_on_its_curves_and_their_lengths_on_the_chords() -> None:
    ring = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    places = places_along(ring, 1.0, Bent())
    middle = places.points[np.argmin(np.abs(places.at - 5.0))]
    assert np.allclose(middle, [5.0, 0.25])
    assert places.whole == 40.0


def test_runs_go_on_across_the_rings_first_place() -> None:
    chosen = np.array([True, True, False, True, False, False, True])
    assert [run.tolist() for run in runs_of(chosen)] == [[3], [6, 0, 1]]
    assert runs_of(np.zeros(4, bool)) == []
    assert [run.tolist() for run in runs_of(np.ones(3, bool))] == [[0, 1, 2]]


def test_a_path_turns_by_degrees_with_their_sign() -> None:
    path = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0]])
    assert np.allclose(turns_deg(path), [0.0, 90.0, 90.0, -90.0])
    assert len(turns_deg(path[:2])) == 0
