"""Tables of a certificate: HTML without style or script."""

from __future__ import annotations

import html
from collections.abc import Sequence

from service.certifying.words import words
from service.reasons import Language

HASH_SHOWN = 23
"""Characters of a hash on paper, `sha256:` and 16 digits; the JSON holds all of it."""


def in_mm(language: Language, value: str) -> str:
    """A number with its unit."""
    return words(language, "mm", value=value)


def facts(rows: Sequence[tuple[str, str]]) -> str:
    """What is known, a name and a value a row."""
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f'<table class="facts">{cells}</table>'


def table(
    head: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = (), kinds: Sequence[str] = ()
) -> str:
    """A table. numbers: columns that stand to the right; kinds: a class for each row."""

    def cells(name: str, row: Sequence[str]) -> str:
        sides = [' class="number"' if column in numbers else "" for column in range(len(row))]
        return "".join(f"<{name}{side}>{html.escape(cell)}</{name}>" for cell, side in zip(row, sides, strict=True))

    classes = kinds or [""] * len(rows)
    body = "".join(f'<tr class="{kind}">{cells("td", row)}</tr>' for row, kind in zip(rows, classes, strict=True))
    return f"<table><thead><tr>{cells('th', head)}</tr></thead><tbody>{body}</tbody></table>"
