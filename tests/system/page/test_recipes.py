"""Recipes on the page of a running daemon: tried on archived jobs, adopted, taken back; and what is refused."""

from __future__ import annotations

import http.client
import json
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, expect, sync_playwright

from service.web.recipes.models import RecipeList, TrialAnswer
from tests.support.interop.programs import node_modules
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import Client, Reply, people_file
from tests.support.processes.page_panel import EXPECTED_NOISE, chromium, clean_page
from tests.support.processes.page_states import WIDTHS
from tests.support.processes.processes import free_port, until

SHEET = "{number: 1, name: sheet, max_area_mm2: 200000}"
OTHER = "{number: 2, name: other, exports: [dxf], parts: [{file: plate.geojson, units: mm, quantity: 2}]}"
PLATE = {"type": "Polygon", "coordinates": [[[0, 0], [60, 0], [60, 40], [0, 40], [0, 0]]]}
PICTURES = 4  # whose blocks are 68 to 101 thousand mm²
BETWEEN = 90_000  # mm²: one of them is larger
PINS = {"maria": "4711", "oleg": "0815"}


def token(who: str) -> str:
    return f"{who}-has-a-token-of-her-own"


@dataclass
class Served:
    """A daemon with recipes, and who asks it. Each person may give thirty orders a minute: tests have their own."""

    cell: Cell
    client: Client

    def order(self, path: str, who: str, content: dict[str, Any]) -> Reply:
        body = {"take_over": "her own test", **content}
        return self.client.order(f"/api/v1/recipes/{path}", token(who), body)

    def jobs(self, count: int, who: str, recipe: int = 1) -> list[dict[str, Any]]:
        """So many more jobs, once their evidence is kept."""
        found = []
        for _ in range(count):
            content = {"recipe": recipe, "take_over": "her own test"}
            asked = until(
                lambda c=content: (r := self.client.order("/api/v1/trigger", token(who), c)).status == 202 and r,  # type: ignore[misc]
                what="a trigger that is taken",
                pause_s=0.3,
            )
            path = f"/api/v1/jobs/{asked.json['job']}"
            found.append(until(lambda p=path: (j := self.client.get(p).json)["files"] and j, what="evidence"))  # type: ignore[misc]
        return found

    def recipe(self, number: int = 1) -> dict[str, Any]:
        told = self.client.get("/api/v1/recipes").json
        return dict(next(one for one in told["recipes"] if one["number"] == number))

    def trial(self) -> dict[str, Any]:
        return dict(self.client.get("/api/v1/recipes/trial").json["trial"])

    def tried(self, who: str, changes: dict[str, Any], jobs: int = PICTURES) -> dict[str, Any]:
        """A try, come to its end."""
        begun = self.order("1/trial", who, {"changes": changes, "jobs": jobs})
        assert begun.status == 202, begun.body
        found = dict(until(lambda: (t := self.trial())["state"] != "running" and t, what="the end of a try"))
        assert found["number"] == begun.json["trial"]
        return found

    def adopted(self, who: str, changes: dict[str, Any]) -> int:
        trial = self.tried(who, changes, jobs=1)
        reply = self.order("1/adopt", who, {"trial": trial["number"], "note": "to begin with"})
        assert reply.status == 200, reply.body
        return int(reply.json["adoption"])

    def notes(self, who: str) -> list[dict[str, Any]]:
        """Newest first."""
        told = self.client.get("/api/v1/audit?limit=200", Authorization=f"Bearer {token(who)}").json["notes"]
        return [note for note in told if note["who"] == who]


def started(folder: Path, *names: str, more: str = "") -> Served:
    """A daemon with these people."""
    lines = "".join(f"{name} {token(name)}\n" for name in names)
    (folder / "tokens").touch(0o600)
    (folder / "tokens").write_text(lines)
    people_file(folder, PINS)
    (folder / "plate.geojson").write_text(json.dumps(PLATE))
    port = free_port()
    page = f"page: {{port: {port}, token_file: tokens, people_file: people}}\n"
    kept = "adopted_recipes: state/adopted.json\n"
    cell = Cell(
        folder,
        triggers="[]",
        camera=ON_SAMPLES,
        trigger_every_s=None,
        more=f"{page}{kept}recipes: [{SHEET}, {OTHER}]\n{more}",
    )
    cell.ready()
    return Served(cell, Client(port))


