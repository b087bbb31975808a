"""The page of recipes in a real browser: a change is tried, looked at, adopted, and taken back."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, expect, sync_playwright

from tests.support.interop.programs import node_modules
from tests.support.processes.page_faults import AXE, FAULTS
from tests.support.processes.page_panel import EXPECTED_NOISE, chromium, clean_page
from tests.support.processes.page_states import WIDTHS
from tests.support.processes.recipes_cell import BETWEEN, PICTURES, RecipesCell, served_recipes, token


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecipesCell]:
    with served_recipes(tmp_path_factory.mktemp("recipes")) as built:
        yield built


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        opened = chromium(playwright)
        yield opened
        opened.close()


def given(page: Page, key: str, value: str) -> None:
    """Type a key's value."""
    page.locator(f'.key:has(code:text-is("{key}")) input').fill(value)


def test_a_change_is_tried_adopted_used_by_the_next_job_and_taken_back(served: RecipesCell, browser: Browser) -> None:
    url = f"{served.client.url}recipes"
    with clean_page(browser, served.client.url, EXPECTED_NOISE, locale="en-GB") as page:
        page.get_by_role("link", name="Recipes").press("Enter")  # what arrives above moves it from under a mouse
        expect(page).to_have_url(url)
        expect(page.locator("#try")).to_be_disabled()
        given(page, "max_area_mm2", str(BETWEEN))
        expect(page.locator(".key.changed small")).to_have_text("was 200000")
        page.locator("#try").click()
        page.locator("#person").select_option("")
        page.locator("#token").fill(token("person1"))
        page.locator("#token-ok").click()
        page.locator("#take-over").fill("the recipe is changed")  # for person0 gave the orders before
        page.locator("#lease-ok").click()
        expect(page.locator("#summary")).to_contain_text(f"All {PICTURES} jobs were tried. Verdicts that flip: 1 acc")
        expect(page.locator("#tried > li")).to_have_count(PICTURES)
        flipped = page.locator("#tried > li.flipped")
        expect(flipped).to_have_count(1)
        expect(flipped).to_contain_text("accepted → refused flips112 The contour's area is outside")
        calm = page.locator("#tried > li:not(.flipped)").first
        expect(calm).to_contain_text("accepted → acceptedThe outline stays the same.")
        for card in (flipped, calm):  # both outlines are drawn, each twice: a line and what lies under it
            expect(card.locator("path")).to_have_count(4)
            assert card.locator("path.was").get_attribute("d") == card.locator("path.now").get_attribute("d")
        assert served.recipe()["values"]["max_area_mm2"] == 200_000, "nothing counts yet"
        calm.locator("button").click()
        expect(page.locator("#large path.now")).to_have_count(1)
        page.keyboard.press("Escape")
        page.locator("#adopt").click()
        assert page.locator("#adopt-told").text_content() == "", "not without a note"
        page.locator("#note").fill("sheets of the new press are smaller")
        page.locator("#adopt").click()
        expect(page.locator("#adopt-told")).to_contain_text("It counts from the next job on.")
        expect(page.locator("#history")).to_contain_text("person1: sheets of the new press are smaller")
        expect(page.locator("#adopt")).to_be_disabled()
        after = served.jobs(PICTURES, "person1")
        assert {job["recipe"]["max_area_mm2"] for job in after} == {BETWEEN}
        assert sorted(job["outcome"] for job in after) == ["accepted"] * (PICTURES - 1) + ["refused"]
        page.locator("#language").click()
        expect(page.locator("#edit .dim")).to_contain_text("Изменение сначала пробуют")
        expect(page.locator("#tried > li.flipped")).to_contain_text("по рецепту от 100 до 90000 мм²")
        expect(page.locator("#history")).to_contain_text("Как в файле настроек")  # drawn anew, or a click is lost
        page.locator("#note").fill("the press is gone")
        page.locator('[data-back="0"]').click()
        expect(page.locator("#history")).to_contain_text("person1: the press is gone")
        expect(page.locator("#adopt-told")).to_contain_text("Действует со следующего задания.")
    assert {job["recipe"]["max_area_mm2"] for job in served.jobs(1, "person1")} == {200_000}
    notes = [(note["action"], note["detail"], note["result"]) for note in served.notes("person1")]
    adopted = [note for note in notes if note[0] == "adopt recipe"]
    assert adopted[1][1] == "recipe 1: max_area_mm2 200000.0 -> 90000.0; sheets of the new press are smaller"
    assert adopted[0][1] == "recipe 1: max_area_mm2 90000.0 -> 200000.0; back to 0: the press is gone"
    assert [note[2].split(", ")[1] for note in adopted] == ["from the next job on"] * 2
    assert ("try recipe", f"recipe 1: max_area_mm2 200000.0 -> 90000.0; on {PICTURES} jobs", "begun") in notes


