"""Mistakes in a configuration in words: where, what was seen, what is expected, and what the key is for."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterator
from datetime import date
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from service.config.config import Config
from service.config.values import MistakeAt, TruthValue

Location = tuple[int | str, ...]

_LONGEST_SEEN = 60

# What is expected, by pydantic's names of mistakes; {} is filled from what it tells besides.
_EXPECTED = {
    "greater_than": "a number above {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "a number below {lt:g}",
    "less_than_equal": "{le:g} at most",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "string_type": "text; put it in quotes",
    "string_too_short": "{min_length} or more characters",
    "string_too_long": "{max_length} characters at most",
    "string_pattern_mismatch": "text of the form {pattern}",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "tuple_type": "a list",
    "list_type": "a list",
    "too_short": "{min_length} entries or more",
    "too_long": "{max_length} entries at most",
    "dict_type": "keys with values",
    "model_type": "keys with values",
    "model_attributes_type": "keys with values",
    "date_type": "a date such as 2026-11-23",
    "date_from_datetime_parsing": "a date such as 2026-11-23",
    "date_from_datetime_inexact": "a date such as 2026-11-23, without a time",
    "path_type": "the path of a file or folder",
}


def describe(
    error: ValidationError, model: type[BaseModel], line_of: Callable[[Location], int | None] = lambda _where: None
) -> Iterator[str]:
    """Each mistake in the data of `model` as a line: line of the file, the key's path, what was seen, what is expected.

    line_of: the line where a location stands, None where there is no file.
    """
    told: dict[Location, list[ErrorDetails]] = {}
    for mistake in error.errors(include_url=False):
        raised = mistake.get("ctx", {}).get("error")
        if isinstance(raised, MistakeAt):
            mistake["loc"] = (*mistake["loc"], *raised.location)
        told.setdefault(_plain(mistake["loc"]), []).append(mistake)
    _gather_foreign_keys(told, model)
    for location, mistakes in told.items():
        line = line_of(location)
        where = f"line {line}: " if line is not None else ""
        yield where + _sentence(path_of(location), mistakes, model)


def _gather_foreign_keys(told: dict[Location, list[ErrorDetails]], model: type[BaseModel]) -> None:
    """Keys of other kinds, which all come at once where the kind was changed, become one mistake."""
    for location, mistakes in list(told.items()):
        mistake = mistakes[0]
        if mistake["type"] != "extra_forbidden" or str(location[-1]) not in _keys(model, location[:-1]):
            continue
        first = next(
            (place for place in told if place[:-1] == location[:-1] and _FOREIGN in told[place][0]["msg"]), None
        )
        if first is None:
            kind = mistake["loc"][-2]
            mistakes[0] = {**mistake, "type": "value_error", "msg": f"kind {kind} {_FOREIGN} {location[-1]}"}
        else:
            told[first][0]["msg"] += f", {location[-1]}"
            del told[location]


_FOREIGN = "has not the keys of other kinds, take them out:"


def _keys(model: type[BaseModel], location: Location) -> set[str]:
    """All keys that some kind has at a place."""
    return {name for there in _models_at(model, location) for name in there.model_fields}


def _sentence(where: str, mistakes: list[ErrorDetails], model: type[BaseModel]) -> str:
    """The mistakes at one place; several are those of a value that may be of several types."""
    mistake = mistakes[0]
    location = _whole_values(mistake["loc"])  # with its kinds, which choose the model
    seen = mistake.get("input")
    match mistake["type"]:
        case "extra_forbidden":
            return f"{where}: unknown key{_did_you_mean(model, location)}"
        case "missing":
            return f"{where}: is missing. Add it{_purpose(model, location)}"
        case "union_tag_invalid":
            assert isinstance(seen, dict)
            return (
                f"{where}.kind: seen {_shown(seen.get('kind'))}, expected {_choices(mistake['ctx']['expected_tags'])}"
            )
        case "union_tag_not_found":
            kinds = ", ".join(str(kind) for there in _models_at(model, location) for kind in _kinds_of(there))
            return f"{where}.kind: is missing. Add it: one of {kinds}"
        case "value_error":
            message = mistake["msg"].removeprefix("Value error, ")
            if _FOREIGN in message:
                where = where.rpartition(".")[0]
            return f"{where}: {message}" if where else message
    expected = " or ".join(dict.fromkeys(_expected(one) for one in mistakes))
    return f"{where}: seen {_shown(seen)}, expected {expected}{_purpose(model, location)}"


def _expected(mistake: ErrorDetails) -> str:
    """What is expected instead, in words."""
    if any(isinstance(part, str) and part.startswith("tuple[") for part in mistake["loc"]):
        return "a list of numbers"
    if mistake["type"] == "literal_error":
        return _choices(mistake["ctx"]["expected"])
    text = _EXPECTED.get(mistake["type"])
    return mistake["msg"] if text is None else text.format(**mistake.get("ctx", {}))


def _choices(quoted: str) -> str:
    """`one of a, b, c` from pydantic's `'a', 'b' or 'c'`."""
    words = [word.strip(" '") for word in quoted.replace(" or ", ", ").split(",")]
    return words[0] if len(words) == 1 else f"one of {', '.join(words)}"


