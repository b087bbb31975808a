"""Recipes as they are told: those in force, and what was adopted in their place."""

from __future__ import annotations

from service.config.adopted_recipes import AS_WRITTEN, AdoptedError, Adoption, History
from service.config.config import Config
from service.config.recipe_keys import settable
from service.config.recipes import Recipe
from service.daemon.recipe_book import RecipeBook
from service.web.recipes.models import AdoptionEntry, KeyChange, RecipeEntry, RecipeList


def listed(book: RecipeBook) -> RecipeList:
    """All of them; reads a file."""
    config, trouble = book.config, None
    try:
        histories = dict(book.histories())
    except AdoptedError as error:
        histories, trouble = {}, str(error)
    if config.adopted_recipes is None:
        trouble = "No recipe can be adopted: adopted_recipes names no file."
    recipes = [_entry(config, recipe, histories.get(recipe.number)) for recipe in config.recipes]
    return RecipeList(default=config.default_recipe, recipes=recipes, trouble=trouble)


def _entry(config: Config, recipe: Recipe, history: History | None) -> RecipeEntry:
    values = settable(recipe)
    entries = [] if history is None else [_adoption(one, values) for one in reversed(history.adoptions)]
    written = settable(config.as_written(recipe.number)) == values
    if entries:
        note = "as the configuration file has it"
        entries.append(AdoptionEntry(number=AS_WRITTEN, at=None, who=None, note=note, changes=[], in_force=written))
    return RecipeEntry(
        number=recipe.number,
        name=recipe.name,
        values=values,
        parts=[part.file.name for part in recipe.asked_parts],
        adopted=entries,
    )


def _adoption(one: Adoption, values: dict[str, object]) -> AdoptionEntry:
    return AdoptionEntry(
        number=one.number,
        at=one.at,
        who=one.who,
        note=one.note,
        changes=[KeyChange(key=key, before=old, after=new) for key, (old, new) in one.changes.items()],
        in_force=one.values == values,
    )
