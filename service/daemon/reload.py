"""A new configuration at a job boundary: all of it or nothing, and the old one stays where the new one is bad."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from pydantic import BaseModel, ValidationError

from service.config.config import Config
from service.config.config_file import ConfigError, load_config
from service.config.mistakes import describe
from service.config.recipes import Recipe
from service.jobs.cycle_terms import Plan
from service.jobs.health import Health
from service.logs import event

log = logging.getLogger("combtrace.reload")

RELOADED = ("calibration", "default_recipe", "recipes", "work_area_mm", "table")
"""What the next job is measured by. All else names devices, addresses and files that are open, and needs a restart."""

PART = "configuration"


class BadPlan(Exception):
    """The configuration is well formed, but nothing can be measured by it: a file it names is missing or unfit."""


class Measuring(Protocol):
    """What measures jobs; `service.jobs.cycle.Cycle`."""

    @property
    def plan(self) -> Plan:
        """By what."""

    def use(self, plan: Plan) -> None:
        """From the next job on, by this; in the loop."""


class Reloader:
    """Reads the configuration again when asked, and takes over a single recipe. The running job keeps what it began
    with.
    """

    def __init__(
        self,
        path: Path,
        config: Config,
        health: Health,
        make_plan: Callable[[Config], Plan],
        measuring: Measuring,
    ) -> None:
        """make_plan raises BadPlan; it is called in a thread."""
        self.path = path
        self._config = config
        self._health = health
        self._make_plan = make_plan
        self._measuring = measuring
        self._asked = asyncio.Event()
        self._one_change = asyncio.Lock()

    @property
    def config(self) -> Config:
        """The one in force."""
        return self._config

    def ask(self) -> None:
        """Read it again soon."""
        self._asked.set()

    async def run(self) -> None:
        """Reload whenever asked, for ever."""
        while True:
            await self._asked.wait()
            self._asked.clear()
            await self.reload()

    async def adopt(self, expected: Recipe, recipe: Recipe, keep: Callable[[Config], int]) -> int:
        """What `keep` gives; from the next job on `recipe` is in the place of `expected`, which must be in force.

        keep: gets the configuration of before, in a thread, and makes durable what is adopted before it counts. Raise
        BadPlan, and what `keep` raises: then all stays as it was. Nothing else comes into force.
        """
        async with self._one_change:
            if expected not in self._config.recipes:
                raise BadPlan(f"recipe {expected.number} is no longer what it was when this was tried. Try it again")
            try:
                fresh = self._config.with_recipe(recipe)
            except ValidationError as error:
                raise BadPlan("; ".join(describe(error, Config))) from error
            await asyncio.to_thread(self._make_plan, fresh)  # the next start must not fail by it, as by a part's unit
            number = await asyncio.to_thread(keep, self._config)
            plan = self._measuring.plan
            self._measuring.use(replace(plan, recipes={**plan.recipes, recipe.number: recipe}))
            self._config = fresh
            return number

    def since(self) -> str:
        """From which job on a change counts that is made now."""
        job = self._health.job
        return "from the next job on" if job is None else f"from the job after {job} on"

    async def reload(self) -> str | None:
        """Why what was read does not apply; None where it does."""
        async with self._one_change:
            return await self._reloaded()

    async def _reloaded(self) -> str | None:
        try:
            fresh = await asyncio.to_thread(load_config, self.path)
            fixed = [key for key in differences(self._config, fresh) if key.split(".")[0].split(" ")[0] not in RELOADED]
            if fixed:
                what = ", ".join(fixed)
                raise BadPlan(f"{self.path}: {what} changed, which needs a restart. Restart the service, or undo it")
            plan = await asyncio.to_thread(self._make_plan, fresh)
        except (ConfigError, BadPlan) as error:
            lines = str(error).splitlines()
            for line in lines:  # an event each, or some of many would be held back
                log.error("not reloaded: %s", line, extra=event("reload", mistake=line))
            fields = event("reload", reloaded=False)
            log.warning("the configuration of before stays in force, all of it", extra=fields)
            more = f" (and {len(lines) - 1} more)" if lines[1:] else ""
            self._health.warn(PART, f"not reloaded: {lines[0]}{more}")
            return lines[0] + more
        changed = ", ".join(differences(self._config, fresh)) or "the files it names are read again"
        self._measuring.use(plan)
        self._config = fresh
        self._health.report("calibration", None)
        self._health.warn(PART, None)
        fields = event("reload", reloaded=True, changed=changed)
        log.info("configuration reloaded, %s: %s", self.since(), changed, extra=fields)
        return None


def differences(old: BaseModel, new: BaseModel, path: str = "") -> Iterator[str]:
    """The keys that differ, as paths: `controller.port`; recipes by their numbers, other lists as a whole."""
    if type(old) is not type(new):
        yield f"{path}kind"
        return
    for name in type(old).model_fields:
        before, after = getattr(old, name), getattr(new, name)
        if before == after:
            continue
        if isinstance(before, BaseModel) and isinstance(after, BaseModel):
            yield from differences(before, after, f"{path}{name}.")
        elif name == "recipes":
            yield f"recipes ({_numbers(before, after)})"
        else:
            yield f"{path}{name}"


def _numbers(before: Any, after: Any) -> str:
    """Which recipes differ, by number: `2 new, 3 gone, 4`."""
    old, new = ({recipe.number: recipe for recipe in recipes} for recipes in (before, after))
    words = []
    for number in sorted(old.keys() | new.keys()):
        if old.get(number) != new.get(number):
            words.append(
                f"{number} new" if number not in old else f"{number} gone" if number not in new else f"{number}"
            )
    return ", ".join(words) or "their order"
