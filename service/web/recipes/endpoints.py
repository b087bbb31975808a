"""The endpoints of recipes: whoever may look sees them; to try, adopt or take back is an order."""

from __future__ import annotations

import asyncio
import json

from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import Response

from service.config.adopted_recipes import AdoptedError
from service.config.config import Config
from service.config.recipe_keys import RecipeMistake
from service.config.recipes import Recipe
from service.daemon.control import CommandRefused
from service.daemon.recipe_book import RecipeBook
from service.link.job_numbers import LARGEST_JOB
from service.web.commands import Commands, Order, RequestRefused
from service.web.daemon_access import DaemonAccess
from service.web.recipes import models
from service.web.recipes.listing import listed
from service.web.recipes.trials import Asked, Trials, key_changes, last_jobs
from service.web.requests import Endpoint, address_of, body, holder_of, whole

LARGEST_RECIPE = 65_535
NONE_ADOPTED = "nothing is adopted"


class RecipeEndpoints:
    """Recipes, the one try, and adoptions."""

    def __init__(self, daemon: DaemonAccess, commands: Commands) -> None:
        self._daemon = daemon
        self._commands = commands
        self._trials = Trials(daemon.sources.archive_path)
        self._schema = json.dumps(Recipe.model_json_schema(), ensure_ascii=False).encode()

    def close(self) -> None:
        """End a try that runs."""
        self._trials.close()

    def gets(self) -> dict[str, Endpoint]:
        """What can be looked at, by path."""
        return {
            "/recipes": self.recipes,
            "/recipes/schema": self.schema,
            "/recipes/trial": self.trial,
            "/recipes/trial/{job}/drawing": self.drawing,
        }

    def posts(self) -> dict[str, Endpoint]:
        """Orders, by path."""
        return {
            "/recipes/trial/stop": self.stop,
            "/recipes/{recipe}/trial": self.begin,
            "/recipes/{recipe}/adopt": self.adopt,
            "/recipes/{recipe}/back": self.back,
        }

    # --- looking ------------------------------------------------------------------------------------------------

    async def recipes(self, _request: Request) -> Response:
        """Recipes in force, and those of before."""
        book = self._book()
        return _answer(await asyncio.to_thread(listed, book))

    async def schema(self, _request: Request) -> Response:
        """Bounds, defaults and words of a recipe's keys."""
        return Response(self._schema, media_type="application/schema+json")

    async def trial(self, _request: Request) -> Response:
        """The last try."""
        return _answer(models.TrialAnswer(trial=self._trials.state()))

    async def drawing(self, request: Request) -> Response:
        """What the tried recipe would have drawn."""
        found = self._trials.drawing(whole(request.path_params["job"], LARGEST_JOB, digits=10) or 0)
        if found is None:
            raise RequestRefused(404, "that job was not tried, or its drawing was too large to be kept")
        return Response(found, media_type="application/json")

    # --- orders -------------------------------------------------------------------------------------------------

    async def begin(self, request: Request) -> Response:
        """Try a changed recipe."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.TrialRequest)
        book, recipe = self._named(request)
        try:
            changed = book.changed(recipe, asked.changes)
        except RecipeMistake as mistake:
            raise RequestRefused(422, str(mistake)) from mistake
        if changed == recipe:
            raise RequestRefused(422, f"recipe {recipe.number} is that already: there is nothing to try")
        jobs = await asyncio.to_thread(self._last_jobs, recipe.number, asked.jobs)
        detail = f"{_told(recipe, changed)}; on {len(jobs)} jobs"

        async def do() -> tuple[int, str]:
            return self._trials.begin(Asked(recipe, changed, jobs, who)), "begun"

        order = Order("try recipe", detail, "nothing is tried", asked.take_over)
        return _answer(models.TrialBegun(trial=await self._commands.carry_out(who, address, order, do)), 202)

    def _last_jobs(self, recipe: int, count: int) -> tuple[int, ...]:
        sources = self._daemon.sources
        try:
            found = last_jobs(sources.journal_path, sources.archive_path, recipe, count)
        except OSError as error:
            raise RequestRefused(503, f"the archive cannot be looked at: {error.strerror}") from error
        if not found:
            told = f"of recipe {recipe} no job is kept, so there is nothing to try it on. See archive.max_bytes"
            raise RequestRefused(409, told)
        return found

    async def stop(self, request: Request) -> Response:
        """End the try that runs."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.StopRequest)

        async def do() -> tuple[None, str]:
            await asyncio.to_thread(self._trials.stop)
            return None, "ended"

        await self._commands.carry_out(who, address, Order("end try", None, "it goes on", asked.take_over), do)
        return _answer(models.TrialAnswer(trial=self._trials.state()))

    async def adopt(self, request: Request) -> Response:
        """Have in force what was tried."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.AdoptRequest)
        book, recipe = self._named(request)
        try:
            tried = self._trials.tried(asked.trial)
        except CommandRefused as refused:
            raise RequestRefused(409, str(refused)) from refused
        if tried.recipe.number != recipe.number:
            raise RequestRefused(409, f"recipe {tried.recipe.number} was tried, and not {recipe.number}")
        order = Order(
            "adopt recipe", f"{_told(tried.recipe, tried.changed)}; {asked.note}", NONE_ADOPTED, asked.take_over
        )
        return await self._adopted(book, (tried.recipe, tried.changed), (who, address, asked.note), order)

    async def back(self, request: Request) -> Response:
        """Have a former recipe in force again."""
        who, address = await holder_of(request, self._commands), address_of(request)
        asked = await body(request, models.BackRequest)
        book, recipe = self._named(request)
        try:
            former = await asyncio.to_thread(book.former, recipe, asked.adoption)
        except AdoptedError as error:
            raise RequestRefused(503, str(error)) from error
        except RecipeMistake as mistake:
            raise RequestRefused(409, f"that recipe cannot be any more: {mistake}") from mistake
        if former is None:
            raise RequestRefused(404, f"recipe {recipe.number} has no adoption {asked.adoption} that is kept")
        if former == recipe:
            raise RequestRefused(409, f"recipe {recipe.number} is that already")
        detail = f"{_told(recipe, former)}; back to {asked.adoption}: {asked.note}"
        order = Order("adopt recipe", detail, NONE_ADOPTED, asked.take_over)
        return await self._adopted(book, (recipe, former), (who, address, asked.note), order)

    async def _adopted(
        self, book: RecipeBook, recipes: tuple[Recipe, Recipe], word: tuple[str, str, str], order: Order
    ) -> Response:
        """recipes: in force, and to be. word: who, from which address, why."""
        who, address, note = word

        async def do() -> tuple[tuple[int, str], str]:
            number, since = await self._daemon.adopt(book, *recipes, who, note)
            return (number, since), f"adoption {number}, {since}"

        number, since = await self._commands.carry_out(who, address, order, do)
        return _answer(models.Adopted(recipe=recipes[0].number, adoption=number, since=since))

    def _book(self) -> RecipeBook:
        book = self._daemon.sources.book
        if book is None:
            raise RequestRefused(409, "this service has no configuration file, so its recipes stay as they are")
        return book

    def _named(self, request: Request) -> tuple[RecipeBook, Recipe]:
        """The recipe of the path, as it is in force."""
        book = self._book()
        config: Config = book.config
        try:
            return book, config.recipe(whole(request.path_params["recipe"], LARGEST_RECIPE) or 0)
        except KeyError as error:
            numbers = ", ".join(str(recipe.number) for recipe in config.recipes)
            raise RequestRefused(404, f"there is no such recipe; there are {numbers}") from error


def _told(before: Recipe, after: Recipe) -> str:
    """The change, for the journal."""
    told = (f"{one.key} {json.dumps(one.before)} -> {json.dumps(one.after)}" for one in key_changes(before, after))
    return f"recipe {before.number}: {', '.join(told)}"


def _answer(model: BaseModel, status: int = 200) -> Response:
    return Response(model.model_dump_json(), status, media_type="application/json")
