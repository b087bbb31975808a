"""A recipe's keys one by one, as they are named where one is set alone: `gcode.feed_mm_min`, `parts.0.quantity`."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from service.config.mistakes import describe
from service.config.recipes import Recipe

WRITTEN_ONLY = ("number", "name", "part", "parts")
"""What it is called by, and whether it has parts: a name, or a file's path, is the configuration file's word alone."""

FILES = ("file", "template")


class RecipeMistake(ValueError):
    """A recipe cannot be so: which key, what was seen, what is expected."""


def settable(recipe: Recipe) -> dict[str, Any]:
    """Each key that may be set without a hand in the configuration file, with its value as JSON has it."""
    return dict(_flat(recipe.model_dump(mode="json"), ""))


def _flat(values: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        where = f"{path}{key}"
        if key == "parts":
            for place, one in enumerate(value):
                yield from _flat(one, f"{where}.{place}.")
        elif isinstance(value, dict) and key != "parameters":  # whose keys depend on the method
            yield from _flat(value, f"{where}.")
        elif where not in WRITTEN_ONLY and key not in FILES:
            yield where, value


def with_values(recipe: Recipe, values: Mapping[str, Any]) -> Recipe:
    """The recipe with these keys set; raise RecipeMistake."""
    known = settable(recipe)
    for key in values:
        if key in WRITTEN_ONLY or key.rpartition(".")[2] in FILES:
            raise RecipeMistake(f"{key[:60]}: is set in the configuration file alone")
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]}?" if near else ""
            raise RecipeMistake(f"{key[:60]!r}: unknown key{hint}")
    settings = recipe.model_dump(mode="json")
    for key, value in values.items():
        *path, last = key.split(".")
        there: Any = settings
        for part in path:
            there = there[int(part)] if isinstance(there, list) else there[part]
        there[last] = value
    try:
        return Recipe.model_validate(settings)
    except ValidationError as error:
        raise RecipeMistake("; ".join(describe(error, Recipe))) from error


def changes(old: Recipe, new: Recipe) -> dict[str, tuple[Any, Any]]:
    """The settable keys that differ, from what to what; of two recipes of the same parts."""
    before, after = settable(old), settable(new)
    return {key: (before[key], value) for key, value in after.items() if before[key] != value}
