"""The report holds what the table says, in both languages, and nothing of an archive becomes markup."""

from __future__ import annotations

import json
import re
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path

import pytest

from service.reasons import Language
from service.records.evidence import Flaw
from service.replays.report.conditions import condition
from service.replays.report.histogram import EDGES_MM, counts_by_shift
from service.replays.report.page import RunTold, report
from service.replays.report.summary import WORST, Summary
from service.replays.rows import COLUMNS, Row
from service.replays.run import WorkerFigures
from service.replays.run_files import schema
from service.replays.thumbnails import Thumbnails
from service.replays.work import Lost
from tests.support.real_parts import CLUSTER, need_module

TEXTS = json.loads((files("service.replays.report") / "static" / "texts.json").read_text(encoding="utf-8"))
NASTY = "<script>alert(1)</script>"
TOLD = RunTold(
    "combtrace 0.0.9 (old.whl)",
    {"recipe.tolerance_mm": "0.2"},
    {"a": "s3://plant/a"},
    [condition("flips>2"), condition("max_shift_mm>9")],
    {"vm:7": WorkerFigures(40, 10.0, 123.0)},
    {"tcp://b:1": "has opencv 4.13.0, expected opencv 5.0.0"},
)


def row(job_id: int, **changes: object) -> Row:
    known: Row = {
        **dict.fromkeys(COLUMNS),
        "cell": "a",
        "job_id": job_id,
        "archived_as": "accepted",
        "recipe": 1,
        "recipe_name": "core",
        "taken_at": datetime(2026, 3, 1 + job_id % 28, tzinfo=UTC),
        "outcome_before": "accepted",
        "outcome_after": "accepted",
        "flipped": False,
        "identical": False,
        "distance_mm": 0.01 * job_id,
        "combtrace_before": "0.0.9",
        "combtrace_after": "0.1.0",
        "total_ms_after": 50.0,
        "worker": "vm:7",
    }
    return {**known, **changes}


def out(job_id: int, kind: str, text: str = "why") -> Row:
    return {**dict.fromkeys(COLUMNS), "cell": "a", "job_id": job_id, "left_out": kind, "left_out_text": text}


ROWS = [
    *(row(number, identical=number % 2 == 0) for number in range(1, 41)),
    row(41, flipped=True, outcome_after="refused", reason_after=112, text_after=NASTY, distance_mm=None),
    row(42, flipped=True, outcome_after="refused", reason_after=112, text_after="too large", cell="b"),
    row(43, flipped=True, outcome_before="refused", reason_before=110, recipe_name="x", distance_mm=None),
    out(44, Flaw.FRAME_DAMAGED),
    out(45, Flaw.NOTHING_MEASURED),
    out(46, Flaw.FRAME_DAMAGED, NASTY),
]


@pytest.fixture
def summary(tmp_path: Path) -> Summary:
    need_module("pyarrow.parquet", CLUSTER).write_table(
        need_module("pyarrow", CLUSTER).Table.from_pylist(ROWS, schema()), tmp_path / "rows.parquet"
    )
    return Summary.of(tmp_path / "rows.parquet")


def test_a_table_is_added_up_by_flip_shift_kind_and_group(summary: Summary) -> None:
    figures = summary.figures()
    assert (figures["jobs"], figures["left_out"], figures["flips"]) == (46, 2, 3)
    assert (figures["sent_to_refused"], figures["refused_to_sent"], figures["changed"]) == (2, 1, 23)
    assert figures["flips_share"] == pytest.approx(3 / 43)
    assert figures["max_shift_mm"] == pytest.approx(0.42)
    assert figures["p50_shift_mm"] == pytest.approx(0.21)
    assert summary.left_out == {Flaw.FRAME_DAMAGED: 2, Flaw.NOTHING_MEASURED: 1}
    assert summary.flip_counts == {(112, True): 2, (110, False): 1}
    assert [one["job_id"] for one in summary.worst] == [42, *range(40, 40 - WORST + 1, -1)]
    assert {name: one.jobs for name, one in summary.groups["cell"].items()} == {"a": 45, "b": 1}
    assert {name: one.jobs for name, one in summary.groups["month"].items()} == {"2026-03": 43, "–": 3}
    assert {name: one.flips for name, one in summary.groups["recipe"].items()} == {"1 core": 2, "1 x": 1, "–": 0}


def test_of_a_table_without_a_done_job_nothing_is_told_by_shifts(tmp_path: Path) -> None:
    need_module("pyarrow.parquet", CLUSTER).write_table(
        need_module("pyarrow", CLUSTER).Table.from_pylist([out(1, Flaw.STORAGE)], schema()), tmp_path / "rows.parquet"
    )
    figures = Summary.of(tmp_path / "rows.parquet").figures()
    assert figures["p99_shift_mm"] is figures["flips_share"] is None
    assert figures["left_out"] == 1


@pytest.mark.parametrize("language", list(Language))
def test_the_report_tells_it_with_pictures_and_needs_no_other_file(summary: Summary, language: Language) -> None:
    asked: list[int] = []

    def draw(one: Row) -> Thumbnails | None:
        asked.append(one["job_id"])
        return None if one["job_id"] == 42 else Thumbnails(b"before", b"after", b"place")

    page = report(language, summary, TOLD, draw)
    assert asked == [41, 42, 43, *(one["job_id"] for one in summary.worst)]
    assert page.count('src="data:image/jpeg;base64,') == 3 * (len(asked) - 2)
    assert not re.search(r'(?:src|href)="(?!data:)', page)
    assert NASTY not in page
    assert "112" in page
    assert TEXTS[language]["frame_damaged"] in page
    assert "has opencv 4.13.0, expected opencv 5.0.0" in page
    assert TEXTS[language]["met"] in page
    assert TEXTS[language]["not_met"] in page
    assert f'lang="{language}"' in page


def test_bars_count_each_shift_once() -> None:
    shifts = [0.0, 0.0, 0.0004, 0.001, 0.5, 99.0, 100.0, 1000.0]
    bars = dict(counts_by_shift(shifts))
    assert sum(bars.values()) == len(shifts)
    assert (bars["0"], bars["< 0.001"], bars["0.001–0.002"], bars["0.5–1"]) == (2, 1, 1, 1)
    assert (bars["50–100"], bars["≥ 100"]) == (1, 2)
    assert list(EDGES_MM) == sorted(set(EDGES_MM))


def test_both_languages_say_the_same_things_and_know_each_kind() -> None:
    assert TEXTS["en"].keys() == TEXTS["ru"].keys()
    assert {str(kind) for kind in (*Flaw, *Lost)} <= TEXTS["en"].keys()
    for key, text in TEXTS["en"].items():
        assert sorted(re.findall(r"{\w+}", text)) == sorted(re.findall(r"{\w+}", TEXTS["ru"][key])), key
