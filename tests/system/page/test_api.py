"""The REST interface of a running daemon, over real sockets: what it shows, what it refuses, what it notes."""

from __future__ import annotations

import http.client
import json
import re
import socket
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import pytest

from service.daemon.control import ask
from service.web.models import Drawing, Job, Jobs, Notes, Reasons, ServiceState
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import OTHER_TOKEN, THIRD_TOKEN, TOKEN, Client, token_file
from tests.support.processes.processes import BOUND_S, free_port, until


@dataclass
class Served:
    """A daemon, its page, and who asks it."""

    cell: Cell
    client: Client

    def state(self) -> dict[str, Any]:
        reply = self.client.get("/api/v1/state")
        assert reply.status == 200, reply.body
        return dict(reply.json)

    def ended_job(self, job: int) -> dict[str, Any]:
        """The job once it has ended and its evidence is kept."""
        path = f"/api/v1/jobs/{job}"
        return dict(until(lambda: (told := self.client.get(path).json).get("files") and told, what=f"job {job}"))

    def notes(self) -> list[tuple[Any, ...]]:
        database = sqlite3.connect(f"file:{self.cell.journal}?mode=ro", uri=True)
        try:
            return database.execute("SELECT who, address, action, detail, result FROM audit ORDER BY id").fetchall()
        finally:
            database.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    token_file(folder)
    more = f"page: {{port: {port}, token_file: tokens, names: [cutter.plant.example]}}\n"
    cell = Cell(folder, triggers="[]", camera=ON_SAMPLES, trigger_every_s=None, more=more)
    try:
        cell.ready()
        yield Served(cell, Client(port))
    finally:
        cell.stop()


@pytest.fixture(scope="module")
def job(served: Served) -> dict[str, Any]:
    """A job that was triggered by the page and accepted."""
    until(lambda: served.state()["state"] == "Ready" and served.state()["link"]["not_ready"] is None, what="Ready")
    triggered = served.client.order("/api/v1/trigger", content={"recipe": 1})
    assert triggered.status == 202, triggered.body
    return served.ended_job(triggered.json["job"])


def test_the_state_is_the_status_of_the_control_socket_and_more(served: Served) -> None:
    seen = served.state()
    ServiceState.model_validate(seen)
    status = ask(served.cell.folder / "state", {"command": "status"})
    moving = {"uptime_s", "since_s"}
    assert {key: seen[key] for key in status if key not in moving} == {
        key: value for key, value in status.items() if key not in moving
    }
    assert seen["recipes"] == [{"number": 1, "name": "default"}]
    assert seen["link"]["up"] is True
    assert seen["camera"] == {"what": "files", "up": True}
    assert seen["disk"]["journal_free_bytes"] > 0


def test_a_trigger_becomes_a_job_with_its_evidence_and_a_note_of_who_asked(served: Served, job: dict[str, Any]) -> None:
    Job.model_validate(job)
    assert (job["outcome"], job["trigger"]["kind"], job["trigger"]["recipe"]) == ("accepted", "page", 1)
    number = job["job_id"]
    assert ("anna", "127.0.0.1", "trigger", "recipe 1", f"job {number}") in served.notes()
    assert set(job["files"]) == {"frame.png", "overlay.jpg", "document.json"}
    kept = served.cell.folder / "var" / "archive" / f"{number // 1000:07d}xxx"
    for name, place in (("frame.png", "frame.png"), ("document.json", "accepted.json")):
        reply = served.client.get(f"/api/v1/jobs/{number}/files/{name}")
        assert reply.body == (kept / f"{number}-{place}").read_bytes()
        assert reply.headers["content-disposition"] == f'attachment; filename="job-{number}-{name}"'
    listed = served.client.get(f"/api/v1/jobs?before={number + 1}&limit=1").json
    Jobs.model_validate(listed)
    assert listed == {"jobs": [job]}
    assert {"outcome": "accepted", "reason": None, "count": 1} in [
        {**entry, "count": min(entry["count"], 1)} for entry in served.state()["outcomes"]
    ]


