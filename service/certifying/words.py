"""A certificate's words and numbers, as people of a language write them."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files

from service.details import russian
from service.reasons import Language


def static(name: str) -> str:
    """A file of what certificates are made of."""
    return (files("service.certifying") / "static" / name).read_text(encoding="utf-8")


@cache
def _texts() -> dict[str, dict[str, str]]:
    return dict(json.loads(static("texts.json")))


def words(language: Language, key: str, **values: object) -> str:
    """A text, with its values put in."""
    return _texts()[language][key].format(**values)


def millimetres(language: Language, value: float, digits: int = 3, *, signed: bool = False) -> str:
    """A number with so many decimals, and with its sign where it is an error."""
    text = f"{value:{'+' if signed else ''}.{digits}f}"
    return text.replace(".", ",") if language is Language.RUSSIAN else text


def plain(language: Language, value: float) -> str:
    """A number as it was told, without needless digits."""
    text = f"{value:g}"
    return text.replace(".", ",") if language is Language.RUSSIAN else text


def detail(language: Language, text: str) -> str:
    """What was seen, in the reader's language as far as it is known."""
    return russian(text) if language is Language.RUSSIAN else text
