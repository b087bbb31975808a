"""What is compared with the truth, and the truth files that others wrote."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from contour.geometry.agreement import distances_to
from contour.geometry.rings import Contour
from service.judging.judgement import outline_px, summary
from service.judging.truth_file import EDGES, read_truth
from service.measuring.measurement import Measurement
from tests.support.scenes.photographs import photographs

SQUARE = Contour(np.array([[0.0, 0.0], [0.0, 100.0], [100.0, 100.0], [100.0, 0.0]]))


class Bent:
    """A lens that bends rows: 4 px down at x = 50, none at 0 and 100."""

    def rectify(self, points_px):
        return points_px + self._bend(points_px) * [0.0, 1.0]

    def unrectify(self, points):
        return points - self._bend(points) * [0.0, 1.0]

    def _bend(self, points):
        return (points[:, :1] * (100.0 - points[:, :1])) * 4.0 / 2500.0


def test_edges_that_are_straight_in_millimetres_are_compared_as_the_lens_bends_them() -> None:
    calibration = SimpleNamespace(rectifier=lambda _thickness_mm: Bent())
    calibrated = SimpleNamespace(guard=SimpleNamespace(record=SimpleNamespace(calibration=calibration)))
    found = outline_px(Measurement("wall-tips", pixels=SQUARE), calibrated, 20.0)
    assert found is not None
    assert distances_to(np.array([[50.0, -4.0], [50.0, 96.0]]), found) == pytest.approx([0.0, 0.0], abs=0.05)
    assert outline_px(Measurement("wall-tips", pixels=SQUARE), SimpleNamespace(guard=None), 20.0) is SQUARE


def test_of_no_picture_that_was_accepted_no_figure_is_told() -> None:
    told = summary([])
    assert (told["iou_mean"], told["iou_worst"], told["mean_px"]) == (None, None, None)
    assert (told["pictures"], told["bounds_stated"]) == (0, 0)


def test_truths_drawn_by_others_are_read_whatever_picture_they_name() -> None:
    _, folder = photographs()
    truths = [read_truth(path) for path in sorted(folder.glob("*.json"))]
    if not truths:
        pytest.skip(f"no truth in {folder}; COMBTRACE_PHOTOS names another folder")
    assert all(truth.edge in EDGES for truth in truths)
