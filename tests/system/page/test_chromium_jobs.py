"""The operator's page in a real browser: what a person sees of jobs, large and in the filmstrip."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Route, expect

from service.reasons import Reason
from service.web import models
from tests.support.processes.cell import SAMPLES
from tests.support.processes.page_panel import FRAME, Panel, holding

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


@pytest.fixture(scope="module")
def camera(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The sample pictures; the last one, a block with holes, comes first."""
    folder = tmp_path_factory.mktemp("camera")
    *others, with_holes = sorted(SAMPLES.glob("*.jpg"))
    for number, sample in enumerate([with_holes, *others]):
        (folder / f"{number}.jpg").symlink_to(sample)
    return f"{{kind: files, path: {folder}, loop: true}}"


def test_before_any_job_it_says_that_there_was_none(panel: Panel) -> None:
    page = panel.page
    expect(page.locator("#last-word")).to_have_text("no job yet")
    expect(page.locator("#no-picture")).to_have_text("No jobs.")
    page.locator("#language").click()
    expect(page.locator("#no-picture")).to_have_text("Заданий нет.")


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
    (first,) = panel.accepted(1)
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{first}\?"))
    page.evaluate(WATCH_PICTURE)
    numbers = [panel.ordered() for _ in range(2)]
    expect(page.locator(FRAME)).to_have_attribute("href", re.compile(rf"/frames/{numbers[-1]}\?"))
    contour = page.locator("#view path.exterior").get_attribute("d") or ""
    assert {re.search(r"/frames/(\d+)", frame)[1] for frame in frames_of(panel, contour)} == {str(numbers[-1])}  # type: ignore[index]


@pytest.mark.parametrize("how", ["never comes", "is not there"])
def test_a_contour_whose_frame_does_not_come_is_shown_without_one(panel: Panel, how: str) -> None:
    page = panel.page
    (first,) = panel.accepted(1)
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


def test_hidden_parts_of_the_edge_and_what_speaks_against_it_are_told_from_what_was_seen(panel: Panel) -> None:
    """Seen is solid, bridged dashed, covered red, also where the contour was refused for it."""
    page = panel.page
    parts = [{"covered": covered, "points": [[300, y], [500, y]]} for covered, y in ((False, 200), (True, 300))]

    def with_parts(route: Route) -> None:
        drawing = route.fetch().json()
        route.fulfill(json={**drawing, "refused": True, "hidden": parts, "shown": [[[20, 30], [40, 50]]]})

    page.route("**/drawing", with_parts)
    panel.ordered()
    expect(page.locator("#view path.covered")).to_have_attribute("d", "M300 300L500 300")
    expect(page.locator("#view path.covered")).to_have_css("stroke", "rgb(242, 32, 46)")
    expect(page.locator("#view path.bridged")).to_have_attribute("d", "M300 200L500 200")
    expect(page.locator("#view path.bridged")).to_have_css("stroke-dasharray", "6px, 6px")
    expect(page.locator("#view path.exterior")).to_have_css("stroke-dasharray", "none")
    expect(page.locator("#view path.shown")).to_have_attribute("d", "M20 30L40 50")
    expect(page.locator("#view path.shown")).to_have_css("stroke", "rgb(255, 225, 77)")
    page.unroute_all(behavior="wait")


def test_the_part_is_drawn_and_the_slider_tells_what_another_margin_would_do(panel: Panel) -> None:
    page = panel.page
    square = [[300, 200], [400, 200], [400, 300], [300, 300]]
    part = {
        "exterior": square, "holes": [], "tightest": [[300, 250], [280, 250]], "fits": True,
        "margin_mm": 8.0, "asked_mm": 3.0, "needed_mm": 3.5, "px_per_mm": 2.5,
    }  # fmt: skip

    def with_part(route: Route) -> None:
        route.fulfill(json={**route.fetch().json(), "part": part, "ribbon": [[310, 220], [390, 280]]})

    page.route("**/drawing", with_part)
    panel.ordered()
    expect(page.locator("#view path.part-outline")).to_have_attribute("d", "M300 200L400 200L400 300L300 300Z")
    expect(page.locator("#view path.part-tightest")).to_have_attribute("d", "M300 250L280 250")
    expect(page.locator("#view path.ribbon")).to_have_attribute("d", "M310 220L390 280")
    expect(page.locator("#view path.part-margin")).to_have_attribute("stroke-width", "17.5")
    expect(page.locator("#part-told")).to_have_text(
        "The part fits with a margin of 3.0\u00a0mm: 8.00\u00a0mm is there."
    )
    page.locator("#part-margin").fill("9.5")
    expect(page.locator("#part-told")).to_contain_text("short by 2.00\u00a0mm")
    expect(page.locator("#view path.part-margin")).to_have_attribute("stroke-width", "50")
    for _ in range(2):  # shown anew, as a job is whenever something of it is told, and back again
        page.locator("#language").click()
        expect(page.locator("#part-margin")).to_have_value("9.5")
        expect(page.locator("#view path.part-margin")).to_have_attribute("stroke-width", "50")
    page.unroute_all(behavior="wait")
    panel.ordered()
    expect(page.locator("#part")).to_be_hidden()
    expect(page.locator("#view path.part-outline")).to_have_count(0)


