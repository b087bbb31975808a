"""The operator's page in every state: sizes, languages and themes, judged by what is drawn and by axe-core."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.support.interop.programs import node_modules
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client
from tests.support.processes.page_faults import AXE, FAULTS
from tests.support.processes.page_states import WIDTHS, play, states, tell

BIG_PX = 56  # of letters, on a screen of 1920 × 1080, that are read from two metres
CUT = """() => [...document.querySelectorAll("#live-values dd")]
  .filter((one) => one.scrollWidth > one.clientWidth || !one.clientWidth).map((one) => `cut off: ${one.textContent}`)"""
# A capital letter's height, as the font draws it.
CAPITALS = """(id) => {
  const style = getComputedStyle(document.getElementById(id));
  const context = document.createElement("canvas").getContext("2d");
  context.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
  return context.measureText("H").actualBoundingBoxAscent;
}"""


@pytest.fixture(scope="module")
def told(cell: tuple[Cell, Client], browser: Browser) -> dict[str, dict[str, Any] | None]:
    """What the page is told in each state."""
    return states(cell[1].get("/api/v1/state").json)


@pytest.fixture(scope="module")
def played(cell: tuple[Cell, Client], browser: Browser) -> Iterator[Page]:
    """The page, which hears what a test tells it."""
    context = browser.new_context(locale="en-GB", bypass_csp=True)  # so that axe-core may be put into it
    play(context)
    page = context.new_page()
    page.goto(cell[1].url)
    page.wait_for_function("Boolean(window.played?.onmessage)")
    yield page
    context.close()


def spoken(page: Page, language: str) -> None:
    """Have the page speak it."""
    if page.evaluate("document.documentElement.lang") != language:
        page.locator("#language").click()


@pytest.mark.parametrize("language", ["en", "ru"])
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_cut_off_or_without_a_name(
    played: Page, told: dict[str, dict[str, Any] | None], width: int, language: str
) -> None:
    played.set_viewport_size({"width": width, "height": WIDTHS[width]})
    spoken(played, language)
    wrong = {}
    for name, state in told.items():
        tell(played, state)
        if faults := played.evaluate(FAULTS):
            wrong[name] = faults
    assert wrong == {}


def test_state_and_result_are_read_from_two_metres(played: Page, told: dict[str, dict[str, Any] | None]) -> None:
    played.set_viewport_size({"width": 1920, "height": 1080})
    spoken(played, "en")
    tell(played, told["accepted"])
    heights = {name: played.evaluate(CAPITALS, name) for name in ("last-word", "state")}
    assert min(heights.values()) >= BIG_PX, heights
    largest = "Math.max(...[...document.querySelectorAll('body *')].map(e => parseFloat(getComputedStyle(e).fontSize)))"
    own = "parseFloat(getComputedStyle(document.getElementById('last-word')).fontSize)"
    assert played.evaluate(largest) == played.evaluate(own), "nothing is larger than what became of the last block"


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_core_finds_nothing_serious(played: Page, told: dict[str, dict[str, Any] | None], theme: str) -> None:
    played.evaluate((node_modules() / "axe-core" / "axe.min.js").read_text())
    played.evaluate("(theme) => { document.documentElement.dataset.theme = theme; }", theme)
    kinds = [
        "starting",
        "no job yet",
        "measuring",
        "accepted",
        "refused edge_covered",
        "failed",
        "error",
        "halted",
        "lost",
    ]
    found = {}
    for number, name in enumerate(kinds):
        width = list(WIDTHS)[number % len(WIDTHS)]
        played.set_viewport_size({"width": width, "height": WIDTHS[width]})
        spoken(played, ("en", "ru")[number % 2])
        tell(played, told[name])
        if serious := played.evaluate(AXE):
            found[name, width] = serious
    played.evaluate("document.documentElement.dataset.theme = 'auto'")
    assert found == {}


DIALOGS = {"token-dialog": "#trigger", "help-dialog": "#help", "lease-dialog": ""}


@pytest.mark.parametrize("language", ["en", "ru"])
@pytest.mark.parametrize("width", WIDTHS)
def test_the_live_view_and_dialogs_are_whole_and_axe_core_finds_nothing_serious(
    cell: tuple[Cell, Client], browser: Browser, width: int, language: str
) -> None:
    context = browser.new_context(
        locale=language, bypass_csp=True, color_scheme="dark", viewport={"width": width, "height": WIDTHS[width]}
    )
    page = context.new_page()
    page.goto(cell[1].url)
    page.wait_for_selector("#trigger:enabled")
    page.evaluate((node_modules() / "axe-core" / "axe.min.js").read_text())
    page.locator("#live").click()
    page.wait_for_selector('#live-verdict[data-kind="accepted"]')
    wrong = {"live": page.evaluate(FAULTS) + page.evaluate(AXE) + page.evaluate(CUT)}
    page.evaluate("document.getElementById('by-person').hidden = false")
    for dialog, opener in DIALOGS.items():
        if opener:
            page.locator(opener).click()
        else:
            page.evaluate("(id) => document.getElementById(id).showModal()", dialog)
        page.wait_for_selector(f"#{dialog}[open]")
        wrong[dialog] = page.evaluate(FAULTS) + page.evaluate(AXE)
        page.keyboard.press("Escape")
    context.close()
    assert {name: faults for name, faults in wrong.items() if faults} == {}


def test_in_a_kiosk_there_is_the_picture_the_result_the_state_and_two_orders(
    cell: tuple[Cell, Client], browser: Browser
) -> None:
    page = browser.new_page(viewport={"width": 1920, "height": 1080})
    page.goto(f"{cell[1].url}?kiosk")
    page.wait_for_selector("#trigger:enabled")
    shown = (
        "[...document.querySelectorAll('button, select, a, summary')].filter(e => e.checkVisibility()).map(e => e.id)"
    )
    assert page.evaluate(shown) == ["trigger", "halt"]
    for visible in ("#last-word", "#state", "#frame"):
        assert page.locator(visible).is_visible()
    assert page.evaluate("document.documentElement.scrollHeight <= innerHeight")
    page.close()


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("language", ["en", "ru"])
@pytest.mark.parametrize("width", WIDTHS)
def test_setting_up_is_whole_and_axe_core_finds_nothing_serious(
    cell: tuple[Cell, Client], browser: Browser, width: int, language: str, theme: str
) -> None:
    context = browser.new_context(
        locale=language, bypass_csp=True, color_scheme=theme, viewport={"width": width, "height": WIDTHS[width]}
    )
    page = context.new_page()
    page.route("**/api/v1/commission", lambda route: route.fulfill(json=under_way(route.fetch().json())))
    page.goto(f"{cell[1].url}commission")
    page.wait_for_selector("#shots li")
    page.wait_for_selector("#halt:enabled")
    page.evaluate((node_modules() / "axe-core" / "axe.min.js").read_text())
    wrong = page.evaluate(FAULTS) + page.evaluate(AXE)
    page.unroute_all(behavior="wait")
    context.close()
    assert wrong == []


def under_way(told: dict[str, Any]) -> dict[str, Any]:
    """Commissioning half done: each kind of step, picture and fault at once."""
    faults = ["the picture cannot be kept: a_very_long_path/of/a/file/that/nobody/can/break " * 2, None]
    for number, step in enumerate(told["steps"]):
        step.update(score=11 * number, well=number % 3 == 0, fault=faults[number % 2], lines=["One line", "x" * 120])
    shot = {"number": 1, "flat": True, "serves": True, "corners": 70, "why": None}
    unfit = {"number": 2, "flat": False, "serves": False, "corners": 0, "why": "only 5 of the board's 70 corners"}
    zones = [[row * column % 3 for column in range(16)] for row in range(12)]
    points = [[24.93, 249.3, 1236.55, -29.61]]
    return told | {"shots": [shot, unfit], "zones": zones, "points": points, "reported": True, "changes": {"port": 503}}
