"""The table of rules names code and tests that exist, and docs/reliability.md shows it as it is."""

from __future__ import annotations

import pytest

from tests.rules.page import PAGE, fresh
from tests.rules.table import RULES, Rule, source_of


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.said)
def test_code_and_test_of_a_rule_exist(rule: Rule) -> None:
    assert rule.there in source_of(rule.code)
    assert source_of(rule.test)


def test_the_page_shows_the_table_as_it_is() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert fresh(page) == page, "write it by: python -m tests.rules.page"
