"""The trend file and its plot: every check drawn with its limit, old files read, a broken line named and left out."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from service.cli.main import main
from service.measuring.trend_file import TrendFileError, TrendLine, append_trend, read_trend
from service.measuring.trend_plot import trend_svg

BEGIN = datetime(2026, 3, 1, 8, tzinfo=UTC)
OLD = """time,check,calibration,pictures,mean_mm,p95_mm,worst_mm,limit_mm,verdict
2026-03-01T08:00:00+00:00,verify,sha256:aaaaaaaa,3,0.0500,0.1000,0.1200,0.3,pass
2026-03-08T08:00:00+00:00,repeat,sha256:aaaaaaaa,25,0.0100,0.0200,0.0400,0.3,pass
"""


def line(week: int, worst_mm: float, *, check: str = "verify", limit_mm: float = 0.3, file: str = "a") -> TrendLine:
    verdict = "pass" if worst_mm <= limit_mm else "fail"
    time = BEGIN + timedelta(weeks=week)
    return TrendLine(time, check, file, 3, worst_mm / 3, worst_mm / 2, worst_mm, limit_mm, verdict)


def drawn(lines: list[TrendLine], kind: str) -> list[ET.Element]:
    return [one for one in ET.fromstring(trend_svg(lines)).iter() if one.get("class") == kind]


def test_an_old_file_is_read_and_grows(tmp_path: Path) -> None:
    path = tmp_path / "trend.csv"
    path.write_text(OLD)
    append_trend(path, line(2, 0.2))
    trend = read_trend(path)
    assert [one.worst_mm for one in trend.lines] == [0.12, 0.04, 0.2]
    assert trend.lines[2] == replace(line(2, 0.2), mean_mm=0.0667)
    last = trend.last("repeat")
    assert last is not None
    assert last.pictures == 25
    assert trend.skipped == ()


@pytest.mark.parametrize(
    ("broken", "expected"),
    [
        ("2026-03-09T08:00:00+00:00,verify,sha256:a,3,0.05,0.1,lots,0.3,pass", "worst_mm is 'lots'"),
        ("2026-03-09T08:00:00+00:00,verify,sha256:a,3,0.05,0.1,nan,0.3,pass", "worst_mm is 'nan'"),
        ("2026-03-09T08:00:00+00:00,verify,sha", "3 columns, expected 9"),
        ("yesterday,verify,sha256:a,3,0.05,0.1,0.1,0.3,pass", "time is 'yesterday'"),
        ("2026-03-09T08:00:00+00:00,verify,sha256:a,3,0.05,0.1,0.1,0.3,perhaps", "verdict is 'perhaps'"),
        ("\x00\xff", "1 columns"),
    ],
)
def test_a_broken_line_is_named_and_left_out_and_stays(tmp_path: Path, broken: str, expected: str) -> None:
    path = tmp_path / "trend.csv"
    path.write_text(OLD + broken, encoding="latin-1")
    append_trend(path, line(3, 0.2))
    trend = read_trend(path)
    assert [one.worst_mm for one in trend.lines] == [0.12, 0.04, 0.2]
    (text,) = trend.skipped
    assert f"{path}: line 4 is left out: {expected}" in text
    assert path.read_bytes().startswith((OLD + broken).encode("latin-1"))


def test_a_file_that_is_no_trend_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "trend.csv"
    path.write_text("a,b\n1,2\n")
    with pytest.raises(TrendFileError, match="is no trend file, its columns are a, b"):
        read_trend(path)
    assert read_trend(tmp_path / "none.csv").lines == ()


def test_each_check_is_drawn_at_its_height_against_its_limit() -> None:
    lines = [line(0, 0.1), line(1, 0.2), line(2, 0.4), line(1, 0.05, check="repeat", limit_mm=0.1)]
    assert len(drawn(lines, "pass")) == 3
    (failed,) = drawn(lines, "fail")
    first, second = drawn(lines, "pass")[:2]
    heights = [float(one.get("cy", "nan")) for one in (first, second, failed)]
    assert heights[0] - heights[1] == pytest.approx((heights[1] - heights[2]) / 2, abs=0.2)
    verify, _ = drawn(lines, "limit")
    limit = float(re.findall(r"V([\d.]+)", verify.get("d", ""))[0])
    assert heights[1] > limit > heights[2]
    assert limit == pytest.approx((heights[1] + heights[2]) / 2, abs=0.2)
    assert "repeat: 1 checks" in trend_svg(lines)


def test_a_limit_that_was_changed_and_a_new_calibration_are_seen() -> None:
    lines = [line(0, 0.1), line(1, 0.1, limit_mm=0.2, file="b"), line(2, 0.1, limit_mm=0.2, file="b")]
    (limit,) = drawn(lines, "limit")
    assert len(set(re.findall(r"V([\d.]+)", limit.get("d", "")))) == 2
    assert len(drawn(lines, "new")) == 1


@pytest.mark.parametrize("lines", [[line(0, 0.0, limit_mm=0.3)], [line(0, 0.1)] * 3, []])
def test_one_check_many_at_once_and_none_are_drawn_too(lines: list[TrendLine]) -> None:
    text = trend_svg(lines)
    assert ET.fromstring(text).tag.endswith("svg")
    assert "nan" not in text


def test_verify_writes_the_plot_beside_its_trend(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples = Path(__file__).parents[3] / "service" / "samples"
    picture, calibration = str(samples / "2-l-shape.jpg"), ["--calibration", str(samples / "calibration.yaml")]
    master, trend = str(tmp_path / "master.json"), tmp_path / "trend.csv"
    assert main(["trace", picture, *calibration, "--json", master]) == 0
    trend.write_text(OLD + "torn")
    options = ["verify", "--outline", master, *calibration, "--trend"]
    assert main([*options, str(trend), picture]) == 0
    told = capsys.readouterr()
    assert "line 4 is left out: 1 columns, expected 9" in told.err
    assert "last time 0.120 mm" in told.out
    assert f"plot      {tmp_path / 'trend.svg'}" in told.out
    assert "verify: 2 checks" in (tmp_path / "trend.svg").read_text()
    assert main([*options, str(tmp_path / "trend.svg"), picture]) == 2
    assert "its plot would overwrite it" in capsys.readouterr().err
    (tmp_path / "trend.svg").unlink()
    (tmp_path / "trend.svg").mkdir()
    assert main([*options, str(trend), picture]) == 0
    assert "the line is in" in capsys.readouterr().err
