"""The operator's page in a real browser, Debian's Chromium: what a person sees and does, beside a running daemon."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, expect, sync_playwright

from service.reasons import Language, Reason
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import TOKEN, Client, token_file
from tests.support.processes.processes import free_port, until
from tests.support.real_parts import need_program

expect.set_options(timeout=60_000)  # a job on a busy machine
FRAME = "#view image:not([visibility])"  # not the one that is still to come
# What was seen together at each change of the picture: numbers of jobs whose frames show, the contour.
WATCH_PICTURE = """() => {
  window.together = [];
  const view = document.querySelector("#view");
  const look = () => window.together.push([
    [...view.querySelectorAll("image:not([visibility])")].map((image) => image.href.baseVal),
    view.querySelector("path.exterior")?.getAttribute("d") ?? "",
  ]);
  new MutationObserver(look).observe(view, {childList: true, attributes: true, subtree: true});
}"""
WATCH_OUTCOME = """() => {
  window.outcomes = [];
  const outcome = document.querySelector("#outcome");
  const watch = new MutationObserver(() => window.outcomes.push(outcome.textContent));
  watch.observe(outcome, {childList: true, characterData: true, subtree: true});
}"""
PANEL = {"width": 1280, "height": 800}
EXPECTED_NOISE = (
    "ERR_CONNECTION_REFUSED",
    "ERR_FAILED",
    "ERR_INCOMPLETE_CHUNKED_ENCODING",
    "401",
    "429",
    "503",
    "ERR_EMPTY_RESPONSE",
    "409",
)


@dataclass
class Panel:
    """A daemon, its page in a browser, and all that the browser complained of or asked for."""

    cell: Cell
    client: Client
    page: Page
    complaints: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.client.port}/"

    def ordered(self, **content: Any) -> int:
        """The number of a job that was ordered past the page, once its evidence is kept."""
        until(lambda: self.client.get("/api/v1/state").json["link"]["not_ready"] is None, what="a ready controller")
        reply = until(
            lambda: (r := self.client.order("/api/v1/trigger", content=content)).status == 202 and r, what="it"
        )
        number = reply.json["job"]
        until(lambda: self.client.get(f"/api/v1/jobs/{number}").json["files"], what="evidence")
        return int(number)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    path = need_program("chromium", "apt-get install chromium")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Cell, Client]]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    token_file(folder)
    more = f"page: {{port: {port}, token_file: tokens}}\n"
    started = Cell(folder, triggers="[]", camera=ON_SAMPLES, trigger_every_s=None, more=more)
    try:
        started.ready()
        yield started, Client(port)
    finally:
        started.stop()


@pytest.fixture
def panel(cell: tuple[Cell, Client], browser: Browser) -> Iterator[Panel]:
    page = browser.new_page(viewport=PANEL, has_touch=True, locale="en-GB")
    page.set_default_timeout(60_000)
    opened = Panel(*cell, page)
    page.on("console", lambda message: message.type == "error" and opened.complaints.append(message.text))
    page.on("pageerror", lambda error: opened.complaints.append(str(error)))
    page.on("request", lambda request: opened.asked.append(request.url))
    page.goto(opened.url)
    yield opened
    page.close()
    assert [one for one in opened.complaints if not any(noise in one for noise in EXPECTED_NOISE)] == []
    assert [url for url in opened.asked if not url.startswith(opened.url)] == [], "nothing is loaded from elsewhere"


def settled_state(panel: Panel, kind: str) -> None:
    expect(panel.page.locator("#banner")).to_have_attribute("data-kind", kind, timeout=60_000)


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


def test_the_server_says_the_state_before_any_script_runs(panel: Panel, browser: Browser) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(panel.url)
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


def test_the_page_weighs_less_than_150_kb_without_the_frame(panel: Panel, browser: Browser) -> None:
    page = browser.new_page()
    weights: dict[str, int] = {}
    page.on("response", lambda r: "/frames/" in r.url or "/events" in r.url or weights.update({r.url: len(r.body())}))
    page.goto(panel.url)
    expect(page.locator("#glance li")).to_have_count(4)
    page.wait_for_timeout(300)
    page.close()
    assert any(url.endswith("page.js") for url in weights)
    assert 20_000 < sum(weights.values()) < 150_000


def test_a_job_appears_by_itself_with_its_contour_and_values(panel: Panel) -> None:
    page = panel.page
    page.evaluate("window.sameDocument = true")
    for _ in range(4):  # one of the four pictures shows a block with holes
        number = panel.ordered()
        if panel.client.get(f"/api/v1/jobs/{number}/drawing").json["holes"]:
            break
    expect(page.locator("#outcome")).to_have_text(f"job {number}: accepted")
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{number}\?width=1600"))
    job = panel.client.get(f"/api/v1/jobs/{number}").json
    drawn = page.locator("#view path.exterior").get_attribute("d") or ""
    holes = [hole.get_attribute("d") or "" for hole in page.locator("#view path.hole").all()]
    assert sum(len(re.findall(r"[ML]", path)) for path in (drawn, *holes)) == job["report"]["vertices"]
    expect(page.locator("#values")).to_contain_text(f"{job['report']['area_mm2']:,.0f}")
    expect(page.locator("#values")).to_contain_text("±")
    expect(page.locator("#stages")).to_contain_text("contour")
    expect(page.locator(f'#strip button[data-job="{number}"]')).to_have_attribute("aria-current", "true")
    assert page.evaluate("window.sameDocument") is True


def frames_of(panel: Panel, contour: str) -> set[str]:
    """Addresses of the frames that one contour was seen with since `WATCH_PICTURE`."""
    together: list[tuple[list[str], str]] = panel.page.evaluate("window.together")
    assert all(len(frames) < 2 for frames, _ in together)
    return {frame for frames, drawn in together for frame in frames if drawn == contour}


def test_a_contour_is_never_seen_over_another_jobs_frame(panel: Panel) -> None:
    page = panel.page
    first = panel.ordered()
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{first}\?"))
    page.evaluate(WATCH_PICTURE)
    numbers = [panel.ordered() for _ in range(2)]
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{numbers[-1]}\?"))
    contour = page.locator("#view path.exterior").get_attribute("d") or ""
    assert {re.search(r"/frames/(\d+)", frame)[1] for frame in frames_of(panel, contour)} == {str(numbers[-1])}  # type: ignore[index]


@pytest.mark.parametrize("how", ["never comes", "is not there"])
def test_a_contour_whose_frame_does_not_come_is_shown_without_one(panel: Panel, how: str) -> None:
    page = panel.page
    first = panel.ordered()
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{first}\?"))
    before = page.locator("#view path.exterior").get_attribute("d") or ""
    held: list[Route] = []
    page.route("**/frames/*width=1600*", lambda route: held.append(route) if how == "never comes" else route.abort())
    number = panel.ordered()
    expect(page.locator("#outcome")).to_have_text(f"job {number}: accepted")
    expect(page.locator("#view path.exterior")).not_to_have_attribute("d", before)
    expect(page.locator(FRAME)).to_have_count(1)
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{number}\?"))
    for route in held:
        route.abort()


def test_hidden_parts_of_the_edge_are_told_from_what_was_seen(panel: Panel) -> None:
    """Seen is solid, bridged dashed, covered red, also where the contour was refused for it."""
    page = panel.page
    parts = [{"covered": covered, "points": [[300, y], [500, y]]} for covered, y in ((False, 200), (True, 300))]

    def with_parts(route: Route) -> None:
        drawing = route.fetch().json()
        route.fulfill(json={**drawing, "refused": True, "hidden": parts})

    page.route("**/drawing", with_parts)
    panel.ordered()
    expect(page.locator("#view path.covered")).to_have_attribute("d", "M300 300L500 300")
    expect(page.locator("#view path.covered")).to_have_css("stroke", "rgb(242, 32, 46)")
    expect(page.locator("#view path.bridged")).to_have_attribute("d", "M300 200L500 200")
    expect(page.locator("#view path.bridged")).to_have_css("stroke-dasharray", "6px, 6px")
    expect(page.locator("#view path.exterior")).to_have_css("stroke-dasharray", "none")
    page.unroute_all(behavior="wait")


def test_the_pointer_tells_millimetres_and_the_picture_zooms_and_moves(panel: Panel) -> None:
    page = panel.page
    number = panel.ordered()
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{number}\?"))
    document = panel.client.get(f"/api/v1/jobs/{number}/files/document.json").json["measurement"]
    (x, y), (x_mm, y_mm) = document["pixels"]["exterior"][0], document["millimetres"]["exterior"][0]
    to_screen = "([x, y]) => { const p = new DOMPoint(x, y).matrixTransform(view.getScreenCTM()); return [p.x, p.y]; }"
    for _ in range(3):
        place = page.evaluate(to_screen, [x, y])
        page.mouse.move(*place)
        told = re.fullmatch(r"x (-?[\d.,]+)  y (-?[\d.,]+) mm", page.locator("#cursor").text_content() or "")
        assert told is not None
        assert abs(float(told[1].replace(",", "")) - x_mm) < 0.6
        assert abs(float(told[2].replace(",", "")) - y_mm) < 0.6
        page.mouse.wheel(0, -100)
        page.wait_for_timeout(50)
    whole = page.locator("#view").get_attribute("viewBox")
    page.mouse.move(500, 350)
    page.mouse.wheel(0, -300)
    assert page.locator("#view").get_attribute("viewBox") != whole
    before = page.locator("#view").get_attribute("viewBox")
    page.mouse.down()
    page.mouse.move(450, 330)
    page.mouse.up()
    assert page.locator("#view").get_attribute("viewBox") != before
    page.locator("#frame").press("0")
    assert (page.locator("#view").get_attribute("viewBox") or "").startswith("-0.5 -0.5 ")


def test_the_filmstrip_freezes_filters_and_opens_one_with_all_its_values(panel: Panel, tmp_path: Path) -> None:
    page = panel.page
    good = panel.ordered()
    bad = panel.ordered(recipe=77)
    expect(page.locator("#outcome")).to_have_text(f"job {bad}: refused")
    expect(page.locator("#because")).to_contain_text(Reason.UNKNOWN_RECIPE.explained().next_action)
    expect(page.locator("#no-picture")).to_be_visible()
    page.locator(f'#strip button[data-job="{good}"]').click()
    expect(page.locator("#outcome")).to_have_text(f"job {good}: accepted")
    later = panel.ordered()
    expect(page.locator(f'#strip button[data-job="{later}"]')).to_be_visible()
    expect(page.locator("#outcome")).to_have_text(f"job {good}: accepted")
    expect(page.locator("#seen-note")).to_contain_text("frozen")
    with page.expect_download() as download:
        page.locator("#downloads a", has_text="document.json").click()
    download.value.save_as(tmp_path / "saved.json")
    assert (tmp_path / "saved.json").read_bytes() == panel.client.get(f"/api/v1/jobs/{good}/files/document.json").body
    page.locator("#freeze").click()
    expect(page.locator("#outcome")).to_have_text(f"job {later}: accepted")
    page.locator("#count-refused").tap()
    expect(page.locator("#counts")).to_contain_text(Reason.UNKNOWN_RECIPE.explained().sentence)
    page.keyboard.press("Escape")
    page.keyboard.press("r")
    expect(page.locator("#strip button")).to_have_count(len(page.locator("#strip [data-kind=refused]").all()))
    expect(page.locator("#outcome")).to_contain_text("refused")
    page.keyboard.press("r")
    expect(page.locator("#outcome")).to_have_text(f"job {later}: accepted")
    page.keyboard.press("ArrowRight")
    expect(page.locator("#outcome")).to_have_text(f"job {bad}: refused")
    page.keyboard.press("Escape")
    expect(page.locator("#outcome")).to_have_text(f"job {later}: accepted")


def test_a_wrong_token_is_told_and_a_right_one_measures_halts_and_resumes(panel: Panel) -> None:
    page = panel.page
    settled_state(panel, "ready")
    before = panel.client.get("/api/v1/state").json["settled_job"]
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
    page.locator("#trigger").click()
    expect(page.locator("#told")).to_contain_text(Reason.NOT_READY.explained().sentence)
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


def holding(routes: list[Route]) -> Callable[[Route], None]:
    """Requests wait in the list."""

    def hold(route: Route) -> None:
        routes.append(route)

    return hold


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


def test_a_job_that_comes_late_is_not_shown_in_place_of_the_one_opened_since(panel: Panel) -> None:
    page = panel.page
    slow, quick, newest = panel.ordered(), panel.ordered(), panel.ordered()
    expect(page.locator("#outcome")).to_have_text(f"job {newest}: accepted")
    held: list[Route] = []
    page.route(f"**/jobs/{slow}/drawing", holding(held))
    with page.expect_request(f"**/jobs/{slow}/drawing"):
        page.locator(f'#strip button[data-job="{slow}"]').click()
    page.locator(f'#strip button[data-job="{quick}"]').click()
    expect(page.locator("#outcome")).to_have_text(f"job {quick}: accepted")
    page.evaluate(WATCH_OUTCOME)
    with page.expect_response(f"**/jobs/{slow}/drawing"):
        held.pop().continue_()
    page.wait_for_timeout(200)
    assert page.evaluate("window.outcomes") == []
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{quick}\?"))


def test_older_jobs_are_shown_and_where_there_are_none_nothing_changes(panel: Panel) -> None:
    page = panel.page
    while len(panel.client.get("/api/v1/jobs?limit=17").json["jobs"]) < 17:
        panel.ordered(recipe=77)
    jobs = [job["job_id"] for job in panel.client.get("/api/v1/jobs?limit=200").json["jobs"]]
    expect(page.locator("#strip button").first).to_have_attribute("data-job", str(jobs[0]))
    page.locator("#older").click()
    expect(page.locator("#strip button").first).to_have_attribute("data-job", str(jobs[16]))
    expect(page.locator("#outcome")).to_contain_text(f"job {jobs[16]}:")
    page.locator("#newest").click()
    expect(page.locator("#strip button").first).to_have_attribute("data-job", str(jobs[0]))
    page.route("**/jobs?limit=16&before=*", lambda route: route.fulfill(json={"jobs": []}))
    with page.expect_response("**/jobs?limit=16&before=*"):
        page.locator("#older").click()
    page.wait_for_timeout(200)
    expect(page.locator("#strip button")).to_have_count(16)
    expect(page.locator("#outcome")).to_contain_text(f"job {jobs[0]}:")
    later = panel.ordered()
    expect(page.locator("#outcome")).to_have_text(f"job {later}: accepted")


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
