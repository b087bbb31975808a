"""Sections of pages that commands write, kept when the page is written anew: of docs/reports/accuracy.md by default."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

PAGE = Path(__file__).resolve().parent.parent / "docs" / "reports" / "accuracy.md"


def put_section(name: str, text: str, page: Path = PAGE) -> None:
    """Write the section `name` into the page, in place of the one of this name, else at the end."""
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    block = f"<!-- {name}: begin -->\n{text}\n<!-- {name}: end -->"
    pattern = _pattern(re.escape(name))
    found = pattern.search(old)
    new = f"{old.rstrip()}\n\n{block}\n" if found is None else old[: found.start()] + block + old[found.end() :]
    page.write_text(new, encoding="utf-8")


def section(name: str, page: Path = PAGE) -> str:
    """The text of the section `name` as it stands in the page."""
    found = _pattern(re.escape(name)).search(page.read_text(encoding="utf-8"))
    if found is None:
        raise LookupError(f"{page} has no section {name}")
    return found.group(0).split("\n", 1)[1].rsplit("\n", 1)[0]


def kept_sections(page: Path = PAGE) -> list[str]:
    """All such sections of the page as they stand, marks included."""
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    return [found.group(0) for found in _pattern(r"[\w-]+").finditer(old)]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column is text, the others are numbers."""
    lines = ["| " + " | ".join(head) + " |", "|" + "|".join(["---"] + ["--:"] * (len(head) - 1)) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(rf"<!-- (?P<name>{name}): begin -->\n.*?<!-- (?P=name): end -->", re.DOTALL)
