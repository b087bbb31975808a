"""Comb that an outline leaves out is seen, so are things and glare along it, and seams; nothing against a right one."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest

from contour.geometry.rings import Contour
from contour.segmentation.second_opinion import SecondOpinion, second_opinion
from contour.synthetic import Rendered, area_coverage, render
from tests.support.scenes.edge_scenes import HOLED, PLAIN
from tests.support.scenes.shop_floor_scenes import shop_floor_scene


def nowhere(points: np.ndarray) -> np.ndarray:
    return np.zeros(len(points), np.bool_)


def everywhere(points: np.ndarray) -> np.ndarray:
    return np.ones(len(points), np.bool_)


@cache
def scene_of(kind: str, seed: int) -> Rendered:
    return render(shop_floor_scene(kind, seed, alone=True).scene)


@pytest.mark.parametrize("kind", ["undisturbed", "mirror", "light_table", "dim", "motion", "splice", "crushed"])
def test_nothing_speaks_against_the_true_outline(kind: str) -> None:
    rendered = scene_of(kind, 95_100_001)
    assert second_opinion(rendered.picture, rendered.truth_px, rendered.pitch_px, nowhere) == SecondOpinion()


def test_compound_at_the_edge_is_no_comb_and_nothing_else_speaks_against_it() -> None:
    rendered = scene_of("compound", 95_100_001)
    picture, truth, pitch = rendered.picture, rendered.truth_px, rendered.pitch_px
    assert second_opinion(picture, truth, pitch, nowhere)._replace(bare=None) == SecondOpinion()
    assert second_opinion(picture, truth, pitch, nowhere, truth.rings) == SecondOpinion()


@pytest.mark.parametrize(("kind", "seed"), [("tape", 95_100_005), ("hand_or_cable", 95_100_006)])
def test_a_thing_over_the_edge_is_seen_with_its_place_unless_it_is_known(kind: str, seed: int) -> None:
    rendered = scene_of(kind, seed)
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    over = second_opinion(rendered.picture, rendered.truth_px, pitch, nowhere).over
    assert over is not None
    hidden = ring[rendered.visible[0] < 0.5]
    assert np.hypot(*(hidden - over.place_px).T).min() < pitch
    assert over.pitches > 1.0
    assert second_opinion(rendered.picture, rendered.truth_px, pitch, nowhere, [ring]).over is None


def test_glare_beside_the_edge_hides_it_and_a_table_at_full_scale_does_not() -> None:
    rendered = scene_of("undisturbed", 95_100_001)
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    lit = rendered.picture.copy()
    cv2.circle(lit, np.rint(ring[ring[:, 0].argmax()]).astype(int).tolist(), round(3.0 * pitch), (255, 255, 255), -1)
    over = second_opinion(lit, rendered.truth_px, pitch, nowhere).over
    assert over is not None
    assert over.pitches > 3.0
    block = cv2.fillPoly(np.zeros(lit.shape[:2], np.uint8), [np.rint(ring).astype(np.int32)], 1)
    white = lit.copy()
    white[block == 0] = 255
    assert second_opinion(white, rendered.truth_px, pitch, nowhere).over is None


@pytest.mark.parametrize("kind", ["undisturbed", "light_table"])
def test_what_an_outline_leaves_out_is_seen_with_its_place(kind: str) -> None:
    rendered = scene_of(kind, 95_100_001)
    ring = rendered.truth_px.exterior
    edge = ring[:, 0].max() - 2.0 * rendered.pitch_px
    cut = np.column_stack((np.minimum(ring[:, 0], edge), ring[:, 1]))
    found = second_opinion(rendered.picture, Contour(cut, rendered.truth_px.holes), rendered.pitch_px, nowhere).beyond
    assert found is not None
    assert found.pitches == pytest.approx(2.0, abs=0.5)
    assert found.place_px[0] > edge


def test_a_hole_that_was_drawn_too_large_leaves_comb_out() -> None:
    rendered = scene_of("undisturbed", 95_100_001)
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    middle = rendered.truth_px.exterior.mean(axis=0)
    hole = middle + 3.0 * rendered.pitch_px * np.column_stack((np.cos(turn), np.sin(turn)))
    found = second_opinion(
        rendered.picture, Contour(rendered.truth_px.exterior, (hole,)), rendered.pitch_px, nowhere
    ).beyond
    assert found is not None
    assert np.hypot(*(np.array(found.place_px) - middle)) < 2.0 * rendered.pitch_px


def test_pieces_that_are_known_to_be_none_of_the_blocks_do_not_count() -> None:
    rendered = scene_of("undisturbed", 95_100_001)
    ring = rendered.truth_px.exterior
    cut = Contour(np.column_stack((np.minimum(ring[:, 0], ring[:, 0].max() - 2.0 * rendered.pitch_px), ring[:, 1])))
    assert second_opinion(rendered.picture, cut, rendered.pitch_px, nowhere).beyond is not None
    assert second_opinion(rendered.picture, cut, rendered.pitch_px, everywhere).beyond is None


@pytest.mark.parametrize("kind", ["undisturbed", "light_table"])
def test_an_outline_across_a_notch_has_no_cells_within_unless_it_is_known_what_lies_there(kind: str) -> None:
    rendered = scene_of(kind, 95_100_001)
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    place, picture = ring[ring[:, 0].argmax()], rendered.picture.astype(np.float64)
    table = np.median(picture[:20]) + np.random.default_rng(1).normal(0.0, 2.0, picture.shape)
    low, high = np.rint(place - pitch * np.array([4.0, 1.6])).astype(int), round(place[1] + 1.6 * pitch)
    picture[low[1] : high, low[0] :] = table[low[1] : high, low[0] :]
    notched = picture.clip(0, 255).astype(np.uint8)
    bare = second_opinion(notched, rendered.truth_px, pitch, nowhere).bare
    assert bare is not None
    assert np.hypot(*(np.array(bare.place_px) - place)) < 1.5 * pitch
    assert second_opinion(notched, rendered.truth_px, pitch, nowhere, [ring]).bare is None


@pytest.mark.parametrize("kind", ["undisturbed", "light_table"])
def test_a_hole_that_was_not_traced_is_seen_and_what_is_of_another_light_than_the_table_is_none(kind: str) -> None:
    rendered = scene_of(kind, 95_100_001)
    picture, truth, pitch = rendered.picture, rendered.truth_px, rendered.pitch_px
    block = area_coverage(truth.rings, *picture.shape[1::-1]) > 0.5
    x, y = divmod(int(cv2.distanceTransform(block.astype(np.uint8), cv2.DIST_L2, 5).T.argmax()), picture.shape[0])
    light = np.median(picture[~block])
    for filled, told in ((light, True), (light + 120.0 if light < 128.0 else light - 120.0, False)):
        there = picture.copy()
        rough = np.random.default_rng(1).normal(filled, 3.0, picture.shape).clip(0, 255).astype(np.uint8)
        disc = cv2.circle(np.zeros(picture.shape, np.uint8), (x, y), round(2.0 * pitch), 1, -1) > 0
        there[disc] = rough[disc]
        hole = second_opinion(there, truth, pitch, nowhere).hole
        assert (hole is not None) == told
        if hole is not None:
            assert hole.pitches == pytest.approx(4.0, abs=1.0)
            assert np.hypot(*(np.array(hole.place_px) - (x, y))) < pitch


def test_a_slot_as_wide_as_a_cell_that_was_not_traced_is_seen_and_a_line_of_ink_is_none() -> None:
    rendered = scene_of("undisturbed", 95_100_001)
    picture, truth, pitch = rendered.picture, rendered.truth_px, rendered.pitch_px
    block = area_coverage(truth.rings, *picture.shape[1::-1]) > 0.5
    x, y = divmod(int(cv2.distanceTransform(block.astype(np.uint8), cv2.DIST_L2, 5).T.argmax()), picture.shape[0])
    level = float(np.median(picture[~block]))
    for wide, told in ((1.3, True), (0.4, False)):
        there = picture.copy()
        half_px = round(2.5 * pitch), round(0.5 * wide * pitch)
        slot = slice(y - half_px[1], y + half_px[1]), slice(x - half_px[0], x + half_px[0])
        there[slot] = np.random.default_rng(1).normal(level, 3.0, there[slot].shape).clip(0, 255)
        hole = second_opinion(there, truth, pitch, nowhere).hole
        assert (hole is not None) == told
        if hole is not None:
            assert hole.pitches == pytest.approx(5.0, abs=1.0)
            assert np.hypot(*(np.array(hole.place_px) - (x, y))) < pitch


@pytest.mark.parametrize("kind", ["undisturbed", "light_table"])
def test_a_corner_beyond_comb_is_seen_unless_it_is_known_what_lies_there(kind: str) -> None:
    rendered = scene_of(kind, 95_100_001)
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    number = int(ring[:, 0].argmax())
    ring = np.roll(ring, -number, axis=0)
    near = np.hypot(*(ring - ring[0]).T) < 1.2 * pitch
    tip = ring[0] + (1.0 * pitch, 0.0)
    pointed = Contour(np.vstack([tip, ring[~near]]))
    corner = second_opinion(rendered.picture, pointed, pitch, nowhere).corner
    assert corner is not None
    assert corner.pitches == pytest.approx(1.0, abs=0.4)
    assert np.hypot(*(np.array(corner.place_px) - tip)) < 0.7 * pitch
    assert second_opinion(rendered.picture, pointed, pitch, nowhere, [pointed.exterior]).corner is None


@pytest.mark.parametrize("apart", [0.0, 0.3])
def test_a_seam_between_two_blocks_is_seen_with_its_place(apart: float) -> None:
    rendered = scene_of("undisturbed", 95_100_001)
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    middle = round(float(ring[:, 0].mean()))
    both = rendered.picture.copy()
    down, right = round(0.4 * pitch), round((2.4 + apart) * pitch)
    both[down:, middle:] = np.roll(rendered.picture, right, axis=1)[:-down, middle:]
    both[:, middle : middle + round(apart * pitch)] = 0
    beyond = ring[:, 0] > middle
    outline = Contour(ring + np.where(beyond[:, None], [right, down], 0))
    seam = second_opinion(both, outline, pitch, nowhere).seam
    assert seam is not None
    assert seam.place_px[0] == pytest.approx(middle, abs=pitch)
    assert seam.pitches > 5.0


@pytest.mark.parametrize("table", [0.6, 1.0, 1.5])
def test_a_weight_about_as_light_as_the_table_is_told_from_a_hole(table: float) -> None:
    """With a bevel, a knob, and a shadow on the cells beside it, where a hole shows stumps of walls."""
    holed, plain = render(HOLED), render(PLAIN)
    (hole,), pitch = holed.truth_px.holes, holed.pitch_px
    assert second_opinion(holed.picture, holed.truth_px, pitch, nowhere).laid is None
    level = table * float(np.median(holed.picture[:40]))
    middle = hole.mean(axis=0)
    radius = float(np.hypot(*(hole - middle).T).mean())
    shade = np.zeros(plain.picture.shape[:2], np.float32)
    cv2.circle(shade, np.rint(middle + 0.4 * pitch).astype(int).tolist(), round(radius), 0.6, -1)
    picture = np.asarray(plain.picture * (1.0 - cv2.GaussianBlur(shade, (0, 0), 0.25 * pitch))[..., None], np.uint8)
    for share, light in ((1.0, level), (0.92, 1.35 * level), (0.82, level), (0.4, 0.6 * level), (0.36, 1.1 * level)):
        at = np.rint(16.0 * middle).astype(int).tolist()
        cv2.circle(picture, at, round(16.0 * share * radius), (light, light, light), -1, cv2.LINE_AA, 4)
    laid = second_opinion(picture, holed.truth_px, pitch, nowhere).laid
    assert laid is not None
    assert np.hypot(*(middle - laid.place_px)) < pitch
    assert laid.pitches == pytest.approx(2.0 * radius / pitch, rel=0.1)
