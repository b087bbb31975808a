"""A picture becomes the polygon that would be sent: stages timed, findings by code, nothing thrown at the daemon."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contour.acceptance import trace_check
from contour.acceptance.trace_check import CheckedTrace
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.edge.stretches import Stretch
from contour.errors import ParameterError, PictureError
from contour.geometry.rings import Contour, area, farthest, hausdorff, perimeter
from contour.segmentation import comb_picture
from contour.segmentation.network import comb_and_covers
from contour.synthetic import render
from contour.tracing import tracing
from contour.tracing.trace import Trace, TraceSettings
from contour.walls.see_block import Outline, Source
from service.config.plain_recipe import PlainRecipe
from service.config.recipes import Recipe
from service.measuring import measure
from service.measuring.calibration_file import load_record
from service.measuring.measure import Measurer, trace_settings
from service.reasons import Reason
from tests.support.pictures.small_scenes import block
from tests.support.scenes.edge_scenes import HOLED
from tests.support.scenes.sample_scenes import THICKNESS_MM, sample_scenes
from tests.support.scenes.shop_floor.blocks import shop_floor_block
from tests.support.scenes.shop_floor.covers import clamp, hand_or_cable, tape
from tests.support.scenes.shop_floor.light import Drawn, structured
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import measured

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
RECIPE = Recipe(number=1, name="default")


@pytest.fixture(scope="module")
def rendered():
    return render(sample_scenes()[0])


@pytest.fixture(scope="module")
def measurer() -> Measurer:
    return Measurer(load_record(SAMPLES / "calibration.yaml").calibration)


def test_the_shipped_calibration_is_that_of_the_camera_that_rendered_the_samples(rendered, measurer: Measurer) -> None:
    """The rendered outline in pixels, taken through the calibration file, is the outline in millimetres."""
    calibration = load_record(SAMPLES / "calibration.yaml").calibration
    back = calibration.to_machine(calibration.to_work(rendered.truth_px.exterior, THICKNESS_MM))
    assert hausdorff(back, rendered.truth_mm.exterior, 1.0) < 0.001


def test_the_contour_in_millimetres_lies_near_the_true_outline(rendered, measurer: Measurer) -> None:
    """Within a third of a pixel on the whole outline; corners included."""
    seen = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM)
    assert seen.findings == ()
    assert seen.millimetres is not None
    assert hausdorff(seen.millimetres.exterior, rendered.truth_mm.exterior, 0.5) < 0.375
    assert seen.area_mm2 == pytest.approx(area(rendered.truth_mm), rel=0.002)


def test_each_stage_is_timed_and_total_is_their_sum(rendered, measurer: Measurer) -> None:
    times = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM).timings_ms
    assert set(times) == {"mask", "trace", "quality", "convert", "simplify", "judge", "network", "total"}
    assert times["total"] == pytest.approx(sum(value for name, value in times.items() if name != "total"))


def test_a_step_above_twice_the_core_is_logged_once_a_recipe(
    rendered, measurer: Measurer, caplog: pytest.LogCaptureFixture
) -> None:
    followed = Recipe(number=1, name="a", method="sliding-matrix", parameters={"step_px": 25})  # the core is 10
    given = Recipe(number=2, name="b", method="sliding-matrix", parameters={"step_px": 25, "core_px": 12})
    sound = Recipe(number=3, name="c", method="sliding-matrix", parameters={"step_px": 24, "core_px": 12})
    measurer, part = Measurer(None), np.ascontiguousarray(rendered.picture[500:700, 600:850])
    for recipe in (followed, given, sound, followed, given):
        measurer.measure(part, recipe, THICKNESS_MM)
    assert [record.getMessage().split(":")[0] for record in caplog.records] == ["recipe 1", "recipe 2"]
    assert "step_px is 25, expected up to 24, twice core_px" in caplog.text


def test_the_clock_is_the_callers(rendered) -> None:
    ticks = iter(range(100))
    times = Measurer(None, clock=lambda: next(ticks)).measure(rendered.picture, RECIPE, 20).timings_ms
    assert times["mask"] == 1000.0


def test_an_empty_table_is_a_finding_and_no_exception(measurer: Measurer) -> None:
    seen = measurer.measure(np.full((1200, 1600), 30, np.uint8), RECIPE, 20)
    assert seen.reasons == (Reason.NO_BLOCK_FOUND,)
    assert seen.pixels is None
    assert "total" in seen.timings_ms


def test_a_picture_of_another_size_is_a_finding_by_name(measurer: Measurer) -> None:
    seen = measurer.measure(np.full((1200, 1601), 30, np.uint8), RECIPE, 20)
    assert seen.reasons == (Reason.CALIBRATION_MISMATCH,)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"max_area_mm2": 1000.0}, Reason.AREA_OUT_OF_LIMITS),
        ({"min_area_mm2": 1e6}, Reason.AREA_OUT_OF_LIMITS),
        ({"max_vertices": 3}, Reason.TOO_MANY_POINTS),
    ],
)
def test_the_recipes_limits_refuse(rendered, measurer: Measurer, change: dict, reason: Reason) -> None:
    seen = measurer.measure(rendered.picture, RECIPE.model_copy(update=change), THICKNESS_MM)
    assert seen.reasons == (reason,)
    assert seen.pixels is not None


@pytest.mark.parametrize(("most", "refused"), [(1, ()), (0, (Reason.AREA_OUT_OF_LIMITS,))])
def test_a_hole_is_refused_where_the_recipes_block_has_none(most: int, refused: tuple[Reason, ...]) -> None:
    seen = Measurer(None).measure(render(HOLED).picture, RECIPE.model_copy(update={"max_holes": most}), 0.0)
    assert seen.reasons == refused


def test_a_region_in_pixels_and_the_same_in_millimetres_see_the_same(rendered, measurer: Measurer) -> None:
    whole = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM)
    assert whole.millimetres is not None
    low, high = whole.millimetres.exterior.min(axis=0) - 8, whole.millimetres.exterior.max(axis=0) + 8
    recipe = RECIPE.model_copy(update={"roi_mm": (*low.tolist(), *high.tolist())})
    seen = measurer.measure(rendered.picture, recipe, THICKNESS_MM)
    assert seen.findings == ()
    assert seen.millimetres is not None
    assert hausdorff(seen.millimetres.exterior, whole.millimetres.exterior, 0.5) < 0.2


@pytest.mark.parametrize("shift", [(-60, 0), (60, 0), (0, -60), (0, 60)])
def test_a_block_that_the_region_cuts_is_refused_with_words_for_it(shift) -> None:
    rendered = block("rectangle")
    low, high = rendered.truth_px.exterior.min(axis=0) - 9, rendered.truth_px.exterior.max(axis=0) + 9
    box = (*(low + shift).tolist(), *(high + shift).tolist())
    seen = measured(rendered, RECIPE.model_copy(update={"roi_px": box}))
    assert seen.reasons[0] == Reason.TOUCHES_BORDER
    assert "region of interest" in seen.texts[0]


def test_a_turned_region_that_cuts_a_block_refuses_too(rendered, measurer: Measurer) -> None:
    whole = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM)
    low, high = whole.millimetres.exterior.min(axis=0), whole.millimetres.exterior.max(axis=0)
    recipe = RECIPE.model_copy(update={"roi_mm": (*(low - 10).tolist(), high[0] - 40.0, high[1] + 10.0)})
    seen = measurer.measure(rendered.picture, recipe, THICKNESS_MM)
    assert seen.reasons[0] == Reason.TOUCHES_BORDER


def test_a_region_in_millimetres_needs_a_calibration(rendered) -> None:
    with pytest.raises(ParameterError, match="roi_mm needs a calibration"):
        Measurer(None).measure(rendered.picture, RECIPE.model_copy(update={"roi_mm": (0, 0, 300, 300)}), 20)


def test_a_covered_lens_is_bad_quality_before_it_is_no_block(measurer: Measurer) -> None:
    seen = measurer.measure(np.full((1200, 1600), 2, np.uint8), RECIPE, 20)
    assert seen.reasons == (Reason.IMAGE_QUALITY, Reason.NO_BLOCK_FOUND)


def test_the_work_area_refuses(rendered) -> None:
    calibration = load_record(SAMPLES / "calibration.yaml").calibration
    area_mm = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    seen = Measurer(calibration, work_area_mm=area_mm).measure(rendered.picture, RECIPE, THICKNESS_MM)
    assert seen.reasons == (Reason.OUTSIDE_WORK_AREA,)


def test_a_contour_beyond_what_the_calibration_covers_is_refused_by_that_name(rendered) -> None:
    plain = load_record(SAMPLES / "calibration.yaml").calibration
    exterior = rendered.truth_px.exterior
    low, high = exterior.min(axis=0) - 20, exterior.max(axis=0) + 20
    for right, reasons in ((high[0], ()), (high[0] - 40, (Reason.OUTSIDE_WORK_AREA,))):
        ring = np.array([low, [right, low[1]], [right, high[1]], [low[0], high[1]]])
        sure = replace(PositionUncertainty.everywhere(1600, 1200, 0.05), covered_px=ring)
        seen = Measurer(replace(plain, uncertainty=sure)).measure(rendered.picture, RECIPE, THICKNESS_MM)
        assert seen.reasons == reasons
    assert "leaves the part of the picture that the calibration covers: vertex (" in seen.texts[0]


def test_limits_in_millimetres_do_not_apply_without_a_calibration(rendered) -> None:
    seen = Measurer(None).measure(rendered.picture, RECIPE.model_copy(update={"max_area_mm2": 1.0}), 20)
    assert seen.findings == ()


@pytest.mark.parametrize("picture", [np.zeros((0, 5), np.uint8), np.zeros((5, 5), np.uint16), np.zeros(7, np.uint8)])
def test_an_array_that_is_no_picture_is_an_error(picture: np.ndarray) -> None:
    with pytest.raises(PictureError):
        Measurer(None).measure(picture, RECIPE, 20)


def test_what_the_recipe_says_reaches_the_method() -> None:
    recipe = Recipe(
        number=1,
        name="a",
        method="sliding-matrix",
        polarity="dark",
        binarize=90,
        parameters={"core_px": 8, "threshold": 70.5},
    )
    settings = trace_settings(recipe)
    assert (settings.polarity, settings.binarize, settings.core_px, settings.threshold) == ("dark", 90, 8, 70.5)
    assert isinstance(settings.core_px, int)
    assert settings.step_px is None


def test_a_method_that_is_not_built_in_is_an_error(rendered) -> None:
    recipe = RECIPE.model_copy(update={"method": "magic"})
    with pytest.raises(ParameterError):
        Measurer(None).measure(rendered.picture, recipe, 20)


@pytest.fixture
def half_bridged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every traced exterior 20 px from its 30th on are told as bridged, within 5 px."""
    method = tracing._METHODS["wall-tips"]

    def told(*args, **options):
        found = method(*args, **options)
        around = perimeter(found.contour.exterior)
        evidence = (
            Stretch(0, 0.0, 30.0, "seen", None, 0.3),
            Stretch(0, 30.0, 50.0, "bridged", "glare", 5.0),
            Stretch(0, 50.0, around, "seen", None, 0.4),
        )
        return replace(found, evidence=evidence)

    monkeypatch.setitem(tracing._METHODS, "wall-tips", told)


