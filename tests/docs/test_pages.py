"""What the documents point at is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from service.reasons import Reason
from service.state import State

ROOT = Path(__file__).parents[2]
FOLDERS = ("benchmarks", "contour", "controllers", "docs", "drivers", "packaging", "samples", "service", "tests")
PAGES = sorted([*ROOT.glob("*.md"), *(page for name in FOLDERS for page in ROOT.glob(f"{name}/**/*.md"))])
INDEX = ROOT / "docs" / "README.md"
TEXTS = {".cfg", ".html", ".ini", ".js", ".md", ".py", ".service", ".sh", ".st", ".yaml", ".yml"}
SECTIONS = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
MOST_WORDS = 25


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


def test_the_index_names_every_page_once() -> None:
    named = [(INDEX.parent / target).resolve() for target in links_of(INDEX) if target.endswith(".md")]
    below = [page for page in named if page.is_relative_to(INDEX.parent)]
    assert sorted(below) == sorted(page for page in INDEX.parent.glob("**/*.md") if page != INDEX)


def test_every_document_that_code_and_files_name_is_there() -> None:
    files = [path for name in FOLDERS for path in ROOT.glob(f"{name}/**/*") if path.suffix in TEXTS]
    missing = [
        f"{file.relative_to(ROOT)}: {name}"
        for file in [ROOT / "Makefile", ROOT / "config.yaml", ROOT / "README.md", ROOT / "ARCHITECTURE.md", *files]
        for name in re.findall(r"(?<![\w/])docs/[\w/-]+(?:\.\w+)?", file.read_text(encoding="utf-8"))
        if not (ROOT / name).exists()
    ]
    assert missing == []


def test_the_changelog_keeps_to_its_sections_and_to_short_entries() -> None:
    for version in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1:]:
        sections = re.findall(r"^### (.*)$", version, re.MULTILINE)
        assert sections == [name for name in SECTIONS if name in sections]
        entries = re.findall(r"^- .*(?:\n  .*)*", version, re.MULTILINE)
        assert [entry for entry in entries if len(entry.split()) - 1 > MOST_WORDS] == []
        rest = version.split("\n", 1)[1]
        for entry in entries:
            rest = rest.replace(entry, "", 1)
        assert [line for line in rest.splitlines() if line and not line.startswith(("### ", "#### "))] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_test_that_a_page_names_exists(page: Path) -> None:
    for name, function in re.findall(
        r"`((?:tests|benchmarks)/[\w/]+\.py)(?:::(\w+))?`", page.read_text(encoding="utf-8")
    ):
        assert (ROOT / name).exists(), name
        assert not function or f"def {function}(" in (ROOT / name).read_text(encoding="utf-8"), f"{name}::{function}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_file_and_folder_of_the_source_that_a_page_names_is_there(page: Path) -> None:
    named = re.findall(rf"`((?:{'|'.join(FOLDERS)})/[\w./-]*)", page.read_text(encoding="utf-8"))
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_reason_that_a_page_names_has_that_code(page: Path) -> None:
    named = re.findall(r"\b(1\d\d) `([a-z]+(?:_[a-z]+)*)`", page.read_text(encoding="utf-8"))
    codes = {str(int(reason)): reason.label for reason in Reason}
    assert [(code, name) for code, name in named if codes.get(code) != name] == []


def test_the_states_are_told_with_their_values() -> None:
    page = (ROOT / "docs" / "how-to" / "operating.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| (\w+) \| (\d) \|", page, re.MULTILINE))
    assert told == {state.label: str(int(state)) for state in State}