def test_several_parts_are_drawn_with_their_numbers_and_what_found_no_room_is_told(panel: Panel) -> None:
    page = panel.page

    def part(number: int, left: float, margin_mm: float) -> dict[str, object]:
        square = [[left, 200], [left + 100, 200], [left + 100, 300], [left, 300]]
        return {
            "exterior": square, "holes": [], "tightest": [[left, 250], [left, 180]], "fits": True,
            "margin_mm": margin_mm, "asked_mm": 3.0, "needed_mm": 3.5, "px_per_mm": 2.5,
            "number": number, "middle": [left + 50, 250], "file": f"{number}.dxf",
        }  # fmt: skip

    parts = [part(1, 300, 8.0), part(1, 450, 4.25), part(2, 600, 5.5)]
    wanted = [{"number": number, "file": f"{number}.dxf", "quantity": 2} for number in (1, 2, 3)]

    def with_parts(route: Route) -> None:
        route.fulfill(json={**route.fetch().json(), "parts": parts, "wanted": wanted})

    page.route("**/drawing", with_parts)
    panel.ordered()
    expect(page.locator("#view path.part-outline")).to_have_count(3)
    expect(page.locator("#view path.part-tightest").nth(2)).to_have_attribute("d", "M600 250L600 180")
    expect(page.locator("#view path.part-margin").nth(1)).to_have_attribute("stroke-width", "17.5")
    expect(page.locator("#view .part-number")).to_have_text(["1", "1", "2"])
    laid = page.locator("#laid li")
    expect(laid).to_have_text(
        [
            "Part 1, 1.dxf: 2 of 2 laid, with 4.25\u00a0mm or more.",
            "Part 2, 2.dxf: 1 of 2 laid, with 5.50\u00a0mm or more.",
            "Part 3, 3.dxf: none of 2 laid.",
        ]
    )
    assert [one.get_attribute("data-kind") for one in laid.all()] == ["all", "short", "short"]
    page.locator("#language").click()
    expect(laid.last).to_have_text("Деталь 3, 3.dxf: не уложено ни одной из 2.")
    page.locator("#language").click()
    page.unroute_all(behavior="wait")
    panel.ordered()
    expect(page.locator("#laid")).to_be_hidden()
    expect(page.locator("#view .part-number")).to_have_count(0)


def test_the_pointer_tells_millimetres_and_the_picture_zooms_and_moves(panel: Panel) -> None:
    page = panel.page
    (number,) = panel.accepted(1)
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


def test_a_job_that_comes_late_is_not_shown_in_place_of_the_one_opened_since(panel: Panel) -> None:
    page = panel.page
    slow, quick, newest = panel.accepted(3)
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


def test_the_filmstrip_freezes_filters_and_opens_one_with_all_its_values(panel: Panel, tmp_path: Path) -> None:
    page = panel.page
    (good,) = panel.accepted(1)
    bad = panel.ordered(recipe=77)
    expect(page.locator("#outcome")).to_have_text(f"job {bad}: refused")
    expect(page.locator("#last-word")).to_have_text("refused")
    expect(page.locator("#last-of")).to_contain_text(f"job {bad}, ")
    expect(page.locator("#last-why")).to_contain_text(Reason.UNKNOWN_RECIPE.explained().next_action)
    expect(page.locator("#because")).to_contain_text("unknown_recipe")
    expect(page.locator("#no-picture")).to_have_text("No picture is kept of this job.")
    expect(page.locator(f'#strip button[data-job="{bad}"]')).to_contain_text("no picture")
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
    panel.client.order("/api/v1/halt")
    panel.client.order("/api/v1/trigger")
    expect(page.locator("#count-missed")).to_have_text("1")
    panel.client.order("/api/v1/resume")
    expect(page.locator("#state")).to_have_text("Ready")  # what is said of the halt goes, and what is below moves up
    page.locator("#count-missed").tap()
    expect(page.locator("#counts")).to_contain_text(f"this page: {Reason.NOT_READY.explained().sentence}")
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


def test_why_a_block_was_refused_is_told_with_its_figures_in_the_readers_language(panel: Panel) -> None:
    page = panel.page

    def refused(route: Route) -> None:
        answer = route.fetch()
        seen = "The contour's area is 31 mm², the recipe expects 4000 to 90000 mm². "
        seen += "Check that the block is the recipe's, and the lighting."
        area = {"outcome": "refused", "reason": int(Reason.AREA_OUT_OF_LIMITS), "detail": seen}
        told = models.Job.model_validate({**answer.json()["jobs"][0], "ru": {}, **area})
        route.fulfill(response=answer, json={"jobs": [told.model_dump(mode="json")]})

    panel.ordered()
    page.route("**/api/v1/jobs?**", refused)
    page.reload()
    expect(page.locator("#because small")).to_contain_text("area is 31 mm², the recipe expects")
    page.locator("#language").click()
    expect(page.locator("#because small")).to_contain_text("Площадь контура 31 мм², по рецепту от 4000 до 90000 мм².")


def test_a_halts_words_are_told_in_the_readers_language_before_any_script_runs(panel: Panel) -> None:
    assert panel.client.order("/api/v1/halt", content={"reason": "blade"}).status == 200
    try:
        expect(panel.page.locator("#whys small")).to_have_text("halted: blade (anna from 127.0.0.1)")
        panel.page.locator("#language").click()
        expect(panel.page.locator("#whys small")).to_have_text("остановлено: blade (anna, адрес 127.0.0.1)")
        made = panel.client.get("/", Cookie="language=ru").body.decode()
        assert "остановлено: blade (anna, адрес 127.0.0.1)" in made
    finally:
        assert panel.client.order("/api/v1/resume").status == 200