def test_what_the_contour_rests_on_is_told_along_the_polygon_and_judged(
    rendered, measurer: Measurer, half_bridged: None
) -> None:
    refused = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM)
    assert refused.reasons == (Reason.EDGE_COVERED,)
    assert refused.texts[0].startswith("Glare lies over 7.5 mm (20 px) of the block's edge near (")
    assert refused.pixels is not None
    assert refused.millimetres is not None
    fields = refused.evidence_fields
    assert fields is not None
    (bridged,) = [stretch for stretch in fields if stretch["state"] == "bridged"]
    assert list(bridged) == [
        "ring", "from_px", "to_px", "from_mm", "to_mm", "state", "by", "bound_px", "bound_mm"
    ]  # fmt: skip
    assert bridged["to_mm"] - bridged["from_mm"] == pytest.approx(0.375 * 20, rel=0.05)
    assert bridged["bound_mm"] == pytest.approx(0.385 * 5, rel=0.05)
    assert [fields[0]["from_px"], fields[0]["from_mm"]] == [0.0, 0.0]
    assert fields[-1]["to_px"] == pytest.approx(perimeter(refused.pixels.exterior))
    assert fields[-1]["to_mm"] == pytest.approx(perimeter(refused.millimetres.exterior))


def test_a_bridge_that_the_recipe_allows_is_in_the_bound_of_the_whole(
    rendered, measurer: Measurer, half_bridged: None
) -> None:
    allowed = measurer.measure(rendered.picture, RECIPE.model_copy(update={"max_bridged_mm": 8.0}), THICKNESS_MM)
    assert allowed.findings == ()
    assert allowed.evidence is not None
    assert allowed.uncertainty_px == max(stretch.bound_px for stretch in allowed.evidence) >= 5.0
    assert allowed.uncertainty_mm == max(stretch.bound_mm or 0.0 for stretch in allowed.evidence)