def test_a_frame_is_made_small_and_sent_once(served: Served, job: dict[str, Any]) -> None:
    path = f"/api/v1/frames/{job['job_id']}"
    small = served.client.get(f"{path}?width=320")
    assert (small.status, small.headers["content-type"], small.body[:2]) == (200, "image/jpeg", b"\xff\xd8")
    assert len(small.body) < 60_000
    assert served.client.get(f"{path}?width=320", If_None_Match=small.headers["etag"]).status == 304
    assert served.client.get(f"{path}?width=321").status == 400


def test_only_refused_and_older_jobs_can_be_asked_for(served: Served, job: dict[str, Any]) -> None:
    wrong = served.client.order("/api/v1/trigger", content={"recipe": 77})
    number = wrong.json["job"]
    refused = until(lambda: (j := served.client.get(f"/api/v1/jobs/{number}").json)["outcome"] and j, what="the end")
    assert (refused["outcome"], refused["reason_name"]) == ("refused", "unknown_recipe")
    only = served.client.get("/api/v1/jobs?only_refused=true").json["jobs"]
    assert number in [one["job_id"] for one in only]
    assert {one["outcome"] for one in only} <= {"refused", "failed"}
    before = served.client.get(f"/api/v1/jobs?before={number}&limit=2").json["jobs"]
    assert before[0]["job_id"] == number - 1 >= job["job_id"]


ORDERS = ("/api/v1/trigger", "/api/v1/halt", "/api/v1/resume")


def test_without_its_token_nothing_is_done_and_guesses_end(served: Served) -> None:
    guesser = Client(served.client.port, source="127.0.0.9")
    before = served.state()
    statuses = [guesser.order(path, None).status for path in ORDERS] + [guesser.get("/api/v1/audit").status]
    assert statuses == [401] * 4
    wrong = ["x", TOKEN[:-1], TOKEN.upper(), TOKEN + "\u00e9", f"{TOKEN} {TOKEN}"]
    assert [guesser.order("/api/v1/halt", token).status for token in wrong] == [401] * 5
    with ThreadPoolExecutor(8) as pool:
        assert set(pool.map(lambda _: guesser.order("/api/v1/halt", "x").status, range(8))) == {429}
    locked_out = guesser.order("/api/v1/halt", TOKEN)
    assert (locked_out.status, 0 < int(locked_out.headers["retry-after"]) <= 60) == (429, True)
    assert [note for note in served.notes() if note[1] == "127.0.0.9"] == [
        (None, "127.0.0.9", "wrong token", None, None)
    ] * 5
    after = served.state()
    assert (after["settled_job"], after["state"]) == (before["settled_job"], "Ready")
    assert served.client.get("/api/v1/audit", Authorization=f"Bearer {TOKEN}").status == 200, (
        "others are not locked out"
    )


def test_many_guesses_at_once_are_no_more_than_one_after_another(served: Served) -> None:
    guesser = Client(served.client.port, source="127.0.0.10")
    with ThreadPoolExecutor(12) as pool:
        statuses = list(pool.map(lambda k: guesser.order("/api/v1/halt", f"guess {k}").status, range(24)))
    assert statuses.count(401) == 5
    assert statuses.count(429) == 19


def test_halt_and_resume_say_who_and_from_where(served: Served) -> None:
    halted = served.client.order("/api/v1/halt", OTHER_TOKEN, {"reason": "blade"}, Origin=own(served))
    assert (halted.status, halted.json) == (200, {"state": "Halted"})
    assert served.state()["reason"] == "halted: blade (oleg from 127.0.0.1)"
    refused = served.client.order("/api/v1/trigger")
    assert (refused.status, refused.json["code"], refused.json["name"]) == (409, 121, "not_ready")
    assert served.client.order("/api/v1/resume").json == {"state": "Ready"}
    again = served.client.order("/api/v1/resume")
    assert (again.status, "nothing to resume" in again.json["error"]) == (409, True)
    reply = served.client.get("/api/v1/audit?limit=4", Authorization=f"Bearer {TOKEN}")
    Notes.model_validate(reply.json)
    told = [(note["who"], note["action"], note["result"]) for note in reply.json["notes"]]
    assert [entry[:2] for entry in told] == [
        ("anna", "resume"),
        ("anna", "resume"),
        ("anna", "trigger"),
        ("oleg", "halt"),
    ]
    assert told[1][2] == "Ready"
    assert told[2][2].startswith("refused: not_ready")


