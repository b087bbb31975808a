"""What was measured or seen in a job, told in Russian: by the sentences that code makes in English.

Journal, documents, log and JSON hold the English sentence alone. Its numbers and names are found in it again by the
pattern it was made by; so what an earlier version wrote, and what lies in the journal for years, is told too. A
sentence that no pattern fits stays as it is.
"""

from __future__ import annotations

import json
import re
from functools import cache, lru_cache
from importlib.resources import files

BETWEEN = ".; "  # of two findings
DEEPEST = 4  # sentences within sentences
LEAST_WORDS = 10  # characters; what says less of its own is only known around numbers
NUMBER = re.compile(r"-?\d+\.\d+")
PLACE = re.compile(r"\{(\w+)\}")


@cache
def patterns() -> tuple[tuple[re.Pattern[str], str], ...]:
    """English sentences and their Russian templates, those with most words of their own first."""
    told: dict[str, str] = json.loads((files("service") / "details_ru.json").read_text(encoding="utf-8"))
    most_first = sorted(told, key=lambda english: -len(PLACE.sub("", english)))
    return tuple((_pattern(english), told[english]) for english in most_first)


def _pattern(english: str) -> re.Pattern[str]:
    words, names = PLACE.split(english)[::2], PLACE.findall(english)
    value = r"[-\d.]+" if len("".join(words)) < LEAST_WORDS else ".+?"
    made = re.escape(words[0])
    for name, after in zip(names, words[1:], strict=True):
        made += f"(?P<{name}>{value}){re.escape(after)}"
    return re.compile(made, re.DOTALL)


def russian(text: str) -> str:
    """The text in Russian as far as it is known, numbers with a decimal comma."""
    *before, last = text.split(BETWEEN)
    return BETWEEN.join([*(_sentence(part + ".", 0).removesuffix(".") for part in before), _sentence(last, 0)])


@lru_cache(512)
def _sentence(text: str, depth: int) -> str:
    if NUMBER.fullmatch(text):
        return text.replace(".", ",")
    for pattern, template in patterns() if depth <= DEEPEST else ():
        found = pattern.fullmatch(text)
        if found is not None:
            return template.format(**{name: _sentence(value, depth + 1) for name, value in found.groupdict().items()})
    return text
