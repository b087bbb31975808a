"""Setting a cell up is for who has a token, one person at a time, never beside jobs: what somebody else would try."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest

from service.web.guard import CONTENT_POLICY
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import OTHER_TOKEN, THIRD_TOKEN, TOKEN, Client, Reply
from tests.support.processes.processes import until

BODIES: dict[str, dict[str, Any]] = {
    "look": {},
    "board": {"squares_x": 11, "squares_y": 8, "square_mm": 30},
    "shoot": {},
    "remove": {"shot": 1},
    "height": {"thickness_mm": 20},
    "point": {"x_mm": 1, "y_mm": 2, "machine_x_mm": 3, "machine_y_mm": 4},
    "forget": {"point": 0},
}
HALTED: dict[str, dict[str, Any]] = {
    "calibrate": {},
    "adopt": {},
    "align": {},
    "marks": {},
    "teach": {},
    "probe": {},
    "apply": {},
}
PIN = "4711"


@pytest.fixture(scope="module")
def pins() -> dict[str, str]:
    """Somebody may give orders by a PIN."""
    return {"ivan": PIN}


@pytest.fixture(scope="module")
def client(cell: tuple[Cell, Client]) -> Client:
    """Who asks past a browser."""
    cell[0].ready()
    return cell[1]


@pytest.fixture
def halted(client: Client) -> Iterator[Client]:
    """The same, while no job is taken."""
    assert ordered(client, "halt").status == 200
    yield client
    settled(client)
    assert ordered(client, "resume", THIRD_TOKEN, take_over="it goes on").status in (200, 409)
    until(lambda: client.get("/api/v1/state").json["state"] == "Ready", what="Ready")


def ordered(client: Client, path: str, token: str = TOKEN, **content: Any) -> Reply:
    """An order, once more where there were too many within a minute."""
    reply = client.order(f"/api/v1/{path}", token=token, content=content)
    while reply.status == 429:
        time.sleep(float(reply.headers["retry-after"]))
        reply = client.order(f"/api/v1/{path}", token=token, content=content)
    return reply


def act(client: Client, name: str, token: str = TOKEN, **content: Any) -> Reply:
    return ordered(client, f"commission/{name}", token, **content)


def settled(client: Client) -> dict[str, Any]:
    """How it stands once nothing is under way."""
    return dict(
        until(lambda: (told := client.get("/api/v1/commission").json)["running"] is None and told, what="its end")
    )


def fault(told: dict[str, Any], step: str) -> str:
    return str(next(one["fault"] for one in told["steps"] if one["name"] == step))


def test_every_action_needs_a_token_and_a_pin_is_not_enough(client: Client) -> None:
    operations = client.get("/api/v1/openapi.json").json["paths"]
    told = {path.rpartition("/")[2] for path in operations if "/commission/" in path and "post" in operations[path]}
    assert told == BODIES.keys() | HALTED.keys()
    for name in told:
        path = f"/api/v1/commission/{name}"
        assert client.order(path, token=None).status == 401, name
        assert client.order(path, token=None, Authorization=f"Pin ivan:{PIN}").status == 401, name
        assert client.get(path).status == 405, name
    assert settled(client)["board"] is None


def test_other_sites_and_names_are_refused(client: Client) -> None:
    for path in ("/commission", "/api/v1/commission", "/api/v1/commission/report", "/api/v1/commission/shots/1"):
        assert client.get(path, Host="elsewhere.example").status == 421
        assert client.get(path, Origin="http://elsewhere.example").status == 403
        assert client.get(path, Sec_Fetch_Site="cross-site").status == 403
    page = client.get("/commission")
    assert page.status == 200
    assert page.headers["content-security-policy"] == CONTENT_POLICY


@pytest.mark.parametrize("name", HALTED)
def test_beside_jobs_nothing_is_written_and_the_controller_is_left_alone(client: Client, name: str) -> None:
    refused = act(client, name, take_over="to try", **HALTED[name])
    assert refused.status == 409
    assert "Halt it first" in refused.json["error"]


def test_one_person_at_a_time_and_each_is_in_the_journal(halted: Client) -> None:
    assert act(halted, "height", take_over="to begin", **BODIES["height"]).status == 202
    settled(halted)
    refused = act(halted, "height", OTHER_TOKEN, thickness_mm=99)
    assert (refused.status, refused.json["holder"]) == (409, "anna")
    assert settled(halted)["thickness_mm"] == 20
    assert act(halted, "height", OTHER_TOKEN, thickness_mm=30, take_over="anna has left").status == 202
    assert settled(halted)["thickness_mm"] == 30
    notes = halted.get("/api/v1/audit?limit=5", Authorization=f"Bearer {TOKEN}").json["notes"]
    assert [(one["who"], one["action"], one["result"]) for one in notes[:1]] == [("oleg", "commission height", "30 mm")]
    assert notes[0]["detail"] == '{"thickness_mm":30.0}'


def test_what_cannot_be_noted_is_not_done(halted: Client, cell: tuple[Cell, Client]) -> None:
    before = settled(halted)["thickness_mm"]
    with closing(sqlite3.connect(cell[0].journal, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        refused = act(halted, "height", thickness_mm=77, take_over="to try")
        other.execute("ROLLBACK")
    assert refused.status == 503
    assert "the journal cannot be written" in refused.json["error"]
    assert settled(halted)["thickness_mm"] == before


@pytest.mark.parametrize(
    ("name", "content", "status"),
    [
        ("board", {"squares_x": 11, "squares_y": 8, "square_mm": 1e999}, 422),
        ("board", {"squares_x": 11, "squares_y": 8, "square_mm": -1}, 422),
        ("board", {"squares_x": "11", "squares_y": 8, "square_mm": 30}, 422),
        ("board", {"squares_x": 11, "squares_y": 8, "square_mm": 30, "file": "/etc/passwd"}, 422),
        ("remove", {"shot": 0}, 422),
        ("remove", {"shot": "../session"}, 422),
        ("marks", {"dictionary": "x" * 41}, 422),
        ("height", {"thickness_mm": True}, 422),
        ("height", {"thickness_mm": 20, "take_over": "x" * 5000}, 413),
        ("../state", {}, 404),
        ("session.json", {}, 404),
    ],
)
def test_a_body_or_a_name_that_makes_no_sense_is_refused(
    client: Client, name: str, content: dict[str, Any], status: int
) -> None:
    assert act(client, name, **content).status == status


@pytest.mark.parametrize("shot", ["0", "-1", "1.5", "%2e%2e", "..%2fsession.json", "٣", "9" * 17, "1"])
def test_there_is_no_other_file_behind_a_pictures_number(client: Client, shot: str) -> None:
    from urllib.parse import quote

    assert client.get(f"/api/v1/commission/shots/{quote(shot, safe='%')}").status == 404
    assert client.get("/api/v1/commission/report").status == 404


def test_a_step_that_comes_to_nothing_says_why_and_changes_nothing(halted: Client, cell: tuple[Cell, Client]) -> None:
    before = (cell[0].folder / "combs.yaml").read_bytes()
    said = {
        "shoot": ("board", "which board it is has not been told"),
        "calibrate": ("calibration", "there is no picture of the board flat on the table"),
        "adopt": ("calibration", "there is no calibration to adopt"),
        "align": ("alignment", "expected 3 or more"),
        "marks": ("marks", "no mark of DICT_4X4_50 is seen"),
        "teach": ("table", "the configuration names no table.file"),
        "apply": ("controller", "the probe found nothing to change"),
    }
    for name, (step, text) in said.items():
        assert act(halted, name, take_over="to try").status == 202, name
        assert text in fault(settled(halted), step), name
    assert (cell[0].folder / "combs.yaml").read_bytes() == before


def test_a_probe_has_the_controller_alone_and_gives_it_back_also_to_who_resumes_meanwhile(halted: Client) -> None:
    assert act(halted, "probe", take_over="to try", write=True).status == 202
    busy = act(halted, "look", OTHER_TOKEN)
    assert busy.status == 409
    assert "probe is under way" in busy.json["error"]
    assert ordered(halted, "resume", OTHER_TOKEN, take_over="to see").status == 200
    assert ordered(halted, "trigger", OTHER_TOKEN).status == 409, "no job while the controller is probed"
    told = settled(halted)
    controller = next(one for one in told["steps"] if one["name"] == "controller")
    assert (controller["score"], controller["fault"]) == (100, None), controller
    until(lambda: ordered(halted, "trigger", OTHER_TOKEN).status == 202, what="a job that is taken", pause_s=1)
