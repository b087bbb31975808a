"""Trends and shift reports of a running daemon: figures of its own journal, by page, REST interface and command."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

from service.cli.main import main
from service.daemon.missed_watch import PERIOD_S
from service.web.trend_models import Trends
from tests.support.interop.programs import node_modules
from tests.support.processes.cell import ON_SAMPLES, SAMPLES, Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.page_panel import EXPECTED_NOISE, chromium, clean_page
from tests.support.processes.processes import free_port, until

RECIPE = "{number: 1, name: sheet, max_uncertainty_mm: 5, min_area_mm2: 100, max_area_mm2: 4000000}"
LOOSE = "{number: 2, name: giant, min_area_mm2: 3000000, max_area_mm2: 4000000}"

AXE = """axe.run(document).then(found => found.violations
    .filter(one => ["serious", "critical"].includes(one.impact))
    .map(one => `${one.id}: ${one.nodes[0].html.slice(0, 200)}`))"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Cell, Client]]:
    """A daemon that has accepted, refused and missed something, and been checked."""
    folder, port = tmp_path_factory.mktemp("trends"), free_port()
    token_file(folder)
    more = f"page: {{port: {port}, token_file: tokens}}\nrecipes: [{RECIPE}, {LOOSE}]\n"
    cell = Cell(folder, triggers="[]", camera=ON_SAMPLES, trigger_every_s=None, more=more)
    client = Client(port)
    try:
        cell.ready()
        for recipe in (1, 1, 2):
            job = until(lambda r=recipe: _ordered(client, r), what="an order that is taken")  # type: ignore[misc]
            until(lambda n=job: client.get(f"/api/v1/jobs/{n}").json["outcome"], what="its end")  # type: ignore[misc]
        client.order("/api/v1/halt")
        assert client.order("/api/v1/trigger").status == 409, "missed"
        client.order("/api/v1/resume")
        check(folder)
        until(lambda: _missed(cell.journal), PERIOD_S * 6, "what was missed, in the journal")
        yield cell, client
    finally:
        cell.stop()


def _ordered(client: Client, recipe: int) -> int | None:
    reply = client.order("/api/v1/trigger", content={"recipe": recipe})
    return reply.json["job"] if reply.status == 202 else None


def _missed(journal: Path) -> int:
    database = sqlite3.connect(f"file:{journal}?mode=ro", uri=True)
    try:
        return int(database.execute("SELECT COALESCE(SUM(count), 0) FROM missed").fetchone()[0])
    finally:
        database.close()


def check(folder: Path) -> None:
    """The weekly check of a sample against itself, beside the daemon."""
    picture, config = str(SAMPLES / "2-l-shape.jpg"), str(folder / "config.yaml")
    assert main(["trace", picture, "--config", config, "--json", str(folder / "master.json")]) == 0
    assert main(["verify", "--outline", str(folder / "master.json"), "--config", config, picture]) == 0


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = chromium(playwright)
        yield started
        started.close()


def test_figures_are_those_of_the_jobs(served: tuple[Cell, Client]) -> None:
    client = served[1]
    told = Trends.model_validate(client.get("/api/v1/trends?hours=24").json)
    jobs = client.get("/api/v1/jobs?limit=200").json["jobs"]
    ended = [str(bucket) for one in told.buckets for bucket, count in one.outcomes.items() for _ in range(count)]
    assert sorted(ended) == sorted(job["outcome"] for job in jobs) == ["accepted", "accepted", "refused"]
    assert {reason.code for one in told.buckets for reason in one.reasons} == {112}
    areas = [one.figures["area_mm2"] for one in told.buckets if "area_mm2" in one.figures]
    assert max(area.most for area in areas) == max(job["report"]["area_mm2"] for job in jobs)
    assert [(use.number, use.name, use.jobs) for use in told.recipes] == [(1, "sheet", 2), (2, "giant", 1)]
    assert [(one.kind, one.reason, one.count) for one in told.missed] == [("page", "not_ready", 1)]
    assert [(one.kind, one.verdict) for one in told.checks] == [("verify", "pass")]
    only = Trends.model_validate(client.get("/api/v1/trends?recipe=1").json)
    assert only.limits["uncertainty_mm"].most == 5
    assert [use.number for use in only.recipes] == [1]


@pytest.mark.parametrize(
    "asked", ["from=yesterday", "hours=0", "hours=99999999", "from=2030-01-01", "recipe=x", "from=0001-01-01", "to=1e9"]
)
def test_a_time_that_is_none_is_refused_in_a_sentence(served: tuple[Cell, Client], asked: str) -> None:
    for path in ("/api/v1/trends", "/trends", "/trends/report"):
        reply = served[1].get(f"{path}?{asked}")
        assert reply.status == 400
        assert "expected" in reply.json["error"]


