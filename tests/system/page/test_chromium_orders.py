"""The operator's page in a real browser: how a person gives it orders, and what becomes of them."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, Route, expect

from tests.support.processes.page_client import TOKEN
from tests.support.processes.page_panel import Panel, holding, settled_state


def test_a_wrong_token_is_told_and_a_right_one_measures_halts_and_resumes(panel: Panel) -> None:
    page = panel.page
    settled_state(panel, "ready")
    before = panel.ordered(recipe=77)  # numbers go up by one, from one that is drawn
    page.locator("#trigger").click()
    page.locator("#token").fill("guessed")
    page.keyboard.press("Enter")
    expect(page.locator("#token-told")).to_have_text("The token is not known.")
    assert panel.client.get("/api/v1/state").json["settled_job"] == before
    page.locator("#token").fill(TOKEN)
    page.locator("#token-ok").click()
    expect(page.locator("#told")).to_have_text(f"job {before + 1}: accepted")
    expect(page.locator("#outcome")).to_have_text(f"job {before + 1}: accepted")
    page.locator("#halt").click()
    settled_state(panel, "halted")
    expect(page.locator("#whys")).to_contain_text("anna from 127.0.0.1")
    expect(page.locator("#whys strong")).to_have_text("Somebody halted it.")
    expect(page.locator("#resume")).to_be_focused()
    expect(page.locator("#told")).to_have_text("Halted. Nothing is measured until you resume.")
    expect(page.locator("#trigger")).to_be_disabled()
    expect(page.locator("#resume")).to_have_text("Resume")
    page.keyboard.press("m")
    expect(page.locator("#told")).to_have_text("Halted. Nothing is measured until you resume.")
    page.locator("#resume").click()
    settled_state(panel, "ready")
    page.locator("#halt").click()
    expect(page.locator("#told")).to_have_text("Halted. Nothing is measured until you resume.")
    settled_state(panel, "halted")
    assert panel.client.order("/api/v1/resume").status == 200  # by somebody else
    settled_state(panel, "ready")
    expect(page.locator("#told")).to_have_text("")
    stored = page.evaluate("[document.cookie, JSON.stringify(localStorage), JSON.stringify(sessionStorage)].join()")
    assert TOKEN not in stored


def given_token(page: Page) -> None:
    """The page knows who gives orders."""
    page.locator("#trigger").click()
    page.locator("#token").fill(TOKEN)
    page.keyboard.press("Enter")
    expect(page.locator("#told")).to_have_text(re.compile(r"job \d+: accepted"))


def test_a_key_held_down_and_a_double_tap_are_one_order_each(panel: Panel) -> None:
    page = panel.page
    settled_state(panel, "ready")
    given_token(page)
    orders: list[Route] = []
    page.route("**/api/v1/trigger", holding(orders))
    for _ in range(5):  # the browser repeats a key that is down
        page.keyboard.down("m")
    page.locator("#trigger").dblclick()
    expect(page.locator("#told")).to_have_text("Sending the order…")
    page.wait_for_timeout(200)
    assert len(orders) == 1
    orders.pop().continue_()
    expect(page.locator("#told")).to_have_text(re.compile(r"job \d+: accepted"))
    for _ in range(5):  # still held, and nothing under way
        page.keyboard.down("m")
    page.wait_for_timeout(100)
    page.keyboard.up("m")
    assert orders == []
    page.locator("#trigger").dblclick()
    page.wait_for_timeout(100)
    assert len(orders) == 1
    orders.pop().continue_()
    expect(page.locator("#told")).to_have_text(re.compile(r"job \d+: accepted"))


@pytest.mark.parametrize(
    ("status", "place", "text"),
    [
        (401, "#token-told", "Такого ключа нет."),
        (429, "#told", "Подождите минуту."),
        (503, "#told", "Служба сейчас не может"),
    ],
)
def test_an_order_that_is_refused_is_told_in_the_readers_language(
    panel: Panel, status: int, place: str, text: str
) -> None:
    page = panel.page
    page.route(
        "**/api/v1/trigger",
        lambda route: route.fulfill(status=status, json={"error": "no", "code": None, "name": None}),
    )
    expect(page.locator("#trigger")).to_be_enabled()
    page.locator("#language").click()
    page.locator("#trigger").click()
    page.locator("#token").fill("whatever")
    page.keyboard.press("Enter")
    expect(page.locator(place)).to_contain_text(text)


def test_where_no_orders_can_be_given_that_is_said_before_anybody_presses(panel: Panel) -> None:
    page = panel.page

    def without_orders(route: Route) -> None:
        answer = route.fetch()
        route.fulfill(response=answer, body=answer.text().replace('data-orders="on"', 'data-orders="off"'))

    page.route(panel.client.url, without_orders)
    page.reload()
    expect(page.locator("#told")).to_have_text("No orders can be given from here. Call the engineer.")
    for order in ("#trigger", "#halt", "#recipe"):
        expect(page.locator(order)).to_be_disabled()
    page.keyboard.press("m")
    expect(page.locator("#token-dialog")).to_be_hidden()
    page.locator("#language").click()
    expect(page.locator("#told")).to_contain_text("Отсюда команды")
