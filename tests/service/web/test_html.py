"""The page as the server makes it: in whose language."""

from __future__ import annotations

import pytest

from service.web.html import preferred


@pytest.mark.parametrize(
    ("header", "language"),
    [
        ("", "en"),
        ("ru", "ru"),
        ("ru-RU,ru;q=0.9,en-US;q=0.8,en;q=0.7", "ru"),
        ("en-GB, ru;q=0.9", "en"),
        ("de,fr;q=0.5", "en"),
        ("en;q=0.2,RU;q=0.7", "ru"),
        ("ru;q=0, en;q=0.1", "en"),
        ("ru;q=much, *", "en"),
        (",;q=1,;;", "en"),
    ],
)
def test_a_browsers_languages_are_heard_by_weight(header: str, language: str) -> None:
    assert preferred(header) == language
