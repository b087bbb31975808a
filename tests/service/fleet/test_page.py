"""Page and REST interface of the fleet: what is pointed out, in both languages, and nobody's markup but ours."""

from __future__ import annotations

import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from typing import Any

import pytest

from service.fleet.cells import Cell
from service.fleet.page import Pages
from service.fleet.settings import Fleet, FleetPage
from service.fleet.store import Drift, Figures
from service.fleet.views import FleetView, compared, viewer
from service.state import State
from service.web.http_server import http_server, listening
from tests.support.interop.said_cells import ready
from tests.support.processes.page_client import Client

NOTHING = Figures({}, Drift(), Drift())


def cell(number: int, *, born: bool = True, **more: Any) -> Cell:
    return Cell(("plant", f"cell-{number}"), ready(number, **more), heard_s=0.0, heard_ms=1, born=born)


def view_of(*cells: tuple[Cell, Figures, float]) -> FleetView:
    view = viewer(Fleet())
    return FleetView(connected=True, cells=compared([view(*one) for one in cells]))


@contextmanager
def served(view: FleetView) -> Iterator[Client]:
    """A server of the page, in a thread."""
    listener = listening("127.0.0.1", 0)
    server = http_server(Pages(FleetPage(), lambda: view, "1.0").application())
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield Client(listener.getsockname()[1])
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


def shown(view: FleetView, language: str = "en") -> str:
    with served(view) as client:
        answer = client.get(f"/?language={language}")
    assert answer.status == 200
    return answer.body.decode()


def test_those_that_need_a_person_come_first() -> None:
    states = [(cell(1), 0.0), (cell(2, State__Name="Error"), 0.0), (cell(3), 9.0), (cell(4, born=False), 0.0)]
    found = view_of(*((one, NOTHING, silent_s) for one, silent_s in states)).cells
    assert [(one.node, one.kind, one.condition) for one in found] == [
        ("cell-3", "lost", "silent"),
        ("cell-4", "lost", "gone"),
        ("cell-2", "fault", "here"),
        ("cell-1", "ready", "here"),
    ]


def test_what_differs_is_pointed_out_against_the_others() -> None:
    odd = cell(3, Recipes__Hash="cd" * 32, Service__Version="0.1.0", Calibration__Age_days=400.0)
    shared = cell(4, Calibration__Hash=f"sha256:{1:064x}")
    found = {one.node: one for one in view_of(*((one, NOTHING, 0.0) for one in (cell(1), cell(2), odd, shared))).cells}
    assert (found["cell-3"].recipes_differ, found["cell-3"].version_differs, found["cell-3"].calibration_old) == (
        True,
    ) * 3
    assert (found["cell-1"].recipes_differ, found["cell-1"].version_differs, found["cell-1"].calibration_old) == (
        False,
    ) * 3
    assert [one for one in found if found[one].calibration_shared] == ["cell-1", "cell-4"]


def test_drift_beyond_what_is_allowed_is_told_and_a_shift_is_counted() -> None:
    figures = Figures({"accepted": 40, "refused": 3}, Drift(0.12, 25.0), Drift(1.0, -3.0))
    view = view_of((cell(1), figures, 0.0))
    assert (view.cells[0].uncertainty_mm.drifts, view.cells[0].blur_px.drifts) == (True, False)
    text = shown(view)
    for words in ("<b>40</b> accepted", "<b>3</b> refused", "+25 % worse than the week before", "−3 %"):
        assert words in text


@pytest.mark.parametrize("language", ["en", "ru"])
def test_every_state_is_named(language: str) -> None:
    cells = [(cell(number, State__Name=state.label), NOTHING, 0.0) for number, state in enumerate(State)]
    text = shown(view_of(*cells, (cell(90), NOTHING, 9.0), (cell(91, born=False), NOTHING, 0.0)), language)
    words = json.loads((files("service.web") / "static" / "texts.json").read_text())[language]
    own = json.loads((files("service.fleet") / "static" / "fleet.json").read_text())[language]
    for state in State:
        assert f"<b>{words[state.label]}</b>" in text
    assert f"<b>{own['silent']}</b>" in text
    assert f"<b>{own['gone']}</b>" in text
    assert "{{" not in text


def test_an_alarm_is_told_with_what_to_do_in_the_readers_language() -> None:
    alarm = {"State__Name": "Error", "State__Reason": "silent for 3 s", "State__Reason_Code": 152}
    view = view_of((cell(1, **alarm, Alarms__Texts="controller: 152 controller_lost: silent for 3 s"), NOTHING, 0.0))
    assert "controller_lost" in shown(view)
    assert re.search(r"<b>[А-Я]", shown(view, "ru"))


def test_what_a_cell_says_is_never_markup() -> None:
    evil = '<script>alert(1)</script>"><img src=x>'
    one = Cell((evil.replace("/", ""), evil.replace("/", "")), ready(1), heard_s=0.0, born=True)
    one.values |= {name: evil for name, value in one.values.items() if isinstance(value, str)}
    one.values |= {"Service/Page": "javascript:alert(1)", "State/Reason": evil, "State/Reason Code": 10**9}
    text = shown(view_of((one, NOTHING, 0.0)))
    assert "<img" not in text
    assert "<script>" not in text
    assert "javascript:" not in text


def test_the_same_is_answered_as_json_and_nothing_is_taken() -> None:
    with served(view_of((cell(1), NOTHING, 0.0))) as client:
        told = client.get("/api/v1/cells").json
        assert told["cells"][0]["node"] == "cell-1"
        for method in ("POST", "PUT", "DELETE", "PATCH"):
            assert client.ask(method, "/api/v1/cells", body=b"{}", Content_Type="application/json").status == 404
        assert client.get("/nowhere").json["error"] == "there is nothing here. See / and /api/v1/cells"
        assert client.get("/", Host="evil.example").status == 421
        assert "default-src 'none'" in client.get("/").headers["content-security-policy"]
        page = client.get("/static/fleet.js")
        assert client.get("/static/fleet.js", If_None_Match=page.headers["etag"]).status == 304


def test_both_languages_have_the_same_words() -> None:
    words = json.loads((files("service.fleet") / "static" / "fleet.json").read_text())
    assert words["en"].keys() == words["ru"].keys()
