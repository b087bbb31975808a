"""Words, numbers and times as people of a language write them."""

from __future__ import annotations

import math
from datetime import datetime

from service.reasons import Language
from service.texts import Texts

_TEXTS = Texts("service.trends")
static, words = _TEXTS.static, _TEXTS.words


def number(language: Language, value: float | None, digits: int | None = None) -> str:
    """A number, three significant digits where it is not whole, or so many decimals; a dash where it is not known."""
    if value is None or not math.isfinite(value):
        return "–"
    if digits is None:
        digits = 0 if value == int(value) else max(0, 2 - math.floor(math.log10(abs(value))))
    text = f"{value:,.{digits}f}".replace(",", "\u00a0")
    return text.replace(".", ",") if language is Language.RUSSIAN else text


def moment(time: datetime) -> str:
    """A time by this computer's zone."""
    return time.astimezone().strftime("%Y-%m-%d %H:%M")


def lasting(language: Language, seconds: int) -> str:
    """A usual step of time."""
    for size, unit in ((86_400, "days"), (3600, "hours")):
        if seconds >= size:
            return words(language, unit, n=seconds // size)
    return words(language, "minutes", n=seconds // 60)
