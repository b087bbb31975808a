"""wall-tips on photographs that others made, with outlines drawn by hand; they are never part of the project."""

from __future__ import annotations

import pytest

from tests.support.scenes.photographs import photographs, run_photograph

# Drawn by hand, about 1 % sure; moving the small lattice's outline by one pixel costs 3 % of its IoU.
LEAST_IOU = {"lattice_rpu": 0.94, "protoboard_10x5": 0.96, "alfoam_closed": 0.96}
FOUND, FOLDER = photographs()


@pytest.mark.parametrize("name", LEAST_IOU)
def test_the_outline_of_a_photograph_is_that_drawn_by_hand(name: str) -> None:
    photograph = next((found for found in FOUND if found.name == name), None)
    if photograph is None:
        pytest.skip(f"{name} is not in {FOLDER}; COMBTRACE_PHOTOS names another folder")
    trial = run_photograph(photograph, "wall-tips", 20.0)
    assert trial.agreement is not None, trial.failure
    assert trial.agreement.iou >= LEAST_IOU[name]
