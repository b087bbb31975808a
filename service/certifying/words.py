"""A certificate's words and numbers, as people of a language write them."""

from __future__ import annotations

from service.details import russian
from service.reasons import Language
from service.texts import Texts

_TEXTS = Texts("service.certifying")
static, words = _TEXTS.static, _TEXTS.words


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
