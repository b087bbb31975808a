"""What a picture says of a trace, in the pixels that the trace is in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.acceptance.bare_edge import comb_at_edge
from contour.acceptance.disagreement import disagreement
from contour.acceptance.quality import block_quality
from contour.acceptance.trace_check import check_trace
from contour.geometry.rectifier import CroppedRectifier
from contour.geometry.rings import Contour
from contour.synthetic import render
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.tracing import trace
from contour.walls.see_block import Source
from tests.support.pictures.small_scenes import block
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import calibration_for, measured


class Magnifier:
    """A plane twice as large as the picture."""

    def rectify(self, points_px: np.ndarray) -> np.ndarray:
        return 2.0 * points_px

    def unrectify(self, points: np.ndarray) -> np.ndarray:
        return 0.5 * points


def test_a_trace_is_checked_by_quality_and_disagreement_of_its_own_picture() -> None:
    picture = block("rectangle").picture
    traced = trace(picture, TraceSettings())
    checked = check_trace(picture, traced, None)
    assert checked.trace is traced
    assert checked.quality == block_quality(picture, picture, traced.contour, traced.pitch_px)
    assert traced.pitch_px is not None
    assert checked.disagreement == disagreement(picture, traced.contour, traced.pitch_px)


def test_without_a_pitch_there_is_no_second_account() -> None:
    picture = block("rectangle").picture
    checked = check_trace(picture, replace(trace(picture, TraceSettings()), pitch_px=None), None)
    assert checked.quality is not None
    assert checked.disagreement is None


def with_a_chip(contour: Contour) -> Contour:
    """The contour with a square of two cells on its longest edge."""
    ring = contour.exterior
    long = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).argmax()
    begin, end = ring[long], ring[(long + 1) % len(ring)]
    along = (end - begin) / np.hypot(*(end - begin))
    out = np.array([-along[1], along[0]])
    out = out if out @ (begin - ring.mean(axis=0)) > 0 else -out
    middle = 0.5 * (begin + end)
    chip = [middle - 20 * along, middle - 20 * along + 40 * out, middle + 20 * along + 40 * out, middle + 20 * along]
    return Contour(np.insert(ring, long + 1, chip, axis=0))


def test_a_narrow_bump_of_a_cut_edge_is_told_and_moves_with_the_trace() -> None:
    picture = block("rectangle").picture
    traced = trace(picture, TraceSettings())
    assert check_trace(picture, traced, None).narrow is None
    chipped = replace(traced, contour=with_a_chip(traced.contour))
    checked = check_trace(picture, chipped, None)
    assert checked.narrow is not None
    assert checked.narrow.outwards
    moved = checked.moved(np.array([30.0, 20.0]))
    assert moved.narrow == checked.narrow.moved(30.0, 20.0)
    closed_cells = check_trace(picture, replace(chipped, evidence=None), None)
    assert closed_cells.narrow is None


def test_moved_moves_the_contour_and_the_place_of_disagreement() -> None:
    picture = block("rectangle").picture
    checked = check_trace(picture, trace(picture, TraceSettings()), None)
    moved = checked.moved(np.array([30.0, 20.0]))
    assert checked.disagreement is not None
    assert moved.disagreement is not None
    assert np.allclose(np.subtract(moved.disagreement.place_px, checked.disagreement.place_px), [30, 20])
    assert np.array_equal(moved.trace.contour.exterior, checked.trace.contour.exterior + np.array([30.0, 20.0]))
    assert moved.quality == checked.quality


def test_a_cropped_rectifier_counts_pixels_from_the_parts_first_one() -> None:
    points = np.array([[3.0, 4.0], [5.5, 6.0]])
    part = CroppedRectifier(Magnifier(), np.array([10.0, 20.0]))
    assert part.rectify(points).tolist() == [[26.0, 48.0], [31.0, 52.0]]
    assert part.unrectify(part.rectify(points)).tolist() == points.tolist()


def test_a_table_at_full_scale_beside_dark_walls_is_no_overexposed_block() -> None:
    picture = block("rectangle", "dark").picture
    traced = trace(picture, TraceSettings())
    bright = np.where(picture > np.quantile(picture, 0.2), np.uint8(255), picture)
    assert traced.polarity == "dark"
    assert block_quality(bright, bright, traced.contour, traced.pitch_px).clipped_share > 0.2
    checked = check_trace(bright, traced, None)
    assert checked.quality is not None
    assert checked.quality.clipped_share == 0.0


def mirrored(strength: float, *, fading_px: float = 12.0, rim: float = 1.0) -> tuple[np.ndarray, Contour]:
    """A grid for cells of 16 px with thick walls each way, on a table that mirrors it; its outline, 4 px off each.

    rim: how light its last walls are on the left, above, of what they are elsewhere.
    """
    lines = np.arange(480) % 16 < 3
    picture = np.where(lines | lines[:, None], 200, 60).astype(float)
    rng = np.random.default_rng(3)
    picture *= np.kron(rng.uniform(0.6, 1.0, (30, 30)), np.ones((16, 16)))
    picture[120:280, 104:120] = 60 + rim * (picture[120:280, 104:120] - 60)
    rows = np.abs(np.arange(480) - 240.0)
    image = np.arange(480)
    image = np.where(rows > 136, np.where(image > 240, 2 * 376 - image, 2 * 104 - image), image)
    away = np.maximum(rows[:, None], rows) - 136.0
    shown = 20.0 + strength * np.exp(-np.maximum(away, 0.0) / fading_px) * (picture[image][:, image] - 20.0)
    outline = np.array([[103.5, 103.5], [103.5, 376.5], [376.5, 376.5], [376.5, 103.5]])
    return np.rint(np.where(away > 0.0, shown, picture)).astype(np.uint8), Contour(outline)


def test_what_a_table_mirrors_beyond_the_edge_is_no_comb_that_goes_on() -> None:
    for strength, goes_on in ((0.7, False), (2.0, True)):
        picture, outline = mirrored(strength)
        traced = Trace("wall-tips", "bright", 16.0, outline, picture, evidence=())
        assert comb_at_edge(traced, 16.0)[1] is not None
        assert (check_trace(picture, traced, None).beyond is not None) == goes_on


def test_what_it_mirrors_is_not_left_out_and_faint_walls_within_have_alike_ones_beyond() -> None:
    picture, outline = mirrored(0.7, fading_px=100.0)
    traced = Trace("wall-tips", "bright", 16.0, outline, picture, evidence=())
    apart, checked = disagreement(picture, outline, 16.0), check_trace(picture, traced, None).disagreement
    assert not apart.claimed
    assert apart.pitches > 2.0
    assert checked == replace(apart, pitches=0.0)
    picture, outline = mirrored(0.7, fading_px=100.0, rim=0.4)
    traced = Trace("wall-tips", "bright", 16.0, outline, picture, evidence=())
    assert comb_at_edge(traced, 16.0)[0] is not None
    assert check_trace(picture, traced, None).bare is None


def test_no_border_of_a_mirrored_block_goes_on_past_its_corner() -> None:
    rendered = render(shop_floor_scene("mirror", 1059110).scene)
    rectifier = calibration_for(rendered.camera).rectifier(rendered.thickness_mm)
    traced = trace(rendered.picture, TraceSettings(), rectifier=rectifier)
    assert check_trace(rendered.picture, traced, rectifier).runs_on is None


def test_a_sheet_whose_border_runs_on_is_told_beside_closed_cells_too_and_where_its_colour_alone_differs() -> None:
    picture = np.full((300, 400, 3), 60, np.uint8)
    picture[:150, :, 0] += 6  # a sheet that is hardly bluer, over all that lies above
    picture[151:251, 120:281] = 150
    outline = Contour(np.array([[119.5, 150.5], [119.5, 250.5], [280.5, 250.5], [280.5, 150.5]]))
    light = np.asarray(picture[:, :, 2].copy())
    for edge, evidence in (("cells", None), ("cut", ())):
        traced = Trace("wall-tips", "bright", 16.0, outline, light, evidence=evidence, edge=edge)
        assert check_trace(picture, traced, None).runs_on is not None


def test_of_comb_that_was_drawn_the_picture_that_was_taken_tells_whose_border_runs_on() -> None:
    taken = np.full((300, 400), 60, np.uint8)
    taken[:150] += 12
    taken[151:251, 120:281] = 150
    drawn = np.where(taken == 150, 150, 12).astype(np.uint8)
    outline = Contour(np.array([[119.5, 150.5], [119.5, 250.5], [280.5, 250.5], [280.5, 150.5]]))
    traced = Trace("wall-tips", "bright", 16.0, outline, drawn, evidence=(), edge="cut")
    assert check_trace(drawn, traced, None).runs_on is None
    assert check_trace(drawn, traced, None, source=Source(taken, None)).runs_on is not None


def test_dark_grooves_of_a_table_that_lead_to_the_block_are_not_left_out_of_it() -> None:
    """Slots whose sides are as busy as comb, two cells apart, and which no edge ends along."""
    assert measured(render(shop_floor_scene("slots", 1_830_036, alone=True).scene)).reasons == ()