WHO = [f"person{number}" for number in range(12)]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    built = started(tmp_path_factory.mktemp("recipes"), *WHO)
    try:
        ended = built.jobs(PICTURES, WHO[0])
        assert [job["outcome"] for job in ended] == ["accepted"] * PICTURES
        yield built
    finally:
        built.cell.stop()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        opened = chromium(playwright)
        yield opened
        opened.close()


def given(page: Page, key: str, value: str) -> None:
    """Type a key's value."""
    page.locator(f'.key:has(code:text-is("{key}")) input').fill(value)


def test_a_change_is_tried_adopted_used_by_the_next_job_and_taken_back(served: Served, browser: Browser) -> None:
    url = f"{served.client.url}recipes"
    with clean_page(browser, served.client.url, EXPECTED_NOISE, locale="en-GB") as page:
        page.get_by_role("link", name="Recipes").click()
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
        page.locator("#note").fill("the press is gone")
        page.locator('[data-back="0"]').click()
        expect(page.locator("#adopt-told")).to_contain_text("Действует со следующего задания.")
    assert {job["recipe"]["max_area_mm2"] for job in served.jobs(1, "person1")} == {200_000}
    notes = [(note["action"], note["detail"], note["result"]) for note in served.notes("person1")]
    adopted = [note for note in notes if note[0] == "adopt recipe"]
    assert adopted[1][1] == "recipe 1: max_area_mm2 200000.0 -> 90000.0; sheets of the new press are smaller"
    assert adopted[0][1] == "recipe 1: max_area_mm2 90000.0 -> 200000.0; back to 0: the press is gone"
    assert [note[2].split(", ")[1] for note in adopted] == ["from the next job on"] * 2
    assert ("try recipe", f"recipe 1: max_area_mm2 200000.0 -> 90000.0; on {PICTURES} jobs", "begun") in notes


