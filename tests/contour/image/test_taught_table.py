"""A block is told from the table as it was taught, whatever its pattern; a change of light or camera is noticed."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.acceptance.findings import Refusal
from contour.acceptance.picture_findings import judge_table
from contour.errors import CalibrationError, PictureError
from contour.geometry.rings import Contour, hausdorff
from contour.image.taught_table import TableLimits, TaughtTable, look_at, teach
from contour.synthetic import area_coverage
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.pictures.grid_tables import grid_table, with_block
from tests.support.pictures.small_scenes import block

LIMITS = TableLimits()


@pytest.fixture(scope="module")
def table() -> TaughtTable:
    return teach([grid_table(seed) for seed in range(6)])


def test_several_pictures_are_averaged_and_their_noise_is_known(table: TaughtTable) -> None:
    assert table.noise == pytest.approx(1.5, rel=0.2)
    quiet = np.abs(table.picture.astype(float) - np.mean([grid_table(seed) for seed in range(6)], axis=0))
    assert quiet.max() <= 0.5


def test_an_empty_table_looks_as_taught(table: TaughtTable) -> None:
    look = look_at(grid_table(77), table)
    assert judge_table(look, LIMITS) == ()
    assert look.changed_share < 0.02
    assert look.gain == pytest.approx(1.0, abs=0.02)
    assert look.shift_px == pytest.approx(0.0, abs=0.2)
    assert look.picture.std() < 0.5 * table.picture.std()


def test_a_block_on_a_grid_is_traced_where_the_grid_is_known(table: TaughtTable) -> None:
    picture = with_block(grid_table(78))
    look = look_at(picture, table)
    assert judge_table(look, LIMITS) == ()
    truth = block("rectangle").truth_px.exterior
    found = trace(look.picture, TraceSettings()).contour.exterior
    assert hausdorff(found, truth, 1.0) < 3.0


def test_brighter_light_is_followed_and_its_pattern_goes_as_well(table: TaughtTable) -> None:
    look = look_at(grid_table(79, light=1.3), table)
    assert look.gain == pytest.approx(1.3, rel=0.03)
    assert judge_table(look, LIMITS) == ()
    assert look.changed_share < 0.05


@pytest.mark.parametrize(("light", "words"), [(0.4, "light is 41 %"), (1.75, "light is 17")])
def test_other_light_than_taught_is_refused_with_its_measure(table: TaughtTable, light: float, words: str) -> None:
    (finding,) = judge_table(look_at(grid_table(80, light=light), table), LIMITS)
    assert finding.refusal == Refusal.IMAGE_QUALITY
    assert words in finding.text
    assert "60 to 160 %" in finding.text


def test_a_small_shift_of_the_camera_is_followed(table: TaughtTable) -> None:
    look = look_at(grid_table(81, shift=(1.4, -0.8)), table)
    assert look.shift_px == pytest.approx(np.hypot(1.4, 0.8), abs=0.25)
    assert judge_table(look, LIMITS) == ()
    assert look.changed_share < 0.1


def test_a_bumped_camera_is_told_in_pixels(table: TaughtTable) -> None:
    (finding,) = judge_table(look_at(grid_table(82, shift=(6.0, 3.0)), table), LIMITS)
    assert finding.refusal == Refusal.SCENE_MOVED
    told = float(finding.text.split("moved by ")[1].split()[0])
    assert told == pytest.approx(np.hypot(6, 3), abs=0.3)


def test_another_table_is_refused(table: TaughtTable) -> None:
    other = np.clip(np.random.default_rng(1).normal(150, 25, (480, 640)), 0, 255).astype(np.uint8)
    other[:, ::2] = 20
    assert judge_table(look_at(other, table), LIMITS) != ()


def test_in_colour_a_change_of_colour_alone_is_a_change() -> None:
    grey = np.stack([grid_table(seed) for seed in range(3)], axis=-1)
    table = teach([grey])
    picture = grey.copy()
    picture[100:300, 200:400, 0] = np.minimum(picture[100:300, 200:400, 0].astype(int) + 60, 255)
    picture[100:300, 200:400, 2] = np.maximum(picture[100:300, 200:400, 2].astype(int) - 50, 0)
    assert 0.1 < look_at(picture, table).changed_share < 0.25


@pytest.mark.parametrize("picture", [np.zeros((480, 641), np.uint8), np.zeros((480, 640, 3), np.uint8)])
def test_a_picture_of_another_kind_does_not_fit(table: TaughtTable, picture: np.ndarray) -> None:
    with pytest.raises(CalibrationError, match="teach the table again"):
        look_at(picture, table)


def test_a_hand_that_moves_while_teaching_is_noticed() -> None:
    moved = grid_table(3)
    cv2.circle(moved, (300, 200), 40, 200, -1)
    with pytest.raises(PictureError, match="changed by"):
        teach([grid_table(1), grid_table(2), moved])
    with pytest.raises(PictureError, match="no picture"):
        teach([])
    with pytest.raises(PictureError, match="640 x 400 px grey, 640 x 480 px grey; expected one size"):
        teach([grid_table(1), grid_table(2)[:400]])


@pytest.mark.parametrize("light", [0.5, 0.85, 1.15])
def test_light_that_changes_while_teaching_is_noticed_and_no_noise(light: float) -> None:
    with pytest.raises(PictureError, match="let the light settle"):
        teach([grid_table(1), grid_table(2, light=light)])


def test_holes_of_the_block_stay_holes(table: TaughtTable) -> None:
    rendered = block("holed")
    cover = area_coverage(rendered.truth_px.rings, 640, 480)
    picture = np.rint(grid_table(83) * (1 - cover) + rendered.picture * cover).astype(np.uint8)
    found: Contour = trace(look_at(picture, table).picture, TraceSettings()).contour
    assert hausdorff(found.exterior, rendered.truth_px.exterior, 1.0) < 4.0
