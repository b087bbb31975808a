"""wall-tips on photographs that others made, with outlines drawn by hand; they are never part of the project."""

from __future__ import annotations

from dataclasses import replace

import pytest

from contour.geometry.agreement import agreement
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.scenes.photographs import Photograph, photographs, run_photograph

# Drawn by hand, about 1 % sure; moving a small lattice's outline by one pixel costs 3 % of its IoU.
LEAST_IOU = {
    "alfoam_closed": 0.98,
    "fangrid_left": 0.985,
    "lattice_ce12": 0.92,
    "lattice_rpu": 0.965,
    "protoboard_10x5": 0.98,
}
# A strip three cells wide, and a core between bars and others of its kind: no outline of theirs is found.
REFUSED = {"nomex_coupon": Reason.NO_BLOCK_FOUND, "nomexfin_dense": Reason.TOUCHES_BORDER}


def photograph_of(name: str) -> Photograph:
    found, folder = photographs()
    named = next((photograph for photograph in found if photograph.name == name), None)
    return named or pytest.skip(f"{name} is not in {folder}; COMBTRACE_PHOTOS names another folder")


@pytest.mark.parametrize("name", LEAST_IOU)
def test_the_outline_of_a_photograph_is_that_drawn_by_hand(name: str) -> None:
    trial = run_photograph(photograph_of(name), "wall-tips", 20.0)
    assert trial.agreement is not None, trial.failure
    assert trial.agreement.iou >= LEAST_IOU[name]


@pytest.mark.parametrize("name", ["alfoam_closed", "fangrid_left", "lattice_rpu", "protoboard_10x5"])
def test_nothing_need_be_promised_and_the_bound_holds(name: str) -> None:
    photograph = photograph_of(name)
    found = Measurer(None).measure(photograph.picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), photograph.edge)
    assert found.pixels is not None
    assert found.uncertainty_px is not None
    near = agreement(found.pixels, photograph.outline)
    assert near.iou >= LEAST_IOU[name]
    assert near.holds(found.uncertainty_px)


@pytest.mark.parametrize("name", REFUSED)
def test_a_core_in_a_photograph_that_is_not_traced_right_is_refused(name: str) -> None:
    photograph = photograph_of(name)
    found = Measurer(None).measure(photograph.picture, replace(PlainRecipe(), edge=photograph.edge), 0.0)
    assert REFUSED[name] in found.reasons


def test_every_photograph_of_the_folder_is_read() -> None:
    found, folder = photographs()
    if not found:
        pytest.skip(f"no photographs in {folder}; COMBTRACE_PHOTOS names another folder")
    assert {photograph.name for photograph in found} == {path.stem for path in folder.glob("*.png")}