def test_without_a_calibration_no_length_in_millimetres_is_known_and_nothing_is_bridged(half_bridged: None) -> None:
    picture = block("rectangle").picture
    seen = Measurer(None).measure(picture, RECIPE.model_copy(update={"max_bridged_mm": 8.0}), 20)
    assert seen.reasons == (Reason.EDGE_COVERED,)
    assert seen.evidence_fields is not None
    assert {(stretch["from_mm"], stretch["to_mm"], stretch["bound_mm"]) for stretch in seen.evidence_fields} == {
        (None, None, None)
    }


def test_the_summary_for_the_journal_is_plain_json(rendered, measurer: Measurer) -> None:
    import json

    summary = measurer.measure(rendered.picture, RECIPE, THICKNESS_MM).summary()
    assert json.loads(json.dumps(summary)) == summary
    assert summary["vertices"] > 3


def test_on_a_table_as_light_as_walls_a_network_finds_the_block_if_the_recipe_lets_it() -> None:
    rendered = render(shop_floor_scene("expanded", 4_170_001, alone=True).scene)
    seen = measured(rendered)
    assert seen.findings == ()
    assert seen.network
    assert seen.summary()["network"] is True
    assert seen.pixels is not None
    assert farthest(seen.pixels, rendered.truth_px, 1.0)[0] < 0.5 * rendered.pitch_px
    assert seen.uncertainty_px is not None
    assert seen.uncertainty_px > 0.1 * rendered.pitch_px
    without = measured(rendered, recipe=Recipe(number=1, name="default", network=False))
    assert without.reasons == (Reason.NO_BLOCK_FOUND,)
    assert "network" not in without.summary()