def test_a_time_without_jobs_is_a_page_that_says_so(served: tuple[Cell, Client]) -> None:
    reply = served[1].get("/trends?from=2020-01-01T00:00&to=2020-01-02T00:00Z")
    assert reply.status == 200
    assert "No jobs in this span." in reply.body.decode()


@pytest.mark.parametrize("width", [390, 1280, 3840])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_page_links_to_trends_which_are_drawn_in_both_languages(
    served: tuple[Cell, Client], browser: Browser, width: int, theme: str
) -> None:
    url = served[1].url
    with clean_page(browser, url, EXPECTED_NOISE, locale="en-GB", color_scheme=theme) as page:
        page.set_viewport_size({"width": width, "height": 1000})
        page.get_by_role("link", name="Trends").press("Enter")  # what arrives above moves it from under a mouse
        page.get_by_role("link", name="1 sheet").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("Trends")
        expect(page.locator("svg")).to_have_count(7)
        expect(page.get_by_role("img", name="Uncertainty, mm")).to_contain_text("limit: at most 5")
        assert page.locator("svg .dot").count() >= 6
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        ink = page.locator("svg .dot").first.evaluate("e => getComputedStyle(e).fill")
        assert ink == ("rgb(124, 196, 238)" if theme == "dark" else "rgb(10, 92, 138)"), "the style applies"
        small = "[...document.querySelectorAll('a')].filter(a => a.offsetHeight < 40).length"
        assert page.evaluate(small) == 0
        page.context.add_cookies([{"name": "language", "value": "ru", "url": url}])
        page.reload()
        expect(page.get_by_role("heading", level=1)).to_have_text("Ход показателей")
        page.get_by_role("link", name="Отчёт, последние 8 ч").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("Отчёт за смену")


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("path", ["trends?recipe=1", "trends/report"])
def test_axe_core_finds_nothing_serious(
    served: tuple[Cell, Client], browser: Browser, path: str, theme: Literal["light", "dark"]
) -> None:
    axe = (node_modules() / "axe-core" / "axe.min.js").read_text()
    for width in (390, 1920):
        with clean_page(browser, served[1].url, EXPECTED_NOISE, color_scheme=theme) as page:
            page.goto(f"{served[1].url}{path}")
            page.set_viewport_size({"width": width, "height": 900})
            page.evaluate(axe)
            assert page.evaluate(AXE) == []


def test_the_report_of_the_page_is_whole_in_itself_printable_and_names_nobody(
    served: tuple[Cell, Client], browser: Browser
) -> None:
    client = served[1]
    reply = client.get("/trends/report?hours=8")
    text = reply.body.decode()
    policy = reply.headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    assert "unsafe" not in policy
    assert not re.findall(r"<script|<link|<img|src=|url\(|\son\w+=|style=", text)
    assert "anna" not in text
    with clean_page(browser, f"{client.url}trends/report?hours=8") as page:
        expect(page.locator(".counts")).to_contain_text("2accepted")
        assert page.locator("section").first.evaluate("e => getComputedStyle(e).paddingLeft") == "10px", "style applies"
        sheet = page.pdf(prefer_css_page_size=True)
    assert len(re.findall(rb"/Type\s*/Page\b", sheet)) <= 2


def test_the_command_writes_the_same_report_with_names(served: tuple[Cell, Client], tmp_path: Path) -> None:
    cell, client = served
    output = tmp_path / "shift.html"
    words = ["report", "--config", str(cell.folder / "config.yaml"), "--output", str(output)]
    assert main(words) == 0
    text, page = output.read_text(), client.get("/trends/report?hours=8").body.decode()
    of_page, of_command = (re.findall(r"<section class=\"wide\">.*?</section>", one) for one in (page, text))
    assert of_page == of_command
    assert len(of_page) == 5
    assert "<td>anna</td><td>halt</td>" in text
    assert "Check that the right block lies there, or the recipe." in text
    assert main([*words, "--language", "ru"]) == 0
    assert "Проверьте, та ли заготовка" in output.read_text()
    begin = (datetime.now(UTC) - timedelta(days=9)).isoformat()
    assert main([*words, "--from", begin, "--to", "8d"]) == 0
    assert "Check that the right block" not in output.read_text()


@pytest.mark.parametrize("more", [["--from", "1h", "--to", "2h"], ["--output", "/nowhere/shift.html"]])
def test_a_report_that_cannot_be_is_one_clear_line(
    served: tuple[Cell, Client], more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", "--config", str(served[0].folder / "config.yaml"), *more]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_whoever_asks_for_too_much_at_once_is_told_to_come_again(served: tuple[Cell, Client]) -> None:
    with ThreadPoolExecutor(24) as threads:
        replies = list(threads.map(lambda _: served[1].get("/trends?hours=87600"), range(48)))
    assert {reply.status for reply in replies} <= {200, 503}
    assert any(reply.status == 200 for reply in replies)
    assert all(reply.headers["retry-after"] == "5" for reply in replies if reply.status == 503)
    assert served[1].get("/trends").status == 200, "nobody's turn is lost"
