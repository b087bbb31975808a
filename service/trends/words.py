"""Words, numbers and times as people of a language write them."""

from __future__ import annotations

import json
import math
from datetime import datetime
from functools import cache
from importlib.resources import files

from service.reasons import Language


def static(name: str) -> str:
    """A file of what reports and pages are made of."""
    return (files("service.trends") / "static" / name).read_text(encoding="utf-8")


@cache
def _texts() -> dict[str, dict[str, str]]:
    return dict(json.loads(static("texts.json")))


def words(language: Language, key: str, **values: object) -> str:
    """A text, with its values put in."""
    return _texts()[language][key].format(**values)


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
