"""What is drawn over a frame lies where calibration and contour say."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from contour.geometry.rings import Contour
from contour.placement.place import Placement
from contour.placement.pose import Pose
from contour.ribbon.ribbon import Ribbon
from service.measuring.calibration_file import load_record
from service.parts.core_ribbon import CoreRibbon
from service.parts.fit import PartFit, in_picture
from service.parts.part import Part
from service.records.archived_job import ArchivedJob
from service.records.evidence import EvidenceError
from service.web.drawing import drawing, nice_step
from service.web.models import Drawing, Grid

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
RECORD = load_record(SAMPLES / "calibration.yaml")
WIDTH, HEIGHT = RECORD.calibration.image_width, RECORD.calibration.image_height
SQUARE_MM = np.array([[100.0, 100.0], [300.0, 100.0], [300.0, 250.0], [100.0, 250.0]])
THICKNESS_MM = 20.0


def archived(**changes: Any) -> ArchivedJob:
    pixels = RECORD.calibration.to_pixels(SQUARE_MM, THICKNESS_MM)
    document: dict[str, Any] = {
        "job": {"outcome": "accepted"},
        "frame": {"shape": [HEIGHT, WIDTH, 3]},
        "thickness_mm": THICKNESS_MM,
        "calibration": {"content": yaml.safe_load((SAMPLES / "calibration.yaml").read_text())},
        "measurement": {
            "uncertainty_mm": 2.0,
            "pixels": {"exterior": pixels.tolist(), "holes": []},
            "millimetres": {"exterior": SQUARE_MM.tolist(), "holes": []},
        },
    }
    return ArchivedJob(7, Path("7-accepted.json"), {**document, **changes})


def laid() -> PartFit:
    """A part of 20 mm in the square's lower left corner, 5 mm from its edges."""
    corner = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]])
    part, pose = Part(Path("part.dxf"), Contour(corner), "mm"), Pose(105.0, 105.0, 0.0)
    placement = Placement(pose, 5.0, ((105.0, 105.0), (100.0, 105.0)))
    fit = PartFit(part, placement, pose.placed(part.contour), asked_mm=3.0, bound_mm=1.0)
    return in_picture(fit, RECORD.calibration, THICKNESS_MM)


def test_the_part_is_drawn_where_it_lies_with_what_it_needs() -> None:
    assert drawing(archived()).part is None
    document = archived().document["measurement"]
    shown = drawing(archived(measurement={**document, "part": json.loads(json.dumps(laid().kept()))})).part
    assert shown is not None
    back = RECORD.calibration.to_work(np.array(shown.exterior), THICKNESS_MM)
    assert np.abs(RECORD.calibration.to_machine(back).min(axis=0) - 105.0).max() < 0.02
    assert np.abs(RECORD.calibration.to_machine(back).max(axis=0) - 125.0).max() < 0.02
    ends = RECORD.calibration.to_machine(RECORD.calibration.to_work(np.array(shown.tightest), THICKNESS_MM))
    assert np.abs(ends - [[105.0, 105.0], [100.0, 105.0]]).max() < 0.02
    assert (shown.fits, shown.margin_mm, shown.asked_mm, shown.needed_mm) == (True, 5.0, 3.0, 4.005)
    length_px = math.dist(*shown.tightest)
    assert shown.px_per_mm == pytest.approx(length_px / 5.0, rel=0.02)


def test_a_line_lies_along_the_ribbon_that_was_read() -> None:
    assert drawing(archived()).ribbon == []
    document = archived().document["measurement"]
    kept = CoreRibbon(Ribbon(30.0, 0.5, "walls"), ((10.0, 20.0), (30.5, 40.0))).kept()
    shown = drawing(archived(measurement={**document, "ribbon": json.loads(json.dumps(kept))}))
    assert shown.ribbon == [(10.0, 20.0), (30.5, 40.0)]