def test_the_form_has_a_control_of_its_kind_for_each_key_and_sends_what_differs(
    served: RecipesCell, browser: Browser
) -> None:
    typed = {
        "start": ("[10, 20.5]", [10, 20.5]),
        "binarize": ("otsu", "otsu"),
        "roi_mm": ("[0, 0, 600, 400]", [0, 0, 600, 400]),
        "gcode.safe_z_mm": ("35", 35),
        "parts.0.layer": ("cut", "cut"),
        "parts.0.quantity": ("1", 1),
        "parts.0.rotation": ("4", 4),
    }
    sent: list[Any] = []

    def keep(route: Route) -> None:
        sent.append(route.request.post_data_json)
        route.fulfill(status=422, json={"error": "max_bridged_mm: seen 'x'", "ru": {"max_bridged_mm: seen 'x'": "икс"}})

    with clean_page(browser, served.client.url, (*EXPECTED_NOISE, "422"), locale="en-GB") as page:
        page.goto(f"{served.client.url}recipes")
        page.route("**/api/v1/recipes/2/trial", keep)
        page.get_by_role("button", name="2 other").click()
        expect(page.locator("#edit-title")).to_have_text("2 other")
        keys = page.locator("#keys-of .key code").all_text_contents()
        assert sorted(keys) == sorted(served.recipe(2)["values"])
        expect(page.locator(".key.changed")).to_have_count(0)
        expect(page.locator("legend")).to_have_text(["gcode", "parts.0: plate.geojson"])
        for key, (text, _) in typed.items():
            given(page, key, text)
        page.locator('.key:has(code:text-is("edge")) select').select_option("cut")
        page.get_by_role("checkbox", name="svg").check()
        given(page, "tolerance_mm", "-1")
        page.locator("#try").click()
        assert sent == [], "the browser knows the bound"
        given(page, "tolerance_mm", "0.1")
        page.locator("#language").click()
        expect(page.locator(".key.changed")).to_have_count(len(typed) + 2)
        page.locator("#try").click()
        page.locator("#person").select_option("")
        page.locator("#token").fill(token("person11"))
        page.locator("#token-ok").click()
        expect(page.locator("#told")).to_have_text("Так нельзя. (икс)")
        page.locator("#undo").click()
        expect(page.locator(".key.changed")).to_have_count(0)
        page.get_by_role("button", name="1 sheet").click()
        expect(page.locator(".key.changed")).to_have_count(0)
    expected = {**{key: value for key, (_, value) in typed.items()}, "edge": "cut", "exports": ["dxf", "svg"]}
    assert sent == [{"changes": expected, "jobs": 20}]


TOO_SMALL = """() => [...document.querySelectorAll("button, select, input, a")]
  .filter((one) => one.checkVisibility() && one.offsetHeight < 24).map((one) => `too small: ${one.outerHTML}`)"""


@pytest.fixture(scope="module")
def tried(served: RecipesCell) -> RecipesCell:
    """With a way back, and verdicts that flip."""
    served.adopted("person10", {"margin_mm": 6})
    served.tried("person10", {"max_area_mm2": BETWEEN})
    return served


@pytest.mark.parametrize("language", ["en", "ru"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_page_is_whole_and_axe_core_finds_nothing_serious(
    tried: RecipesCell, browser: Browser, theme: str, language: str
) -> None:
    context = browser.new_context(locale=language, bypass_csp=True)
    page = context.new_page()
    page.emulate_media(color_scheme="dark" if theme == "dark" else "light")
    page.goto(f"{tried.client.url}recipes")
    expect(page.locator("#tried path.now")).to_have_count(PICTURES)
    given(page, "margin_mm", "7")
    page.evaluate((node_modules() / "axe-core" / "axe.min.js").read_text())
    wrong = {}
    for width, height in WIDTHS.items():
        page.set_viewport_size({"width": width, "height": height})
        if faults := page.evaluate(FAULTS) + page.evaluate(TOO_SMALL) + page.evaluate(AXE):
            wrong[width] = faults
    context.close()
    assert wrong == {}
