"""Charts and reports: what is drawn lies where its value is, and nothing of a journal becomes markup."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from xml.etree import ElementTree

import pytest

from service.measuring.trend_file import TrendLine
from service.reasons import Language, Reason
from service.records.journal_reader import Note
from service.trends.chart import HEIGHT, WIDTH, Bar, Mark, bar_chart, line_chart
from service.trends.documents import shift_report, trends_page
from service.trends.history import Bucket, History, RecipeUsed, Span, Use
from service.trends.words import lasting, number, static

BEGIN = datetime(2026, 3, 1, tzinfo=UTC)
SPAN = Span(BEGIN, BEGIN + timedelta(days=1))
TEXTS = json.loads(static("texts.json"))
NASTY = "<script>alert(1)</script>"


def marks(*means: float) -> list[Mark]:
    return [Mark(BEGIN + timedelta(seconds=k * SPAN.step_s), mean - 1, mean, mean + 1) for k, mean in enumerate(means)]


def drawn(svg: str) -> ElementTree.Element:
    return ElementTree.fromstring(svg)


def heights(svg: str) -> list[float]:
    return [float(dot.get("cy", "nan")) for dot in drawn(svg).iter("circle")]


def test_means_lie_as_their_values_and_all_within_the_picture() -> None:
    svg = line_chart(Language.ENGLISH, "n", SPAN, marks(10, 20, 15))
    first, second, third = heights(svg)
    assert (first + second) / 2 == pytest.approx(third, abs=0.1)
    assert 0 < second < third < first < HEIGHT
    assert all(0 <= float(dot.get("cx", "nan")) <= WIDTH for dot in drawn(svg).iter("circle"))


def test_a_limit_near_the_values_is_drawn_between_them_and_one_far_away_is_told() -> None:
    near = line_chart(Language.ENGLISH, "n", SPAN, marks(10, 20), (None, 15.0))
    (line,) = [path.get("d") or "" for path in drawn(near).iter("path") if path.get("class") == "limit"]
    assert float(line.split()[1].partition("H")[0]) == pytest.approx(sum(heights(near)) / 2, abs=0.1)
    far = line_chart(Language.ENGLISH, "n", SPAN, marks(10, 20), (None, 4e6))
    assert 'class="limit"' not in far
    assert "limit: at most 4\u00a0000\u00a0000, beyond the picture" in far


def test_a_time_without_jobs_breaks_the_line() -> None:
    seen = marks(10, 11, 12, 13)
    later = [replace(mark, time=mark.time + timedelta(hours=9)) for mark in seen[2:]]
    assert line_chart(Language.ENGLISH, "n", SPAN, [*seen[:2], *later]).count('class="mean"') == 2


def test_equal_and_single_values_are_drawn() -> None:
    for values in ([5.0], [0.0]):
        seen = [Mark(BEGIN, value, value, value) for value in values]
        assert len(heights(line_chart(Language.RUSSIAN, "n", SPAN, seen))) == 1


def test_bars_are_as_high_as_their_counts() -> None:
    bars = [Bar(BEGIN, {"accepted": 3, "refused": 1}), Bar(BEGIN + timedelta(hours=1), {"accepted": 0, "failed": 2})]
    found = [
        (one.get("class"), float(one.get("height", "0")))
        for one in drawn(bar_chart(Language.ENGLISH, "n", SPAN, bars)).iter("rect")
    ]
    unit = found[1][1]
    assert [(kind, round(height / unit)) for kind, height in found] == [("accepted", 3), ("refused", 1), ("failed", 2)]


def nasty_history() -> History:
    """What a damaged or edited journal might hold."""
    bucket = Bucket(BEGIN)
    bucket.outcomes["refused"] = 2
    bucket.reasons.update({int(Reason.TOUCHES_BORDER): 1, 9999: 1})
    line = TrendLine(BEGIN, "verify", NASTY, 1, 0.1, 0.2, 0.3, 0.5, "pass")
    used = RecipeUsed(1, NASTY, {}, Use(2, BEGIN.isoformat(), BEGIN.isoformat()))
    return History(SPAN, (bucket,), bucket, (used,), (), {(NASTY, NASTY): 3}, (line,))


@pytest.mark.parametrize("language", list(Language))
def test_nothing_of_a_journal_becomes_markup_and_an_unknown_reason_is_its_number(language: Language) -> None:
    orders = [Note("t", NASTY, "a", NASTY, None, None), Note("t", None, "a", "halt", None, None)]
    for text in (shift_report(language, nasty_history(), orders), trends_page(language, "auto", nasty_history(), "")):
        assert "<script" not in text
        assert "&lt;script&gt;" in text
        assert "<td>9999</td>" in text
        assert Reason.TOUCHES_BORDER.explained(language).next_action in html.unescape(text)
        for svg in re.findall(r"<svg.*?</svg>", text):
            drawn(svg)


def test_both_languages_have_the_same_words_with_the_same_places() -> None:
    assert TEXTS["en"].keys() == TEXTS["ru"].keys()
    for key, english in TEXTS["en"].items():
        places = [sorted(re.findall(r"\{\w+\}", text)) for text in (english, TEXTS["ru"][key])]
        assert places[0] == places[1], key


@pytest.mark.parametrize(
    ("value", "english", "russian"),
    [
        (0.12345, "0.123", "0,123"),
        (1234567.0, "1\u00a0234\u00a0567", "1\u00a0234\u00a0567"),
        (0, "0", "0"),
        (float("nan"), "–", "–"),
        (None, "–", "–"),
        (-12.345, "-12.3", "-12,3"),
    ],
)
def test_numbers_are_written_as_people_write_them(value: float | None, english: str, russian: str) -> None:
    assert (number(Language.ENGLISH, value), number(Language.RUSSIAN, value)) == (english, russian)


def test_steps_of_time_are_told_in_their_largest_unit() -> None:
    assert [lasting(Language.ENGLISH, seconds) for seconds in (60, 1800, 21_600, 172_800)] == [
        "1 min",
        "30 min",
        "6 h",
        "2 d",
    ]
