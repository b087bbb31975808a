"""The operator's page in a real browser, Debian's Chromium: how it loads, and what it says of the service's state."""

from __future__ import annotations

import os
import signal
import time

from playwright.sync_api import Browser, Route, expect

from service.reasons import Language, Reason
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client
from tests.support.processes.page_panel import Panel, holding, settled_state
from tests.support.processes.processes import until


def test_the_first_view_tells_state_in_words_colour_and_shape_and_every_part(panel: Panel) -> None:
    page = panel.page
    settled_state(panel, "ready")
    expect(page.locator("#state")).to_have_text("Ready")
    expect(page.locator("#shape use")).to_have_attribute("href", "#s-ready")
    assert page.locator("#state").evaluate("e => getComputedStyle(e).color") == "rgb(0, 107, 74)"
    expect(page.locator("#glance li")).to_have_count(4)
    expect(page.locator("#glance")).to_contain_text("modbus-tcp 127.0.0.1")
    expect(page.locator("#why")).to_be_hidden()
    assert page.evaluate("document.documentElement.scrollHeight <= innerHeight"), "all fits on the panel"
    small = "[...document.querySelectorAll('button')].filter(b => b.offsetParent && b.offsetHeight < 40).map(b => b.id)"
    assert page.evaluate(small) == []


def test_the_server_says_the_state_before_any_script_runs(cell: tuple[Cell, Client], browser: Browser) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(cell[1].url)
    expect(page.locator("#state")).to_have_text("Ready")
    expect(page.locator("#trigger")).to_have_text("Measure")
    context.close()


def test_no_control_can_be_pressed_before_the_script_hears_it(panel: Panel) -> None:
    page = panel.page
    held: list[Route] = []
    page.route("**/static/page.js", holding(held))
    page.reload()
    expect(page.locator("#state")).to_have_text("Ready")
    assert (
        page.locator("main button:enabled, header button:enabled, footer button:enabled, #recipe:enabled").count() == 0
    )
    held.pop().continue_()
    expect(page.locator("#trigger")).to_be_enabled()
    assert page.locator("button:disabled").count() == 0


def test_a_service_that_answers_too_late_while_the_page_loads_is_told_and_asked_again(panel: Panel) -> None:
    page = panel.page
    expect(page.locator("#trigger")).to_be_enabled()  # this page has asked already
    page.route("**/api/v1/reasons", lambda route: route.abort(), times=1)
    page.reload()
    settled_state(panel, "lost")
    settled_state(panel, "ready")
    expect(page.locator("#trigger")).to_be_enabled()


def test_the_page_weighs_less_than_150_kb_without_the_frame(cell: tuple[Cell, Client], browser: Browser) -> None:
    page = browser.new_page()
    weights: dict[str, int] = {}
    page.on("response", lambda r: "/frames/" in r.url or "/events" in r.url or weights.update({r.url: len(r.body())}))
    page.goto(cell[1].url)
    expect(page.locator("#glance li")).to_have_count(4)
    page.wait_for_timeout(300)
    page.close()
    assert any(url.endswith("page.js") for url in weights)
    assert 20_000 < sum(weights.values()) < 150_000


def test_the_language_is_switched_without_a_reload_and_kept(panel: Panel) -> None:
    page = panel.page
    number = panel.ordered()
    expect(page.locator("#outcome")).to_have_text(f"job {number}: accepted")
    page.evaluate("window.sameDocument = true")
    page.locator("#language").click()
    expect(page.locator("#state")).to_have_text("Готов")
    expect(page.locator("#outcome")).to_have_text(f"задание {number}: принято")
    expect(page.locator("#seen-title")).to_contain_text("Заготовка и контур")
    expect(page.locator("#values")).to_contain_text("мм²")
    assert page.locator("#zoom-in").get_attribute("aria-label") == "Крупнее"
    assert page.evaluate("[document.documentElement.lang, window.sameDocument]") == ["ru", True]
    (cookie,) = page.context.cookies()
    assert (cookie["name"], cookie["value"], cookie["sameSite"]) == ("language", "ru", "Strict")
    with page.expect_response("**/static/texts.json"):  # asked for by the script that hears keys
        page.reload()
    expect(page.locator("#trigger")).to_have_text("Измерить")
    page.keyboard.press("l")
    expect(page.locator("#trigger")).to_have_text("Measure")


def test_what_keeps_it_from_ready_and_a_lost_daemon_are_shown_and_neither_stays_green(panel: Panel) -> None:
    page, cell = panel.page, panel.cell
    settled_state(panel, "ready")
    cell.controller.kill()
    settled_state(panel, "fault")
    lost = Reason.CONTROLLER_LOST
    expect(page.locator("#whys strong")).to_have_text(lost.explained().sentence)
    page.locator("#language").click()
    expect(page.locator("#whys")).to_contain_text(lost.explained(Language.RUSSIAN).next_action)
    expect(page.locator("#state")).to_have_text("Не готов")
    cell.controller = cell.start_controller()
    settled_state(panel, "ready")
    cell.service.kill()
    killed_at = time.monotonic()
    settled_state(panel, "lost")
    assert time.monotonic() - killed_at < 15
    expect(page.locator("#state")).to_have_text("Нет связи со службой")
    expect(page.locator("body")).to_have_class("stale")
    expect(page.locator("#trigger")).to_be_disabled()
    expect(page.locator("#recipe option").first).to_have_text("обычный")
    page.locator("#language").click()
    expect(page.locator("#recipe option").first).to_have_text("usual")
    page.keyboard.press("m")
    expect(page.locator("#token-dialog")).to_be_hidden()
    cell.service = cell.start_service()
    settled_state(panel, "ready")
    expect(page.locator("body")).not_to_have_class("stale")


def test_a_daemon_that_stands_still_is_lost_too(panel: Panel) -> None:
    settled_state(panel, "ready")
    expect(panel.page.locator("#since")).to_contain_text("for ")  # heard of, and not only made by the server
    os.kill(panel.cell.service.process_id, signal.SIGSTOP)
    try:
        settled_state(panel, "lost")
    finally:
        os.kill(panel.cell.service.process_id, signal.SIGCONT)
    until(lambda: panel.page.locator("#banner").get_attribute("data-kind") != "lost", what="it to be heard of again")