def own(served: Served) -> str:
    return f"http://127.0.0.1:{served.client.port}"


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 421),
        ({"Host": "evil.example:9770"}, 421),
        ({"Host": "127.0.0.1.evil.example"}, 421),
        ({"Host": ""}, 421),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
    ],
)
def test_another_sites_page_can_neither_order_nor_look(served: Served, headers: dict[str, str], status: int) -> None:
    assert served.client.order("/api/v1/halt", **headers).status == status
    assert served.client.get("/api/v1/state", **headers).status == status
    assert served.state()["state"] == "Ready"


def test_it_answers_to_its_addresses_and_names(served: Served) -> None:
    port = served.client.port
    for host in (f"127.0.0.1:{port}", f"localhost:{port}", "LOCALHOST", "cutter.plant.example", "127.0.0.1"):
        assert served.client.get("/api/v1/state", Host=host).status == 200, host


def test_nothing_can_be_uploaded(served: Served) -> None:
    client = served.client
    assert client.order("/api/v1/halt", Content_Type="multipart/form-data; boundary=x").status == 415
    assert client.order("/api/v1/halt", Content_Type="application/x-www-form-urlencoded").status == 415
    assert client.order("/api/v1/halt", content={"reason": "x" * 5000}).status == 413
    connection = http.client.HTTPConnection("127.0.0.1", client.port, timeout=BOUND_S)
    headers = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json"}
    connection.request("POST", "/api/v1/halt", iter([b" " * 3000] * 3), headers, encode_chunked=True)
    assert connection.getresponse().status == 413
    connection.close()
    assert [client.ask(method, "/api/v1/state").status for method in ("PUT", "DELETE", "PATCH")] == [415] * 3
    put = client.ask("PUT", "/api/v1/state", body=b"{}", Content_Type="application/json")
    assert put.status == 405
    assert served.state()["state"] == "Ready"


@pytest.mark.parametrize(
    ("content", "what"),
    [
        ({"recipe": -1}, "recipe"),
        ({"recipe": "1; DROP"}, "recipe"),
        ({"recipe": True}, "recipe"),
        ({"thickness_mm": "20"}, "thickness_mm"),
        ({"thickness_mm": 1e9}, "thickness_mm"),
        ({"x": 1}, "x"),
    ],
)
def test_a_body_that_is_not_as_expected_is_told_where(served: Served, content: dict[str, Any], what: str) -> None:
    reply = served.client.order("/api/v1/trigger", content=content)
    assert (reply.status, reply.json["error"].startswith(f"{what}: ")) == (422, True)


@pytest.mark.parametrize(
    "path",
    [
        "/api/v1/jobs/1/files/../../../../../../etc/passwd",
        "/api/v1/jobs/1/files/%2e%2e%2f%2e%2e%2fstate%2fcontrol.sock",
        "/api/v1/jobs/1/files/..%2f1-accepted.json",
        "/api/v1/jobs/1/files/accepted.json",
        "/api/v1/jobs/..%2f..%2fetc/files/frame.png",
        "/api/v1/jobs/0",
        "/api/v1/jobs/-1",
        "/api/v1/jobs/99999999999999999999",
        "/api/v1/jobs/%D9%A1",
        "/api/v1/jobs/1%00",
        "/api/v1/frames/999999999",
        "/../../etc/passwd",
        "//etc/passwd",
        "/tokens",
        "/static/../tokens",
        "/static/%2e%2e/%2e%2e/%2e%2e/tokens",
    ],
)
def test_no_path_leads_out_of_what_is_served(served: Served, job: dict[str, Any], path: str) -> None:
    reply = served.client.get(path)
    assert reply.status == 404, reply.body
    assert b"root:" not in reply.body
    assert TOKEN.encode() not in reply.body


