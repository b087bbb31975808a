"""A recipe's part is tried in blocks that were accepted, and refuses those in which it does not fit."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from pydantic import ValidationError

from contour.acceptance.error_budget import ErrorBudget
from contour.geometry.rings import Contour
from contour.ribbon.ribbon import Ribbon
from contour.synthetic import rectangle
from service.config.recipes import OneOfParts, PartToCut, Recipe
from service.measuring.calibration_file import load_record
from service.measuring.measurement import Measurement
from service.measuring.part_trial import PartTrial
from service.parts.core_ribbon import CoreRibbon
from service.parts.fit import PartFit
from service.reasons import Reason

CALIBRATION = load_record(Path(__file__).parents[3] / "service" / "samples" / "calibration.yaml").calibration
BLOCK = rectangle((150.0, 100.0), 200.0, 120.0)


@pytest.fixture
def asked(tmp_path: Path) -> PartToCut:
    path = tmp_path / "part.json"
    ring = [[0, 0], [160, 0], [160, 100], [0, 100], [0, 0]]
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    return PartToCut(file=path, units="mm", margin_mm=9.0, rotation="fixed")


def seen(bound_mm: float | None = 0.25, **more: Any) -> Measurement:
    budget = None if bound_mm is None else ErrorBudget(bound_mm, 0.0, None)
    return Measurement("wall-tips", millimetres=BLOCK, uncertainty=budget, thickness_mm=20.0, **more)


def test_twice_the_bound_adds_to_the_margin(asked: PartToCut) -> None:
    fits, vague = (PartTrial().tried(seen(bound), asked, CALIBRATION) for bound in (0.25, 0.75))
    assert fits.findings == ()
    assert fits.part is not None
    assert (fits.part.fits, fits.part.short_by_mm) == (True, None)
    assert fits.part.margin_mm == pytest.approx(10.0, abs=1e-3)
    assert vague.reasons == (Reason.PART_DOES_NOT_FIT,)
    assert vague.part is not None
    assert vague.part.short_by_mm == pytest.approx(0.505, abs=1e-3)
    assert "keeps 10.00 mm at" in vague.texts[0]
    needed = "needed are 10.51 mm (9 mm, and 1.50 mm that the contour may be off)"
    assert f"{needed}. It is short by 0.51 mm" in vague.texts[0]


def test_what_was_refused_before_and_what_is_in_pixels_stay_as_they_are(asked: PartToCut) -> None:
    refused = seen(findings=((Reason.TOUCHES_BORDER, "it does"),))
    assert PartTrial().tried(refused, asked, CALIBRATION) is refused
    in_pixels = replace(seen(), millimetres=None)
    assert PartTrial().tried(in_pixels, asked, None) is in_pixels


def test_without_a_bound_nothing_is_said_to_fit(asked: PartToCut) -> None:
    measured = PartTrial().tried(seen(None), asked, CALIBRATION)
    assert measured.reasons == (Reason.PART_DOES_NOT_FIT,)
    assert "cannot be said" in measured.texts[0]


def test_a_part_is_read_once_and_one_that_is_gone_is_told(asked: PartToCut) -> None:
    trial = PartTrial()
    assert trial.part_of(asked) is trial.part_of(asked)
    asked.file.unlink()
    assert trial.tried(seen(), asked, CALIBRATION).findings == ()
    measured = PartTrial().tried(seen(), asked, CALIBRATION)
    assert measured.reasons == (Reason.PART_DOES_NOT_FIT,)
    assert "The part cannot be read" in measured.texts[0]


def test_what_stands_out_is_told_by_how_much(asked: PartToCut) -> None:
    small = replace(seen(), millimetres=Contour(BLOCK.exterior * 0.7))
    measured = PartTrial().tried(small, asked, CALIBRATION)
    assert measured.part is not None
    assert measured.part.margin_mm == pytest.approx(-math.hypot(10.0, 8.0), abs=0.01)
    assert "stands out of the block by 12.81 mm" in measured.texts[0]
    # The block is 140 mm by 84: the part's corners stand out by 10 mm and 8 mm.
    assert np.isfinite(measured.part.placement.pose.x)


def read(angle_deg: float | None, bound_deg: float = 0.5) -> CoreRibbon:
    if angle_deg is None:
        return CoreRibbon(Ribbon(why="too few walls are seen between the cells"))
    return CoreRibbon(Ribbon(angle_deg, bound_deg, "walls"))


def along_picture(asked: PartToCut, **more: Any) -> PartToCut:
    return PartToCut(**{**asked.model_dump(), "rotation": "free", "margin_mm": 0, "ribbon_from_picture": True, **more})


def test_a_part_lies_along_the_ribbon_that_was_read(asked: PartToCut) -> None:
    fit = PartTrial().tried(seen(ribbon=read(4.0)), along_picture(asked, ribbon_angle_deg=60.0), CALIBRATION).part
    assert fit is not None
    # What is not known of the ribbon is taken off the tolerance.
    assert abs(math.remainder(fit.placement.pose.angle_deg - 4.0, 180.0)) <= 1.5 + 1e-6


@pytest.mark.parametrize(
    ("ribbon", "why"),
    [
        (read(None), "cannot be read from the picture: too few walls are seen between the cells. Look where it runs"),
        (read(4.0, 2.5), "it is told within 2.5 degrees only, 2 are allowed"),
        (None, "nobody looked"),
    ],
)
def test_a_ribbon_that_is_not_told_well_enough_refuses_unless_an_angle_is_given(
    asked: PartToCut, ribbon: CoreRibbon | None, why: str
) -> None:
    refused = PartTrial().tried(seen(ribbon=ribbon), along_picture(asked), CALIBRATION)
    assert refused.reasons == (Reason.PART_DOES_NOT_FIT,)
    assert why in refused.texts[0]
    assert refused.part is None
    given = PartTrial().tried(seen(ribbon=ribbon), along_picture(asked, ribbon_angle_deg=0.0), CALIBRATION)
    assert given.part is not None
    assert abs(math.remainder(given.part.placement.pose.angle_deg, 180.0)) <= 2.0 + 1e-6


def test_a_ribbon_that_no_turn_of_the_part_lies_along_is_told(asked: PartToCut, small: PartToCut) -> None:
    fixed = along_picture(asked, rotation="fixed")
    assert "none of its 1 angles" in PartTrial().tried(seen(ribbon=read(45.0)), fixed, CALIBRATION).texts[0]
    recipe = several(small, ribbon_from_picture=True)
    assert "none of its 1 angles" in PartTrial().laid(seen(ribbon=read(45.0)), recipe, CALIBRATION).texts[0]
    assert PartTrial().laid(seen(ribbon=read(179.9, 0.1)), recipe, CALIBRATION).findings == ()


def test_without_a_pitch_nothing_is_read(asked: PartToCut) -> None:
    measured = seen(pixels=BLOCK)
    picture = np.zeros((480, 640), np.uint8)
    found = PartTrial.with_ribbon(measured, picture, CALIBRATION).ribbon
    assert found is not None
    assert (found.told.angle_deg, found.told.why) == (None, "wall-tips does not look at cells")
    assert PartTrial.with_ribbon(measured, picture, None) is measured


def test_what_is_kept_of_a_fit_is_the_fit_again(asked: PartToCut) -> None:
    fit = PartTrial().tried(seen(), asked, CALIBRATION).part
    assert fit is not None
    assert fit.drawn is not None
    kept = json.loads(json.dumps(fit.kept()))
    again = PartFit.of_kept(kept)
    assert again.kept() == fit.kept()
    assert again.fields() == fit.fields()
    assert again.drawn is not None
    assert (again.drawn.margin_px, again.drawn.tightest, again.drawn.fits) == (
        fit.drawn.margin_px,
        fit.drawn.tightest,
        True,
    )
    np.testing.assert_allclose(again.part.contour.exterior, fit.part.contour.exterior, atol=1e-9)


def test_the_journal_keeps_where_it_lies(asked: PartToCut) -> None:
    kept = PartTrial().tried(seen(), asked, CALIBRATION).summary()["part"]
    assert kept["fits"] is True
    assert (kept["file"], kept["angle_deg"], kept["margin_mm"]) == ("part.json", 0.0, 10.0)


# --- several ----------------------------------------------------------------------------------------------------------


def several(asked: PartToCut, **more: Any) -> Recipe:
    small = OneOfParts(**{**asked.model_dump(), "margin_mm": 2.0, "quantity": 3, **more})
    return Recipe(number=1, name="several", parts=(small,), parts_apart_mm=4.0)


@pytest.fixture
def small(tmp_path: Path) -> PartToCut:
    path = tmp_path / "small.json"
    ring = [[0, 0], [80, 0], [80, 50], [0, 50], [0, 0]]
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    return PartToCut(file=path, units="mm", rotation="fixed")


def test_as_many_parts_as_fit_are_laid_each_with_its_margin_and_apart(small: PartToCut) -> None:
    measured = PartTrial().laid(seen(), several(small, quantity=9), CALIBRATION)
    assert measured.findings == ()
    assert len(measured.parts) == 4
    room = shapely.Polygon(BLOCK.exterior)
    shapes = [shapely.Polygon(fit.placed.exterior) for fit in measured.parts]
    for fit, shape in zip(measured.parts, shapes, strict=True):
        assert fit.fits
        assert fit.margin_mm == pytest.approx(shape.distance(room.boundary), abs=1e-9)
        assert fit.margin_mm >= 2.5
        assert fit.number == 1
    assert min(one.distance(two) for k, one in enumerate(shapes) for two in shapes[:k]) >= 4.0
    assert [PartFit.of_kept(json.loads(json.dumps(fit.kept()))).number for fit in measured.parts] == [1] * 4
    assert len(measured.summary()["parts"]) == 4
    assert measured.laid_of_each == [(1, 4, 9)]
    assert [fit.drawn and fit.drawn.number for fit in measured.parts] == [1] * 4


def test_a_block_in_which_none_of_several_fits_is_refused_by_their_names(small: PartToCut) -> None:
    measured = PartTrial().laid(seen(), several(small, margin_mm=60.0), CALIBRATION)
    assert measured.reasons == (Reason.PART_DOES_NOT_FIT,)
    assert "None of the parts fits: small.json" in measured.texts[0]


def test_a_recipe_has_one_part_or_several(small: PartToCut) -> None:
    with pytest.raises(ValidationError, match="part and parts are both given"):
        Recipe.model_validate({**several(small).model_dump(), "part": small})