@pytest.mark.parametrize(("cover", "seed"), [(tape, 4_160_000), (clamp, 4_160_002), (hand_or_cable, 4_160_001)])
def test_what_lies_over_an_edge_on_such_a_table_is_not_drawn_away(cover: Drawn, seed: int) -> None:
    rng = np.random.default_rng([seed, 5])
    scene = cover(rng, structured("brushed")(rng, shop_floor_block(seed)))
    assert measured(render(scene)).findings


def test_where_something_lies_over_an_edge_that_is_drawn_networks_are_asked_and_strong_walls_are_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    looked: list[tuple[bool, float | None]] = []

    def checked(picture: np.ndarray, settings: TraceSettings, *known: Any, **more: Any) -> CheckedTrace:
        source = known[-1]
        looked.append((source is not None and source.outline is not None, settings.least_rise))
        return trace_check.checked_trace(picture, settings, *known, **more)

    rendered = render(shop_floor_scene("tape", 1_880_001, alone=True).scene)
    outline = Outline(Contour(rendered.truth_px.exterior + 0.6 * rendered.pitch_px), rendered.pitch_px, 1.0)

    class Drawn:
        drawn = rendered.picture

        def walled(self) -> Source:
            return Source(rendered.picture)

        bordered = walled

        def outlined(self) -> Source:
            return Source(rendered.picture, outline=outline)

        def check(self, _outline: Contour) -> None:
            """Networks see nothing else."""

    monkeypatch.setattr(measure, "comb_picture", lambda _picture: Drawn())
    monkeypatch.setattr(measure, "checked_trace", checked)
    seen = measured(rendered)
    assert Reason.EDGE_COVERED in seen.reasons
    assert looked == [(False, None), (False, None), (True, None)]


def test_on_a_tables_grain_a_block_is_found_by_its_strong_walls() -> None:
    """By walls of usual height grain leads away from it."""
    seen = measured(render(shop_floor_scene("wood", 1_880_020).scene), PlainRecipe(network=False))
    assert seen.findings == ()


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """The least rise of each trace's walls."""
    asked: list[float | None] = []

    def traced(picture: np.ndarray, settings: TraceSettings, **known: object) -> Trace:
        asked.append(settings.least_rise)
        return tracing.trace(picture, settings, **known)

    monkeypatch.setattr(trace_check, "trace", traced)
    return asked


@pytest.mark.parametrize(
    ("scene", "reason", "looks"),
    [
        (("tape", 1_880_001), Reason.EDGE_COVERED, [None]),
        (("corners", 3_950_049), Reason.UNCERTAINTY_TOO_LARGE, [None]),
        (("wood", 1_880_001), Reason.NO_BLOCK_FOUND, [None, 0.6]),
    ],
)
def test_what_lies_over_an_edge_is_not_looked_past_nor_what_few_walls_tell(
    scene: tuple[str, int], reason: Reason, looks: list[float | None], asked: list[float | None]
) -> None:
    seen = measured(render(shop_floor_scene(*scene, alone=True).scene), PlainRecipe(network=False))
    assert seen.reasons[0] == reason
    assert asked == looks


@pytest.mark.parametrize("limit", [{"max_area_mm2": 100.0}, {"max_vertices": 3, "tolerance_mm": 0.01}])
def test_what_is_refused_for_its_size_alone_is_not_looked_at_again(
    rendered, measurer: Measurer, limit: dict, asked: list[float | None]
) -> None:
    assert measurer.measure(rendered.picture, RECIPE.model_copy(update=limit), 20).findings
    assert asked == [None]


