"""Recipes by REST at a running daemon: tried on archived jobs, adopted over kill -9; and what is refused."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from service.web.recipes.models import RecipeList, TrialAnswer
from tests.support.processes.page_client import Client
from tests.support.processes.processes import until
from tests.support.processes.recipes_cell import WHO, RecipesCell, served_recipes, started, token


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RecipesCell]:
    with served_recipes(tmp_path_factory.mktemp("recipes")) as built:
        yield built


def test_where_the_outline_changes_both_are_told_apart_in_millimetres(served: RecipesCell) -> None:
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
def test_what_cannot_be_tried_is_refused_in_a_sentence_and_changes_nothing(served: RecipesCell, wrong: str) -> None:
    recipe, content, status, told = WRONG[wrong]
    before = served.client.get("/api/v1/recipes").body, served.client.get("/api/v1/recipes/trial").body
    reply = served.order(f"{recipe}/trial", "person3", content)
    assert reply.status == status, reply.body
    assert told in reply.json["error"]
    assert (served.client.get("/api/v1/recipes").body, served.client.get("/api/v1/recipes/trial").body) == before


def test_only_what_was_tried_to_its_end_can_be_adopted(served: RecipesCell) -> None:
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


def test_what_was_tried_against_another_recipe_than_the_one_in_force_is_not_adopted(served: RecipesCell) -> None:
    trial = served.tried("person5", {"margin_mm": 3}, jobs=1)["number"]
    note = "once, and again"
    assert served.order("1/adopt", "person5", {"trial": trial, "note": note}).status == 200
    again = served.order("1/adopt", "person5", {"trial": trial, "note": note})
    assert (again.status, "no longer what it was when this was tried" in again.json["error"]) == (409, True)
    assert served.order("1/back", "person5", {"adoption": 0, "note": "as it was"}).status == 200
    assert served.recipe()["values"]["margin_mm"] == 0
    RecipeList.model_validate(served.client.get("/api/v1/recipes").json)


def children(process_id: int) -> dict[int, int]:
    """Processes of a process, and how nice each is."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == process_id:
            found[int(folder.name)] = int(fields[16])
    return found


def test_one_try_at_a_time_which_gives_way_to_jobs_and_can_be_ended(served: RecipesCell) -> None:
    ask = {"changes": {"margin_mm": 1}, "jobs": 50}
    assert served.order("1/trial", "person6", ask).status == 202
    second = served.order("1/trial", "person7", {**ask, "take_over": "me too"})
    assert (second.status, second.json["error"]) == (409, "person6 tries a recipe at this moment. Wait, or end it")
    early = served.order("1/adopt", "person7", {"trial": served.trial()["number"], "note": "too early"})
    assert "has not come to its end" in early.json["error"]
    mine = served.cell.service.process_id
    until(lambda: 10 in children(mine).values(), what="low priority")
    ended = served.order("trial/stop", "person7", {})
    assert (ended.status, ended.json["trial"]["state"]) == (200, "stopped")
    assert len(ended.json["trial"]["jobs"]) < ended.json["trial"]["wanted"]
    none = served.order("trial/stop", "person7", {})
    assert (none.status, none.json["error"]) == (409, "no recipe is being tried: there is nothing to end")
    until(lambda: 10 not in children(mine).values(), what="its end")
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


def test_each_order_needs_a_person_and_their_word(served: RecipesCell) -> None:
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


def test_nothing_is_adopted_where_the_file_cannot_be_written(served: RecipesCell) -> None:
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
        trying = until(lambda: [one for one, nice in children(mine).items() if nice >= 10], what="it")
        served.cell.service.kill()
        until(lambda: not any(Path(f"/proc/{one}").exists() for one in trying), what="its end")
    finally:
        served.cell.stop()


def test_what_was_adopted_outlives_kill_minus_nine_wherever_it_comes(tmp_path: Path) -> None:
    served = started(tmp_path, *WHO)
    kept = tmp_path / "state" / "adopted.json"
    try:
        served.jobs(1, WHO[0])
        for turn in range(3):
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
            if turn < 2:  # between the file and the answer, as near as can be
                until(lambda b=before: kept.exists() and kept.read_bytes() != b, what="the file", pause_s=0)  # type: ignore[misc]
            served.cell.service.kill()
            asking.join()
            holds = json.loads(kept.read_bytes())["recipes"]["1"]["adoptions"][-1]["values"]["margin_mm"]
            assert holds in ((margin,) if turn < 2 or answers == [200] else (margin, margin - 1))
            (tmp_path / "service.log").write_text("")
            served.cell.service = served.cell.start_service()
            served.cell.ready()
            assert served.recipe()["values"]["margin_mm"] == holds
            if turn < 2:
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