def test_every_answer_forbids_what_the_page_does_not_need(served: Served) -> None:
    for reply in (served.client.get("/api/v1/state"), served.client.get("/nowhere"), served.client.get("/", Host="x")):
        policy = reply.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert "frame-ancestors 'none'" in policy
        assert reply.headers["x-content-type-options"] == "nosniff"
        assert "access-control-allow-origin" not in reply.headers
        assert "server" not in reply.headers


NOT_THERE = {"job": "999999", "recipe": "999", "look": "1", "shot": "1", "name": "frame.png"}


def test_the_openapi_document_tells_every_operation_and_no_other(served: Served) -> None:
    told = served.client.get("/api/v1/openapi.json").json
    assert told["openapi"] == "3.1.0"
    references = set(json.dumps(told).split('"#/components/schemas/')[1:])
    assert {name.partition('"')[0] for name in references} <= set(told["components"]["schemas"])
    for path, operations in told["paths"].items():
        for method, operation in operations.items():
            if path.endswith("/events"):
                continue  # does not end
            concrete = re.sub(r"\{(\w+)\}", lambda found: NOT_THERE[found[1]], path)
            json_body = {"body": b"{}", "Content_Type": "application/json"} if method == "post" else {}
            reply = served.client.ask(method.upper(), concrete, Authorization="Basic x", **json_body)  # type: ignore[arg-type]
            is_missing = concrete != path or path.endswith("/commission/report")
            expected = 401 if "security" in operation else 404 if is_missing else 200
            assert (reply.status, str(expected) in operation["responses"]) == (expected, True), (method, path)
            assert served.client.ask(method.upper(), concrete + "/x").status in (404, 415)
    assert told["paths"]["/api/v1/trigger"]["post"]["security"] == [{"token": []}]


def test_every_error_is_told_by_the_openapi_document_and_has_its_form(served: Served) -> None:
    told = served.client.get("/api/v1/openapi.json").json
    form = set(told["components"]["schemas"]["Problem"]["properties"])
    json_body = {"body": b"{}", "Content_Type": "application/json"}
    tried: list[tuple[str, dict[str, Any], int]] = [
        ("", {"Host": "evil.example"}, 421),
        ("", {"Origin": "http://evil.example"}, 403),
    ]
    posted: list[tuple[str, dict[str, Any], int]] = [
        ("", {"Content_Type": "text/plain"}, 415),
        ("", {"body": b" " * 5000}, 413),
        ("", {"body": b'{"recipe": true, "reason": 1, "x": 1}', "Authorization": f"Bearer {OTHER_TOKEN}"}, 422),
    ]
    asked = {"/api/v1/audit": "?limit=abc", "/api/v1/jobs": "?limit=0"}
    for path, operations in told["paths"].items():
        for method, operation in operations.items():
            ways = tried + (posted if method == "post" else [])
            if path in asked:
                ways = [*ways, (asked[path], {"Authorization": f"Bearer {OTHER_TOKEN}"}, 400)]
            for query, headers, status in ways:
                sent = {**(json_body if method == "post" else {}), **headers}
                reply = served.client.ask(method.upper(), path.replace("{job}", "1") + query, **sent)
                assert (reply.status, str(status) in operation["responses"]) == (status, True), (method, path, headers)
                assert reply.json.keys() == form


def test_the_reasons_are_told_in_both_languages(served: Served) -> None:
    told = served.client.get("/api/v1/reasons").json
    Reasons.model_validate(told)
    (no_frame,) = (entry for entry in told["reasons"] if entry["code"] == 100)
    assert "камер" in no_frame["ru"]["sentence"].lower()


def was_closed(one: socket.socket) -> bool:
    """Whether the other side has ended the connection."""
    one.setblocking(False)
    try:
        return one.recv(1) == b""
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


def test_a_flood_of_connections_leaves_the_daemon_its_descriptors(served: Served) -> None:
    opened = []
    try:
        for _ in range(150):
            opened.append(socket.create_connection(("127.0.0.1", served.client.port), timeout=BOUND_S))
        until(
            lambda: sum(map(was_closed, opened)) >= 80, 6, "an end of those beyond the bound"
        )  # sooner than by silence
        assert ask(served.cell.folder / "state", {"command": "status"})["state"] == "Ready"
    finally:
        for one in opened:
            one.close()
    until(lambda: served.client.get("/api/v1/state").status == 200, what="an answer again")


