"""The operator's page in a real browser: for each file of tests a daemon and a browser, for each test a page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.page_panel import BOUND_MS, EXPECTED_NOISE, PANEL, Panel, chromium
from tests.support.processes.processes import free_port


@pytest.fixture(scope="module")
def camera() -> str:
    """What the daemon sees: small drawn combs, where a file of tests has no camera of its own."""
    return ""


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, camera: str) -> Iterator[tuple[Cell, Client]]:
    """A daemon that is starting, and measures when its page asks; and who asks past a browser."""
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    token_file(folder)
    more = f"page: {{port: {port}, token_file: tokens}}\n"
    started = Cell(folder, triggers="[]", camera=camera, trigger_every_s=None, more=more)
    try:
        yield started, Client(port)
    finally:
        started.stop()


@pytest.fixture(scope="module")
def browser(cell: tuple[Cell, Client]) -> Iterator[Browser]:
    """Chromium, which starts beside the daemon; both are ready then."""
    with sync_playwright() as playwright:
        started = chromium(playwright)
        cell[0].ready()
        yield started
        started.close()


@pytest.fixture
def panel(cell: tuple[Cell, Client], browser: Browser) -> Iterator[Panel]:
    """The page, opened anew; nothing but the expected may go wrong in it, and nothing be loaded from elsewhere."""
    page = browser.new_page(viewport=PANEL, has_touch=True, locale="en-GB")
    page.set_default_timeout(BOUND_MS)
    opened = Panel(*cell, page)
    url = opened.client.url
    page.on("console", lambda message: message.type == "error" and opened.complaints.append(message.text))
    page.on("pageerror", lambda error: opened.complaints.append(str(error)))
    page.on("request", lambda request: opened.asked.append(request.url))
    page.goto(url)
    yield opened
    page.close()
    assert [one for one in opened.complaints if not any(noise in one for noise in EXPECTED_NOISE)] == []
    assert [one for one in opened.asked if not one.startswith(url)] == [], "nothing is loaded from elsewhere"