def test_the_form_has_a_control_of_its_kind_for_each_key_and_sends_what_differs(
    served: Served, browser: Browser
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


def test_where_the_outline_changes_both_are_told_apart_in_millimetres(served: Served) -> None:
    trial = served.tried("person2", {"margin_mm": 5})
    TrialAnswer.model_validate({"trial": trial})
    assert [job["flipped"] for job in trial["jobs"]] == [bool(job["code_before"]) for job in trial["jobs"]]
    assert {job["code_after"] for job in trial["jobs"]} == {0}
    assert all(4.9 < job["distance"] < 15 and job["unit"] == "mm" for job in trial["jobs"])
    assert all(job["area_mm2_after"] < job["area_mm2_before"] for job in trial["jobs"])
    job = trial["jobs"][0]["job_id"]
    was = served.client.get(f"/api/v1/jobs/{job}/drawing").json
    now = served.client.get(f"/api/v1/recipes/trial/{job}/drawing").json
    assert was["exterior"] != now["exterior"]
    assert now["size_mm"][0] < was["size_mm"][0]
    assert served.client.get("/api/v1/recipes/trial/1/drawing").status == 404


WRONG: dict[str, tuple[str, dict[str, Any], int, str]] = {
    "out of bounds": ("1", {"changes": {"tolerance_mm": -1}}, 422, "expected 0 or more"),
    "no number": ("1", {"changes": {"tolerance_mm": "wide"}}, 422, "expected a number"),
    "not finite": ("1", {"changes": {"tolerance_mm": float("nan")}}, 422, "expected"),
    "unknown key": ("1", {"changes": {"tolerence_mm": 1}}, 422, "did you mean tolerance_mm?"),
    "its number": ("1", {"changes": {"number": 7}}, 422, "in the configuration file alone"),
    "a path": ("1", {"changes": {"gcode.template": "/etc/shadow"}}, 422, "in the configuration file alone"),
    "a part": ("1", {"changes": {"part": {"file": "/etc/shadow"}}}, 422, "in the configuration file alone"),
    "two that do not agree": ("1", {"changes": {"min_area_mm2": 3e5}}, 422, "expected less than max_area_mm2"),
    "what it is already": ("1", {"changes": {"tolerance_mm": 0.1}}, 422, "is that already"),
    "nothing": ("1", {"changes": {}}, 422, "changes"),
    "too many keys": ("1", {"changes": {f"k{n}": n for n in range(101)}}, 422, "changes"),
    "too many jobs": ("1", {"changes": {"margin_mm": 1}, "jobs": 51}, 422, "jobs"),
    "a huge number of jobs": ("1", {"changes": {"margin_mm": 1}, "jobs": 10**30}, 422, "jobs"),
    "no jobs": ("1", {"changes": {"margin_mm": 1}, "jobs": 0}, 422, "jobs"),
    "a field too many": ("1", {"changes": {"margin_mm": 1}, "recipe": 2}, 422, "recipe"),
    "a body too large": ("1", {"changes": {"margin_mm": "x" * 5000}}, 413, "allowed"),
    "no such recipe": ("77", {"changes": {"margin_mm": 1}}, 404, "there are 1, 2"),
    "no recipe at all": ("../1", {"changes": {"margin_mm": 1}}, 404, ""),
    "nothing to try it on": ("2", {"changes": {"margin_mm": 1}}, 409, "no job is kept"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_cannot_be_tried_is_refused_in_a_sentence_and_changes_nothing(served: Served, wrong: str) -> None:
    recipe, content, status, told = WRONG[wrong]
    before = served.client.get("/api/v1/recipes").body, served.client.get("/api/v1/recipes/trial").body
    reply = served.order(f"{recipe}/trial", "person3", content)
    assert reply.status == status, reply.body
    assert told in reply.json["error"]
    assert (served.client.get("/api/v1/recipes").body, served.client.get("/api/v1/recipes/trial").body) == before


def test_only_what_was_tried_to_its_end_can_be_adopted(served: Served) -> None:
    before = served.recipe()
    for trial in (0, 1, 2**60):
        reply = served.order("1/adopt", "person4", {"trial": trial, "note": "without a try"})
        assert (reply.status, "Try it again" in reply.json["error"]) == (409, True)
    trial = served.tried("person4", {"margin_mm": 2}, jobs=1)["number"]
    assert served.order("2/adopt", "person4", {"trial": trial, "note": "another one"}).status == 409
    for note in ("", "ab", "x" * 201):
        assert served.order("1/adopt", "person4", {"trial": trial, "note": note}).status == 422
    assert served.order("1/back", "person4", {"adoption": 99, "note": "never was"}).status == 404
    assert served.order("1/back", "person4", {"adoption": -1, "note": "never was"}).status == 422
    assert served.order("1/back", "person4", {"adoption": 0, "note": "is so already"}).status == 409
    assert served.recipe() == before


def test_what_was_tried_against_another_recipe_than_the_one_in_force_is_not_adopted(served: Served) -> None:
    trial = served.tried("person5", {"margin_mm": 3}, jobs=1)["number"]
    note = "once, and again"
    assert served.order("1/adopt", "person5", {"trial": trial, "note": note}).status == 200
    again = served.order("1/adopt", "person5", {"trial": trial, "note": note})
    assert (again.status, "no longer what it was when this was tried" in again.json["error"]) == (409, True)
    assert served.order("1/back", "person5", {"adoption": 0, "note": "as it was"}).status == 200
    assert served.recipe()["values"]["margin_mm"] == 0
    RecipeList.model_validate(served.client.get("/api/v1/recipes").json)


def children(process_id: int) -> list[int]:
    """Processes of a process."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError):
            continue
        if parent == process_id:
            found.append(int(folder.name))
    return found


def test_one_try_at_a_time_which_gives_way_to_jobs_and_can_be_ended(served: Served) -> None:
    ask = {"changes": {"margin_mm": 1}, "jobs": 50}
    assert served.order("1/trial", "person6", ask).status == 202
    second = served.order("1/trial", "person7", {**ask, "take_over": "me too"})
    assert (second.status, second.json["error"]) == (409, "person6 tries a recipe at this moment. Wait, or end it")
    early = served.order("1/adopt", "person7", {"trial": served.trial()["number"], "note": "too early"})
    assert "has not come to its end" in early.json["error"]
    mine = served.cell.service.process_id
    until(lambda: any(os.getpriority(os.PRIO_PROCESS, one) == 10 for one in children(mine)), what="low priority")
    ended = served.order("trial/stop", "person7", {})
    assert (ended.status, ended.json["trial"]["state"]) == (200, "stopped")
    assert len(ended.json["trial"]["jobs"]) < ended.json["trial"]["wanted"]
    none = served.order("trial/stop", "person7", {})
    assert (none.status, none.json["error"]) == (409, "no recipe is being tried: there is nothing to end")
    until(lambda: not [one for one in children(mine) if os.getpriority(os.PRIO_PROCESS, one) == 10], what="its end")
    begun: list[int] = []
    many = [
        threading.Thread(target=lambda w=who: begun.append(served.order("1/trial", w, ask).status))  # type: ignore[misc]
        for who in ("person6", "person6", "person6", "person6")
    ]
    for one in many:
        one.start()
    for one in many:
        one.join()
    assert sorted(begun) == [202, 409, 409, 409]
    assert served.order("trial/stop", "person6", {}).status == 200


def test_each_order_needs_a_person_and_their_word(served: Served) -> None:
    client = Client(served.client.port, source="127.0.0.21")
    bodies = {
        "1/trial": {"changes": {"margin_mm": 1}},
        "trial/stop": {},
        "1/adopt": {"trial": 1, "note": "why not"},
        "1/back": {"adoption": 0, "note": "why not"},
    }
    for path, content in bodies.items():
        assert client.order(f"/api/v1/recipes/{path}", None, content).status == 401
        assert client.ask("GET", f"/api/v1/recipes/{path}").status in (404, 405)
        foreign = client.order(f"/api/v1/recipes/{path}", token("person8"), content, Origin="http://elsewhere.example")
        assert foreign.status == 403
    by_pin = client.order(
        "/api/v1/recipes/1/trial",
        None,
        {"changes": {"margin_mm": 1}, "jobs": 1, "take_over": "a short one"},
        Authorization="Pin maria:4711",
    )
    assert by_pin.status == 202, by_pin.body
    until(lambda: served.trial()["state"] == "done", what="the end of a try")
    refused = client.order("/api/v1/recipes/1/trial", token("person8"), {"changes": {"margin_mm": 1}})
    assert (refused.status, refused.json["holder"]) == (409, "maria")
    content = {"trial": served.trial()["number"], "note": "why not"}
    refused = client.order("/api/v1/recipes/1/adopt", token("person8"), content)
    assert (refused.status, refused.json["holder"]) == (409, "maria")
    assert served.recipe()["values"]["margin_mm"] == 0


def test_nothing_is_adopted_where_the_file_cannot_be_written(served: Served) -> None:
    trial = served.tried("person9", {"margin_mm": 4}, jobs=1)["number"]
    kept = served.cell.folder / "state" / "adopted.json"
    aside = kept.rename(kept.with_name("aside.json")) if kept.exists() else None
    kept.mkdir()  # no file can take its place
    try:
        refused = served.order("1/adopt", "person9", {"trial": trial, "note": "in vain"})
        assert refused.status == 409, refused.body
        assert "adopted.json" in refused.json["error"]
        assert served.notes("person9")[0]["result"].startswith("refused: ")
        listed = served.client.get("/api/v1/recipes").json
        assert "adopted.json" in listed["trouble"]
        assert listed["recipes"][0]["values"]["margin_mm"] == 0
    finally:
        kept.rmdir()
        if aside is not None:
            aside.rename(kept)


def test_a_try_ends_with_its_service_also_by_kill_minus_nine(tmp_path: Path) -> None:
    served = started(tmp_path, *WHO)
    try:
        served.jobs(1, WHO[0])
        assert served.order("1/trial", WHO[0], {"changes": {"margin_mm": 1}}).status == 202
        mine = served.cell.service.process_id
        trying = until(lambda: [one for one in children(mine) if os.getpriority(os.PRIO_PROCESS, one) >= 10], what="it")
        served.cell.service.kill()
        until(lambda: not any(Path(f"/proc/{one}").exists() for one in trying), what="its end")
    finally:
        served.cell.stop()


def test_what_was_adopted_outlives_kill_minus_nine_wherever_it_comes(tmp_path: Path) -> None:
    served = started(tmp_path, *WHO)
    kept = tmp_path / "state" / "adopted.json"
    try:
        served.jobs(1, WHO[0])
        for turn in range(4):
            margin = turn + 1
            trial = served.tried(WHO[turn], {"margin_mm": margin}, jobs=1)["number"]
            before, answers = kept.read_bytes() if kept.exists() else b"", []

            def adopt(turn: int = turn, trial: int = trial, answers: list[int] = answers) -> None:
                try:
                    answers.append(served.order("1/adopt", WHO[turn], {"trial": trial, "note": f"turn {turn}"}).status)
                except (OSError, http.client.HTTPException):
                    answers.append(0)

            asking = threading.Thread(target=adopt)
            asking.start()
            if turn < 3:  # between the file and the answer, as near as can be
                until(lambda b=before: kept.exists() and kept.read_bytes() != b, what="the file", pause_s=0)  # type: ignore[misc]
            served.cell.service.kill()
            asking.join()
            holds = json.loads(kept.read_bytes())["recipes"]["1"]["adoptions"][-1]["values"]["margin_mm"]
            assert holds in ((margin,) if turn < 3 or answers == [200] else (margin, margin - 1))
            (tmp_path / "service.log").write_text("")
            served.cell.service = served.cell.start_service()
            served.cell.ready()
            assert served.recipe()["values"]["margin_mm"] == holds
            if turn < 3:
                noted = next(note for note in served.notes(WHO[turn]) if note["action"] == "adopt recipe")
                assert f"-> {margin:.1f}; turn {turn}" in noted["detail"]
        assert served.jobs(1, WHO[5])[0]["recipe"]["margin_mm"] == holds
        config = tmp_path / "config.yaml"
        config.write_text(config.read_text().replace("max_area_mm2: 200000", "max_area_mm2: 150000"))
        served.cell.service.reload()
        until(lambda: served.recipe()["values"]["max_area_mm2"] == 150_000, what="the file's last word")
        assert served.recipe()["values"]["margin_mm"] == 0
        assert served.recipe()["adopted"][0]["in_force"] is False
    finally:
        served.cell.stop()


FAULTS = """() => {
  const wrong = [];
  if (document.documentElement.scrollWidth > innerWidth) wrong.push(`${document.documentElement.scrollWidth} px wide`);
  for (const one of document.querySelectorAll("button, select, input, a")) {
    if (!one.checkVisibility()) continue;
    const name = one.getAttribute("aria-label") || one.textContent.trim() || one.labels?.[0]?.textContent;
    if (!name) wrong.push(`no name: ${one.outerHTML}`);
    if (one.offsetHeight < 24) wrong.push(`too small: ${one.outerHTML}`);
  }
  return wrong;
}"""
AXE = """async () => {
  const told = await axe.run(document, { resultTypes: ["violations"] });
  return told.violations.filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target).join(" ")}`);
}"""


@pytest.mark.parametrize("language", ["en", "ru"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_page_is_whole_and_axe_core_finds_nothing_serious(
    served: Served, browser: Browser, theme: str, language: str
) -> None:
    if not served.recipe()["adopted"]:
        served.adopted("person10", {"margin_mm": 6})
    served.tried("person10", {"max_area_mm2": BETWEEN - 10 * len(theme + language)})
    context = browser.new_context(locale=language, bypass_csp=True)
    page = context.new_page()
    page.emulate_media(color_scheme="dark" if theme == "dark" else "light")
    page.goto(f"{served.client.url}recipes")
    expect(page.locator("#tried path.now")).to_have_count(PICTURES)
    given(page, "margin_mm", "7")
    page.evaluate((node_modules() / "axe-core" / "axe.min.js").read_text())
    wrong = {}
    for width, height in WIDTHS.items():
        page.set_viewport_size({"width": width, "height": height})
        if faults := page.evaluate(FAULTS) + page.evaluate(AXE):
            wrong[width] = faults
    context.close()
    assert wrong == {}