class Viewer:
    """Reads the event stream, or does not."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=BOUND_S)
        self.socket.sendall(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.lines = self.socket.makefile("rb")
        self.status = int(self.lines.readline().split()[1])

    def states(self) -> Iterator[dict[str, Any]]:
        for line in self.lines:
            if line.startswith(b"data: "):
                yield json.loads(line[6:])

    def close(self) -> None:
        self.lines.close()
        self.socket.close()


def test_events_tell_the_state_at_once_after_a_change_and_each_second(served: Served) -> None:
    viewer = Viewer(served.client.port)
    try:
        states = viewer.states()
        first = next(states)
        ServiceState.model_validate(first)
        assert first["state"] == "Ready"
        begun = time.monotonic()
        assert served.client.order("/api/v1/halt").status == 200
        assert any(state["state"] == "Halted" for state in states)
        assert next(states)["state"] == "Halted", "again, though nothing has changed"
        assert time.monotonic() - begun < 10
    finally:
        viewer.close()
        assert served.client.order("/api/v1/resume").status == 200


def test_viewers_are_bounded_and_those_that_do_not_read_hold_up_nobody(served: Served) -> None:
    viewers = [Viewer(served.client.port) for _ in range(16)]
    try:
        assert [viewer.status for viewer in viewers] == [200] * 16
        one_more = Viewer(served.client.port)
        one_more.close()
        assert one_more.status == 503
        for _ in range(2):  # none of the viewers reads
            assert next(viewers[0].states())["state"] == "Ready"
        assert served.state()["state"] == "Ready"
    finally:
        for viewer in viewers:
            viewer.close()

    def room_again() -> bool:
        viewer = Viewer(served.client.port)
        viewer.close()
        return viewer.status == 200

    until(room_again, what="room for viewers")


def test_what_is_drawn_over_a_frame_is_the_contour_that_was_sent(served: Served, job: dict[str, Any]) -> None:
    number = job["job_id"]
    drawn = served.client.get(f"/api/v1/jobs/{number}/drawing").json
    Drawing.model_validate(drawn)
    kept = served.client.get(f"/api/v1/jobs/{number}/files/document.json").json
    sent = kept["measurement"]["pixels"]["exterior"]
    assert [[round(x, 2), round(y, 2)] for x, y in sent] == drawn["exterior"]
    assert [drawn["height"], drawn["width"]] == kept["frame"]["shape"][:2]
    assert drawn["axes"]
    assert drawn["band_px"] > 0


def test_the_page_is_made_in_the_visitors_language_and_of_known_words_only(served: Served) -> None:
    english = served.client.get("/")
    assert english.headers["content-type"].startswith("text/html")
    russian = served.client.get("/", Cookie="language=ru; theme=dark").body.decode()
    assert '<html lang="ru" data-theme="dark">' in russian
    assert ">Готов<" in russian
    asked = served.client.get("/", Accept_Language="de-DE,ru-RU;q=0.8,en;q=0.5").body.decode()
    assert '<html lang="ru"' in asked
    odd = served.client.get("/", Cookie='language="><script>; theme=x').body
    assert odd.split(b"since")[0] == english.body.split(b"since")[0]
    assert b"{{" not in english.body
    for name in ("page.js", "page.css", "icon.svg", "texts.json"):
        file = served.client.get(f"/static/{name}")
        assert file.status == 200
        assert served.client.get(f"/static/{name}", If_None_Match=file.headers["etag"]).status == 304
    assert served.client.get("/static/page.html").status == 404


def test_a_person_gives_a_bounded_number_of_orders_a_minute(served: Served) -> None:
    statuses = [served.client.order("/api/v1/resume", THIRD_TOKEN).status for _ in range(31)]
    assert statuses == [409] * 30 + [429]
    assert served.client.order("/api/v1/resume").status == 409, "others go on"
