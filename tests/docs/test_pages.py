"""What the documents point at is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from service.reasons import Reason
from service.state import State

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_of_a_page_exists_with_its_anchor(page: Path) -> None:
    assert [target for target in links_of(page) if not leads_somewhere(page, target)] == []


def links_of(page: Path) -> list[str]:
    """The targets of a page's links, but for those into the network."""
    return [target for target in re.findall(r"\]\(([^)\s]+)", text_of(page)) if "://" not in target]


def leads_somewhere(page: Path, target: str) -> bool:
    """Whether the file is there, and has the heading."""
    name, _, anchor = target.partition("#")
    there = page.parent / name if name else page
    return there.exists() and (not anchor or anchor in anchors_of(there))


def anchors_of(page: Path) -> set[str]:
    """The anchors that a forge makes of a page's headings: small letters, hyphens for spaces, numbered where alike."""
    anchors: set[str] = set()
    for heading in re.findall(r"^#+ +(.+?) *$", text_of(page), re.MULTILINE):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        copies = sum(one == anchor or re.fullmatch(re.escape(anchor) + r"-\d+", one) is not None for one in anchors)
        anchors.add(f"{anchor}-{copies}" if copies else anchor)
    return anchors


def text_of(page: Path) -> str:
    """A page without its blocks of code: what stands there is neither heading nor link."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


def test_a_link_to_a_heading_that_is_not_there_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# `A` title, twice\n\n```\n# not one\n```\n\n# `A` title, twice\n\n[x](#a-title-twice-1)\n")
    assert links_of(page) == ["#a-title-twice-1"]
    assert leads_somewhere(page, "#a-title-twice-1")
    assert not leads_somewhere(page, "#not-one")
    assert not leads_somewhere(page, "other.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_test_that_a_page_names_exists(page: Path) -> None:
    for name, function in re.findall(
        r"`((?:tests|benchmarks)/[\w/]+\.py)(?:::(\w+))?`", page.read_text(encoding="utf-8")
    ):
        assert (ROOT / name).exists(), name
        assert not function or f"def {function}(" in (ROOT / name).read_text(encoding="utf-8"), f"{name}::{function}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_reason_that_a_page_names_has_that_code(page: Path) -> None:
    named = re.findall(r"\b(1\d\d) `([a-z]+(?:_[a-z]+)*)`", page.read_text(encoding="utf-8"))
    codes = {str(int(reason)): reason.label for reason in Reason}
    assert [(code, name) for code, name in named if codes.get(code) != name] == []


def test_the_states_are_told_with_their_values() -> None:
    page = (ROOT / "docs" / "operating.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| (\w+) \| (\d) \|", page, re.MULTILINE))
    assert told == {state.label: str(int(state)) for state in State}