def _shown(seen: Any) -> str:
    if isinstance(seen, dict):
        return "keys with values"
    if isinstance(seen, bool):
        return str(TruthValue(seen))
    if isinstance(seen, TruthValue):
        return str(seen)
    if isinstance(seen, date):
        return f"the date {seen}"
    text = "nothing" if seen is None else repr(seen)
    return text if len(text) <= _LONGEST_SEEN else f"{text[:_LONGEST_SEEN]}..."


def _purpose(model: type[BaseModel], location: Location) -> str:
    """What the key is for, in the words of its description; "" where it has none."""
    fields = (
        [there.model_fields.get(str(location[-1])) for there in _models_at(model, location[:-1])] if location else []
    )
    found = next((field.description for field in fields if field is not None and field.description), None)
    return f" ({found.rstrip('.')})" if found else ""


def _whole_values(location: Location) -> Location:
    """The location, up to a value that may be of several types: pydantic goes on with the type it tried."""
    branch = next(
        (k for k, part in enumerate(location) if isinstance(part, str) and ("[" in part or "-int" in part)), None
    )
    return location[:branch]


def _plain(location: Location) -> Location:
    """The location in the file: without the kinds that pydantic puts into the path of a union."""
    whole = _whole_values(location)
    pairs = zip(("", *whole), whole, strict=False)
    return tuple(part for before, part in pairs if isinstance(part, int) or not _is_kind(part, before))


def path_of(location: Location) -> str:
    """`recipes[0].tolerance_mm`."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _is_kind(part: str, before: int | str) -> bool:
    return part in _KINDS and (isinstance(before, int) or before in ("camera", "controller"))


def _did_you_mean(model: type[BaseModel], location: tuple[int | str, ...]) -> str:
    """The nearest of the keys that may stand there, or else the keys themselves."""
    known = sorted({name for there in _models_at(model, location[:-1]) for name in there.model_fields})
    if ":" in str(location[-1]):
        return ", and a space is missing after its colon"
    near = difflib.get_close_matches(str(location[-1]), known, n=1)
    return f"; did you mean {near[0]}?" if near else f", expected one of {', '.join(known)}"


def _models_at(model: type[BaseModel], location: tuple[int | str, ...]) -> list[type[BaseModel]]:
    """The models whose keys stand at a place in the data of `model`; more than one where `kind` is not known."""
    here = [model]
    for part in location:
        of_kind = [there for there in here if part in _kinds_of(there)]
        if of_kind:
            here = of_kind
        elif isinstance(part, str):
            fields = [there.model_fields[part] for there in here if part in there.model_fields]
            here = [inner for field in fields for inner in _models_in(field.annotation)]
    return here


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _models_in(inner)


def _kinds_of(model: type[BaseModel]) -> tuple[Any, ...]:
    kind = model.model_fields.get("kind")
    return get_args(kind.annotation) if kind is not None else ()


# The words that choose a model of a union, which pydantic puts into an error's path.
_KINDS = frozenset(
    word
    for field in Config.model_fields.values()
    for model in _models_in(field.annotation)
    for word in _kinds_of(model)
)
