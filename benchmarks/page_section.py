"""Sections of pages that commands write, kept when the page is written anew: of docs/reports/accuracy.md by default."""

from __future__ import annotations

import argparse
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


def options_of_seeds(name: str, description: str | None, *, seeds: int, first: int) -> argparse.ArgumentParser:
    """What the commands have in common that write a section from pictures of seeds in a row."""
    parser = argparse.ArgumentParser(prog=f"python -m {name}", description=description)
    parser.add_argument("--seeds", type=int, default=seeds, metavar="N", help="pictures of each kind")
    parser.add_argument("--first", type=int, default=first, metavar="SEED", help="the first seed")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes")
    parser.add_argument("--write", action="store_true", help="write the section of docs/reports/accuracy.md")
    return parser


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; the first column is text, the others are numbers."""
    lines = ["| " + " | ".join(head) + " |", "|" + "|".join(["---"] + ["--:"] * (len(head) - 1)) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(rf"<!-- (?P<name>{name}): begin -->\n.*?<!-- (?P=name): end -->", re.DOTALL)
