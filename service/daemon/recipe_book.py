"""Recipes of the running service: which are in force, which were before, and the order to adopt another one."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any

from pydantic import ValidationError

from service.config.adopted_recipes import AS_WRITTEN, AdoptedError, History, Word, keep_adopted, load_adopted
from service.config.config import Config
from service.config.mistakes import describe
from service.config.recipe_keys import RecipeMistake, settable, with_values
from service.config.recipes import Recipe
from service.daemon.control import CommandRefused
from service.daemon.reload import BadPlan, Reloader
from service.logs import event

log = logging.getLogger("combtrace.reload")


class RecipeBook:
    """May be looked into from any thread; `adopt` runs in the daemon's loop."""

    def __init__(self, reloader: Reloader, *, now: Callable[[], datetime] = lambda: datetime.now(UTC)) -> None:
        self._reloader = reloader
        self._now = now

    @property
    def config(self) -> Config:
        """The configuration in force, with the recipes that were adopted."""
        return self._reloader.config

    def histories(self) -> Mapping[int, History]:
        """What was adopted, by the recipe's number; reads a file, and raises AdoptedError."""
        path = self.config.adopted_recipes
        return {} if path is None else load_adopted(path).recipes

    def changed(self, recipe: Recipe, values: Mapping[str, Any]) -> Recipe:
        """The recipe with these keys set, which may be in force here; raise RecipeMistake."""
        changed = with_values(recipe, values)
        try:
            self.config.with_recipe(changed)
        except ValidationError as error:
            raise RecipeMistake("; ".join(describe(error, Config))) from error
        return changed

    def former(self, recipe: Recipe, adoption: int) -> Recipe | None:
        """The recipe as it was adopted by this number, or AS_WRITTEN; None where that is not kept.

        Reads a file; raise AdoptedError, RecipeMistake.
        """
        if adoption == AS_WRITTEN:
            return self.changed(recipe, settable(self.config.as_written(recipe.number)))
        history = self.histories().get(recipe.number)
        found = () if history is None else (one.values for one in history.adoptions if one.number == adoption)
        return next((self.changed(recipe, values) for values in found), None)

    async def adopt(self, expected: Recipe, recipe: Recipe, who: str, note: str) -> tuple[int, str]:
        """Have it in force in the place of `expected`, durably: the adoption's number, and from which job on.

        Raise CommandRefused where that cannot be: then all stays as it was. A job keeps the recipe that it began with.
        """
        path = self.config.adopted_recipes
        if path is None:
            raise CommandRefused("no recipe can be adopted. Set adopted_recipes to a file that the service may write")
        word = Word(who, self._now().isoformat(timespec="milliseconds"), note)
        try:
            number = await self._reloader.adopt(
                expected, recipe, lambda config: keep_adopted(path, config, recipe, word)
            )
        except (BadPlan, AdoptedError) as error:
            raise CommandRefused(str(error)) from error
        except OSError as error:
            raise CommandRefused(f"{path}: cannot be written, so nothing is adopted: {error.strerror}") from error
        since = self._reloader.since()
        fields = event("recipe", recipe=recipe.number, adoption=number, who=who)
        log.warning("recipe %d adopted by %s, %s: %s", recipe.number, who, since, note, extra=fields)
        return number, since
