"""The operator's page in a real browser: for each file of tests a daemon and a browser, for each test a page."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, sync_playwright

from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client, people_file, token_file
from tests.support.processes.page_panel import EXPECTED_NOISE, Panel, chromium, clean_page
from tests.support.processes.processes import free_port


@pytest.fixture(scope="module")
def camera() -> str:
    """What the daemon sees: small drawn combs, where a file of tests has no camera of its own."""
    return ""


@pytest.fixture(scope="module")
def pins() -> dict[str, str]:
    """PINs of people, by name: none, where a file of tests has no people of its own."""
    return {}


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, camera: str, pins: dict[str, str]) -> Iterator[tuple[Cell, Client]]:
    """A daemon that is starting, and measures when its page asks; and who asks past a browser."""
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    token_file(folder)
    people = ", people_file: people" if people_file(folder, pins) else ""
    more = f"page: {{port: {port}, token_file: tokens{people}}}\n"
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
    """The page, opened anew."""
    with clean_page(browser, cell[1].url, EXPECTED_NOISE, has_touch=True, locale="en-GB") as page:
        yield Panel(*cell, page)
