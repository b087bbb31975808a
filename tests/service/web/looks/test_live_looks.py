"""One loop of looks serves all who watch, begins with the first and ends with the last."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest

from drivers.camera.simulated import SimulatedCamera
from service.config.recipes import Recipe
from service.jobs.cycle_terms import Plan
from service.jobs.rehearsal import drawn_comb
from service.jobs.spare_camera import LookSources
from service.measuring.measure import Measurer
from service.web.looks.live_looks import PICTURES_KEPT, WANTED_S, LiveLooks
from service.web.looks.models import LiveLook
from tests.support.processes.processes import until

PLAN = Plan(Measurer(None), {3: Recipe(number=3, name="small", min_area_mm2=1)}, default_recipe=3)


@dataclass
class Clock:
    """Time that only a test lets pass."""

    now_s: float = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def sources() -> Iterator[LookSources]:
    camera = SimulatedCamera(lambda _sequence: drawn_comb())
    camera.open()
    with ThreadPoolExecutor(1) as pool:
        yield LookSources(camera, pool, lambda: True, lambda: True, lambda: PLAN, timeout_s=1.0, spare=True)


def looked(looks: LiveLooks, after: int = 0) -> LiveLook:
    found = until(lambda: looks.answer(after).look, what="a look")
    assert isinstance(found, LiveLook)
    return found


def ended(looks: LiveLooks) -> None:
    until(lambda: not looks.looking, what="the end of looking")
    assert [thread for thread in threading.enumerate() if thread.name.startswith("live")] == []


def test_who_asks_sees_look_after_look_and_who_asks_no_more_ends_them(sources: LookSources) -> None:
    clock = Clock()
    looks = LiveLooks(sources, now=clock)
    assert not looks.looking
    first = looks.answer(0)
    assert (first.waits_for, first.look) == ("start", None)
    seen = looked(looks)
    assert (seen.recipe.number, seen.findings) == (3, [])
    assert seen.drawing is not None
    assert (seen.drawing.job_id, seen.drawing.width, seen.drawing.refused) == (0, 150, False)
    assert len(seen.drawing.exterior) > 3
    assert seen.figures is not None
    assert seen.figures.sharpness > 0
    picture = cv2.imdecode(np.frombuffer(looks.picture(seen.number) or b"", np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (120, 150, 3)
    later = looked(looks, seen.number)
    assert later.number > seen.number
    assert looks.answer(later.number + 10).look is None
    clock.now_s += WANTED_S + 1
    ended(looks)
    assert looks.picture(later.number) is None
    assert looks.answer(0).waits_for == "start"  # and with who comes next they begin again
    looks.close()
    ended(looks)


def test_all_who_watch_see_the_same_looks_and_only_the_last_pictures_are_kept(sources: LookSources) -> None:
    looks = LiveLooks(sources, now=Clock())
    numbers = [looked(looks).number]
    while len(numbers) <= PICTURES_KEPT:
        numbers.append(looked(looks, numbers[-1]).number)
    assert {looks.answer(0).look is not None for _ in range(20)} == {True}
    assert len([thread for thread in threading.enumerate() if thread.name == "live view"]) == 1
    assert looks.picture(numbers[0]) is None
    assert looks.picture(numbers[-1]) is not None
    looks.close()
    ended(looks)


def test_a_new_recipe_counts_from_the_next_look_on(sources: LookSources) -> None:
    plans = [PLAN]
    looks = LiveLooks(replace(sources, plan=lambda: plans[-1]), now=Clock())
    assert looked(looks).findings == []
    plans.append(
        Plan(
            Measurer(None), {9: Recipe(number=9, name="empty", method="find-contours", binarize=254)}, default_recipe=9
        )
    )
    refused = until(lambda: (look := looks.answer(0).look) and look.recipe.number == 9 and look, what="the new recipe")
    assert isinstance(refused, LiveLook)
    assert refused.findings != []
    assert refused.drawing is not None
    assert refused.drawing.refused
    looks.close()
    ended(looks)


def test_what_looking_waits_for_is_told(sources: LookSources) -> None:
    never = LiveLooks(replace(sources, spare=False))
    assert never.answer(0).waits_for == "source"
    assert not never.looking
    for name, sources_then in (("job", {"idle": lambda: False}), ("camera", {"works": lambda: False})):
        looks = LiveLooks(replace(sources, **sources_then), now=Clock())
        assert looks.answer(0).waits_for == name
        looks.close()
        ended(looks)