def test_of_two_blocks_no_network_draws_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "comb_picture", lambda *_, **__: pytest.fail("asked"))
    seen = measured(render(shop_floor_scene("pushed_together", 4_150_000, alone=True).scene))
    assert Reason.SEVERAL_BLOCKS in seen.reasons


@pytest.mark.parametrize(
    ("seed", "reasons"),
    [(4_300_043, (Reason.METHODS_DISAGREE, Reason.EDGE_COVERED)), (4_300_054, (Reason.METHODS_DISAGREE,))],
)
def test_comb_that_a_cable_parts_off_is_seen_by_a_second_opinion(seed: int, reasons: tuple[Reason, ...]) -> None:
    rendered = render(shop_floor_scene("hand_or_cable", seed).scene)
    seen = measured(rendered)
    assert seen.reasons == reasons
    assert seen.findings[0][1].startswith("Comb seems to reach")
    assert seen.shown_px
    assert measured(rendered, recipe=Recipe(number=1, name="default", network=False)).findings == ()


def test_a_cable_no_wider_than_a_cell_over_the_edge_is_seen_by_a_second_opinion() -> None:
    rendered = render(shop_floor_scene("hand_or_cable", 8_200_000, alone=True).scene)
    seen = measured(rendered)
    assert seen.reasons == (Reason.EDGE_COVERED,)
    assert seen.findings[0][1].startswith("Something seems to lie over")
    assert measured(rendered, recipe=Recipe(number=1, name="default", network=False)).findings == ()


def test_a_seam_between_two_blocks_that_no_wall_tells_is_seen_by_a_second_opinion() -> None:
    rendered = render(shop_floor_scene("pushed_together", 7_100_005).scene)
    seen = measured(rendered)
    assert seen.reasons == (Reason.SEVERAL_BLOCKS,)
    assert seen.findings[0][1].startswith("A seam of")
    assert measured(rendered, recipe=Recipe(number=1, name="default", network=False)).findings == ()


def test_what_lies_over_an_edge_shows_in_the_picture_beside_what_a_network_draws(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A tape, black beside glare: no thing to the network, which draws what it leaves of the comb, and to no other."""
    monkeypatch.setattr(comb_picture, "comb_and_covers", lambda *of: comb_and_covers(*of) * np.float32([[[1]], [[0]]]))
    rendered = render(shop_floor_scene("glare", 8_300_007).scene)
    assert measured(rendered).findings
    monkeypatch.setattr(
        measure, "checked_trace", lambda *looked, **known: trace_check.checked_trace(*looked[:-1], None, **known)
    )
    assert measured(rendered).findings == ()


def test_where_faint_walls_were_left_out_another_look_is_taken() -> None:
    rendered = render(shop_floor_scene("light_table", 4_410_003).scene)
    seen, without = measured(rendered), measured(rendered, recipe=Recipe(number=1, name="default", network=False))
    assert seen.findings == without.findings == ()
    assert seen.pixels is not None
    assert without.pixels is not None
    assert farthest(seen.pixels, rendered.truth_px, 1.0)[0] < 0.5 * rendered.pitch_px
    assert farthest(without.pixels, rendered.truth_px, 1.0)[0] > 0.5 * rendered.pitch_px


def test_a_dark_cable_that_parts_a_corner_from_the_block_is_no_edge_of_it() -> None:
    """Its other side is a cell and a half long."""
    seen = measured(render(shop_floor_scene("hand_or_cable", 2_400_004).scene))
    assert Reason.METHODS_DISAGREE in seen.reasons


def test_compound_of_coarse_grain_that_was_cut_with_the_block_is_its_edge() -> None:
    rendered = render(shop_floor_scene("compound", 2_400_034).scene)
    seen = measured(rendered)
    assert not seen.findings
    assert seen.pixels is not None
    assert farthest(seen.pixels, rendered.truth_px, 1.0)[0] < 0.15 * rendered.pitch_px


def test_a_table_without_any_cells_is_looked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[TraceSettings] = []
    monkeypatch.setattr(
        trace_check,
        "trace",
        lambda picture, settings, **known: asked.append(settings) or tracing.trace(picture, settings, **known),
    )
    seen = Measurer(None).measure(np.full((300, 400), 80, np.uint8), RECIPE, THICKNESS_MM)
    assert seen.reasons == (Reason.NO_BLOCK_FOUND,)
    assert len(asked) == 1
