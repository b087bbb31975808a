"""Recipes that were adopted while the service ran: a file beside its state, which the service alone writes.

The configuration file stays a person's. A recipe that was adopted goes before the one that is written there as long as
that one says what it said then: whoever changes it in the file has the last word.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from service.atomic_file import write_whole
from service.config.config import Config
from service.config.mistakes import describe
from service.config.recipe_keys import RecipeMistake, changes, settable, with_values
from service.config.recipes import Recipe
from service.config.values import Model

MOST_KEPT = 20  # adoptions of a recipe: the way back
AS_WRITTEN = 0  # the number of what the configuration file says, where adoptions are numbered


class AdoptedError(Exception):
    """The file cannot be used, or not what is in it: seen, expected, next step."""


class Adoption(Model):
    """A recipe that was adopted: `values` of all settable keys, `changes` from what was in force before to that."""

    number: int
    at: str
    who: str
    note: str
    changes: dict[str, tuple[Any, Any]]
    values: dict[str, Any]


class History(Model):
    """What was adopted in the place of one recipe, oldest first, and what the configuration file said then."""

    over: dict[str, Any]
    adoptions: tuple[Adoption, ...] = Field(min_length=1)

    def holds(self, written: Recipe) -> bool:
        """True where the configuration file still says that."""
        plain = settable(Recipe(number=1, name="of keys that later versions have"))
        return {**plain, **self.over} == {**plain, **settable(written)}


class AdoptedRecipes(Model):
    """The file: each recipe's history, by its number."""

    version: Literal[1] = 1
    recipes: dict[int, History] = Field(default_factory=dict)


@dataclass(frozen=True)
class Word:
    """Who adopts a recipe, when, and why."""

    who: str
    at: str
    note: str


def load_adopted(path: Path) -> AdoptedRecipes:
    """What the file holds, nothing where it is not there; raise AdoptedError."""
    try:
        return AdoptedRecipes.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        return AdoptedRecipes()
    except OSError as error:
        next_step = "Run this as a user who may read it, or check adopted_recipes"
        raise AdoptedError(f"{path}: cannot be read: {error.strerror}. {next_step}") from error
    except ValidationError as error:
        first = next(describe(error, AdoptedRecipes))
        raise AdoptedError(
            f"{path}: is no file of adopted recipes ({first}). Restore it, or move it away: recipes are those of the "
            "configuration then"
        ) from error


def with_adopted(config: Config) -> Config:
    """The configuration with the recipes that were adopted; raise AdoptedError."""
    if config.adopted_recipes is None:
        return config
    kept = load_adopted(config.adopted_recipes).recipes
    for written in config.recipes:
        history = kept.get(written.number)
        if history is None or not history.holds(written):
            continue
        try:
            config = config.with_recipe(with_values(written, history.adoptions[-1].values))
        except (RecipeMistake, ValidationError) as error:
            told = error if isinstance(error, RecipeMistake) else "; ".join(describe(error, Config))
            raise AdoptedError(
                f"{config.adopted_recipes}: recipe {written.number} cannot be as it was adopted: {told}. Correct what "
                "it depends on, or move the file away: recipes are those of the configuration then"
            ) from error
    return config


def keep_adopted(path: Path, config: Config, recipe: Recipe, word: Word) -> int:
    """Make durable that the recipe is adopted in this configuration; the adoption's number.

    Raise AdoptedError, OSError. Of more than MOST_KEPT the oldest is let go.
    """
    known = load_adopted(path)
    history = known.recipes.get(recipe.number)
    before = () if history is None else history.adoptions
    adoption = Adoption(
        number=1 + max((one.number for one in before), default=AS_WRITTEN),
        **vars(word),
        changes=changes(config.recipe(recipe.number), recipe),
        values=settable(recipe),
    )
    written = settable(config.as_written(recipe.number))
    fresh = History(over=written, adoptions=(*before, adoption)[-MOST_KEPT:])
    text = AdoptedRecipes(recipes={**known.recipes, recipe.number: fresh}).model_dump_json(indent=1)
    write_whole(path, text.encode())
    return adoption.number