def interpolated(shown: Drawing, grid: Grid, x: float, y: float) -> tuple[float, float]:
    """As static/picture.js does it."""
    nodes = np.array(grid.millimetres).reshape(grid.rows, grid.columns, 2)
    column, row = (x + 0.5) / shown.width * (grid.columns - 1), (y + 0.5) / shown.height * (grid.rows - 1)
    left, top = min(int(column), grid.columns - 2), min(int(row), grid.rows - 2)
    across, down = column - left, row - top
    upper = (1 - across) * nodes[top, left] + across * nodes[top, left + 1]
    lower = (1 - across) * nodes[top + 1, left] + across * nodes[top + 1, left + 1]
    found = (1 - down) * upper + down * lower
    return float(found[0]), float(found[1])


def test_between_its_nodes_the_grid_is_true_to_a_twentieth_of_a_millimetre() -> None:
    shown = drawing(archived())
    assert shown.grid is not None
    places = np.random.default_rng(5).uniform([0, 0], [WIDTH - 1, HEIGHT - 1], (400, 2))
    true = RECORD.calibration.to_machine(RECORD.calibration.to_work(places, THICKNESS_MM))
    seen = np.array([interpolated(shown, shown.grid, x, y) for x, y in places])
    assert np.abs(seen - true).max() < 0.05


def test_each_axis_lies_on_its_millimetres() -> None:
    shown = drawing(archived())
    assert {axis.axis for axis in shown.axes} == {"x", "y"}
    for axis in shown.axes:
        found = RECORD.calibration.to_machine(RECORD.calibration.to_work(np.array(axis.points), THICKNESS_MM))
        assert np.abs(found[:, 0 if axis.axis == "x" else 1] - axis.mm).max() < 0.05


def test_size_and_band_are_the_contours() -> None:
    shown = drawing(archived())
    assert shown.size_mm == (200, 150)
    pixels = RECORD.calibration.to_pixels(SQUARE_MM, THICKNESS_MM)
    px_per_mm = math.dist(pixels[0], pixels[1]) / 200
    assert shown.band_px == pytest.approx(2 * px_per_mm, rel=0.02)


def test_hidden_parts_are_lines_along_the_contour_in_pixels() -> None:
    document = archived().document["measurement"]
    corners = np.array(document["pixels"]["exterior"])
    half, side = (math.dist(corners[0], corners[1]) * share for share in (0.5, 1.0))
    common = {"ring": 0, "by": "object", "bound_px": 1.0, "from_mm": None, "to_mm": None, "bound_mm": None}
    evidence = [
        {**common, "from_px": 0.0, "to_px": half, "state": "seen"},
        {**common, "from_px": half, "to_px": side + 10.0, "state": "covered"},
        {**common, "from_px": side + 10.0, "to_px": side + 20.0, "state": "bridged"},
    ]
    covered, bridged = drawing(archived(measurement={**document, "evidence": evidence})).hidden
    assert (covered.covered, bridged.covered) == (True, False)
    along = (corners[2] - corners[1]) / math.dist(corners[1], corners[2])
    ends = [corners[:2].mean(axis=0), corners[1], corners[1] + 10 * along, corners[1] + 20 * along]
    assert np.array([*covered.points, bridged.points[1]]) == pytest.approx(np.array(ends), abs=0.01)
    assert bridged.points[0] == covered.points[-1]


def test_a_document_that_says_nothing_of_hidden_parts_has_none() -> None:
    assert drawing(archived()).hidden == []


def test_without_calibration_or_contour_the_frame_is_shown_alone() -> None:
    shown = drawing(archived(calibration=None, measurement=None, job={"outcome": "refused"}))
    assert (shown.grid, shown.axes, shown.exterior, shown.band_px, shown.size_mm, shown.refused) == (
        None,
        [],
        [],
        None,
        None,
        True,
    )


def test_another_pictures_calibration_draws_no_millimetres() -> None:
    assert drawing(archived(frame={"shape": [100, 100]})).grid is None


def test_without_a_frame_there_is_nothing_to_draw_on() -> None:
    with pytest.raises(EvidenceError, match="no frame was archived"):
        drawing(archived(frame=None))


@pytest.mark.parametrize(("least", "step"), [(0.7, 1), (1, 1), (1.2, 2), (23, 50), (51, 100), (0.03, 0.05)])
def test_steps_are_round(least: float, step: float) -> None:
    assert nice_step(least) == pytest.approx(step)
