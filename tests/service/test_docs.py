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
def test_every_relative_link_of_a_page_exists(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_reason_that_a_page_names_has_that_code(page: Path) -> None:
    named = re.findall(r"\b(1\d\d) `([a-z]+(?:_[a-z]+)*)`", page.read_text(encoding="utf-8"))
    codes = {str(int(reason)): reason.label for reason in Reason}
    assert [(code, name) for code, name in named if codes.get(code) != name] == []


def test_the_states_are_told_with_their_values() -> None:
    page = (ROOT / "docs" / "operating.md").read_text(encoding="utf-8")
    told = dict(re.findall(r"^\| (\w+) \| (\d) \|", page, re.MULTILINE))
    assert told == {state.label: str(int(state)) for state in State}
