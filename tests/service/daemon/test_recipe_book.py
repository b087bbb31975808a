"""A recipe adopted in a running service: from the next job on, durably, or not at all."""

from __future__ import annotations

import asyncio
import json
import shutil
from datetime import UTC, datetime
from pathlib import Path

import pytest

from service.config.adopted_recipes import AS_WRITTEN
from service.config.config_file import SAMPLES, load_config
from service.config.recipe_keys import with_values
from service.config.recipes import Recipe
from service.daemon.control import CommandRefused
from service.daemon.recipe_book import RecipeBook
from service.daemon.reload import BadPlan, Reloader
from service.jobs.cycle_terms import Plan
from service.jobs.health import Health
from service.measuring.measure import Measurer
from service.state import StateMachine
from service.wiring.plan import sound_plan

CONFIG = "camera: {kind: files, path: in}\ncontroller: {kind: none}\n"


class Jobs:
    """What measures: it holds a plan, as the cycle does."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def use(self, plan: Plan) -> None:
        self.plan = plan


class Book:
    """A service's recipes, by a configuration file."""

    def __init__(
        self, folder: Path, more: str = "adopted_recipes: adopted.json\n", recipe: str = "{number: 1, name: sheet}"
    ) -> None:
        self.path = folder / "config.yaml"
        self.path.write_text(f"{CONFIG}recipes: [{recipe}, {{number: 2, name: other}}]\n{more}")
        self.config = load_config(self.path)
        recipes = {recipe.number: recipe for recipe in self.config.recipes}
        self.jobs = Jobs(Plan(Measurer(None), recipes))
        self.health = Health(StateMachine(lambda _state, _reason: None))
        self.reloader = Reloader(self.path, self.config, self.health, sound_plan, self.jobs)
        self.book = RecipeBook(self.reloader, now=lambda: datetime(2026, 11, 23, tzinfo=UTC))

    @property
    def recipe(self) -> Recipe:
        return self.book.config.recipe(1)


async def test_the_next_job_has_it_and_one_under_way_keeps_its_own(tmp_path: Path) -> None:
    it = Book(tmp_path)
    before, under_way = it.recipe, it.jobs.plan
    changed = with_values(before, {"tolerance_mm": 0.4})
    assert await it.book.adopt(before, changed, "anna", "less points") == (1, "from the next job on")
    assert it.jobs.plan.recipes == {1: changed, 2: it.config.recipe(2)}
    assert it.jobs.plan.measurer is under_way.measurer, "nothing else is read again"
    assert under_way.recipes[1] == before
    assert load_config(it.path) == it.reloader.config
    assert it.book.former(it.recipe, AS_WRITTEN) == before
    assert it.book.former(it.recipe, 1) == changed
    assert it.book.former(it.recipe, 2) is None


async def test_it_is_durable_before_it_counts_so_that_a_kill_at_any_moment_loses_nothing(tmp_path: Path) -> None:
    it = Book(tmp_path)
    changed = with_values(it.recipe, {"tolerance_mm": 0.4})
    found: list[Recipe] = []

    class Killed(Exception):
        pass

    def use(_plan: Plan) -> None:
        found.append(load_config(it.path).recipe(1))  # as the next start would
        raise Killed

    it.jobs.use = use  # type: ignore[method-assign]
    with pytest.raises(Killed):
        await it.book.adopt(it.recipe, changed, "anna", "just in time")
    assert found == [changed]


async def test_what_is_no_longer_in_force_is_not_replaced(tmp_path: Path) -> None:
    it = Book(tmp_path)
    before = it.recipe
    one, other = (with_values(before, {"tolerance_mm": value}) for value in (0.4, 0.5))
    results = await asyncio.gather(
        it.book.adopt(before, one, "anna", "at the same time"),
        it.book.adopt(before, other, "oleg", "at the same time"),
        return_exceptions=True,
    )
    assert [type(result) for result in results] == [tuple, CommandRefused]
    assert it.recipe == one


@pytest.mark.parametrize(
    ("more", "told"),
    [("", "Set adopted_recipes to a file"), ("adopted_recipes: nowhere/adopted.json\n", "cannot be written")],
)
async def test_where_it_cannot_be_kept_nothing_changes(tmp_path: Path, more: str, told: str) -> None:
    it = Book(tmp_path, more)
    plan, config = it.jobs.plan, it.reloader.config
    with pytest.raises(CommandRefused, match=told):
        await it.book.adopt(it.recipe, with_values(it.recipe, {"tolerance_mm": 0.4}), "anna", "in vain")
    assert it.jobs.plan is plan
    assert it.reloader.config is config


async def test_what_the_configuration_does_not_allow_is_refused_and_not_kept(tmp_path: Path) -> None:
    it = Book(tmp_path)
    with pytest.raises(BadPlan, match="margin_mm needs millimetres"):
        await it.reloader.adopt(it.recipe, with_values(it.recipe, {"margin_mm": 1}), pytest.fail)
    assert not (tmp_path / "adopted.json").exists()


async def test_what_the_next_start_would_fail_by_is_refused(tmp_path: Path) -> None:
    shutil.copy(SAMPLES / "calibration.yaml", tmp_path)
    plate = {"type": "Polygon", "coordinates": [[[0, 0], [60, 0], [60, 40], [0, 0]]]}
    (tmp_path / "plate.geojson").write_text(json.dumps(plate))
    more = "calibration: {file: calibration.yaml}\nadopted_recipes: adopted.json\n"
    it = Book(tmp_path, more, recipe="{number: 1, name: sheet, part: {file: plate.geojson, units: mm}}")
    wider = with_values(it.recipe, {"part.margin_mm": 3})
    assert (await it.book.adopt(it.recipe, wider, "anna", "for the new blade"))[0] == 1
    with pytest.raises(CommandRefused, match="GeoJSON, which has no layers"):
        await it.book.adopt(wider, with_values(wider, {"part.layer": "cut"}), "anna", "by mistake")
    assert it.recipe == load_config(it.path).recipe(1) == wider
