"""Orders by PIN, one person at a time: what shop-floor people do, and what somebody else would try."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor

import pytest
from playwright.sync_api import Browser, expect

from service.web.people.pins import FREE_TRIES, FREE_TRIES_OF_ADDRESS
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import TOKEN, Client, Reply, people_file
from tests.support.processes.page_panel import EXPECTED_NOISE, clean_page

PINS = {"anna": "4711", "oleg": "081500", "ivan": "12345678"}


@pytest.fixture(scope="module")
def pins() -> dict[str, str]:
    """The page takes orders by token and by these."""
    return PINS


@pytest.fixture
def client(cell: tuple[Cell, Client]) -> Client:
    """Who asks past a browser."""
    cell[0].ready()
    return cell[1]


def ordered(
    client: Client, name: str, pin: str | None = None, path: str = "/api/v1/resume", **content: object
) -> Reply:
    """An order by a PIN; ending a halt that there is not shows who may, and changes nothing."""
    proof = f"Pin {name}:{PINS.get(name, '') if pin is None else pin}"
    return client.order(path, token=None, content=content, Authorization=proof)


def noted(client: Client) -> list[dict[str, str | None]]:
    return list(client.get("/api/v1/audit?limit=50", Authorization=f"Bearer {TOKEN}").json["notes"])


def test_an_order_by_a_pin_stands_in_the_journal_with_its_person(client: Client) -> None:
    assert ordered(client, "anna", path="/api/v1/halt", reason="blade").status == 200
    assert ordered(client, "anna").status == 200
    newest, before = noted(client)[:2]
    assert (newest["who"], newest["action"], newest["result"]) == ("anna", "resume", "Ready")
    assert (before["who"], before["action"], before["detail"]) == ("anna", "halt", "blade")
    assert client.get("/api/v1/people").json == {"names": list(PINS)}
    assert client.get("/api/v1/audit", Authorization="Pin anna:4711").status == 401


def test_another_person_needs_a_word_to_take_over_and_it_is_noted(client: Client) -> None:
    assert ordered(client, "anna", take_over="the shift begins").status == 409  # nothing to resume, and yet hers
    held = client.get("/api/v1/state").json["lease"]
    assert held["who"] == "anna"
    refused = ordered(client, "oleg", path="/api/v1/trigger")
    assert (refused.status, refused.json["holder"]) == (409, "anna")
    assert ordered(client, "oleg", path="/api/v1/trigger", take_over="  a ").json["holder"] == "anna"
    assert ordered(client, "oleg", path="/api/v1/trigger", take_over="x" * 201).status == 422
    assert client.get("/api/v1/state").json["lease"]["who"] == "anna"
    taken = ordered(client, "oleg", path="/api/v1/trigger", take_over="anna has left")
    assert taken.status == 202, taken.body
    assert client.get("/api/v1/state").json["lease"]["who"] == "oleg"
    notes = [(note["who"], note["action"], note["detail"]) for note in noted(client)[:2]]
    assert ("oleg", "take over", "from anna: anna has left") in notes
    by_token = client.order("/api/v1/trigger")
    assert by_token.json["holder"] == "oleg", "a token is no way around it, though it is anna's"


def test_a_halt_needs_nobodys_word(client: Client) -> None:
    ordered(client, "oleg", take_over="to begin with")
    assert ordered(client, "anna", path="/api/v1/halt").status == 200
    assert client.get("/api/v1/state").json["lease"]["who"] == "oleg"
    assert ordered(client, "oleg").status == 200


def test_guessing_a_persons_pin_locks_that_person_also_for_the_right_one(cell: tuple[Cell, Client]) -> None:
    guesser = Client(cell[1].port, source="127.0.0.9")
    replies = [ordered(guesser, "ivan", "0000") for _ in range(FREE_TRIES)]
    assert [reply.status for reply in replies] == [401] * FREE_TRIES
    locked = ordered(guesser, "ivan", PINS["ivan"])
    assert locked.status == 429
    assert int(locked.headers["retry-after"]) > 1
    assert ordered(cell[1], "ivan").status == 429, "from wherever"
    assert ordered(cell[1], "anna", take_over="to show it").status in (200, 409), "others go on"
    assert [note["action"] for note in noted(cell[1])].count("wrong PIN") >= FREE_TRIES


def test_guessing_over_all_people_locks_the_address_and_a_right_pin_does_not_open_it(
    cell: tuple[Cell, Client],
) -> None:
    guesser = Client(cell[1].port, source="127.0.0.10")
    for number in range(FREE_TRIES_OF_ADDRESS):
        assert ordered(guesser, f"nobody{number}", "0000").status == 401
        if number == 1:
            assert ordered(guesser, "oleg", take_over="to clear the address").status in (200, 409)
    assert ordered(guesser, "oleg").status == 429
    assert ordered(cell[1], "oleg", take_over="still here").status in (200, 409)


def test_guesses_that_come_at_once_are_all_counted(cell: tuple[Cell, Client]) -> None:
    guesser = Client(cell[1].port, source="127.0.0.11")
    with ThreadPoolExecutor(12) as many:
        found = list(many.map(lambda number: ordered(guesser, f"ghost{number}", "1234").status, range(12)))
    assert found.count(401) == FREE_TRIES_OF_ADDRESS
    assert found.count(429) == 12 - FREE_TRIES_OF_ADDRESS


@pytest.mark.parametrize(
    "proof", ["Pin", "Pin ", "Pin ghost", "Pin :", "Pin ghost:", "Basic YW5uYTo0NzEx", "Pin ghost:4711\u00b2"]
)
def test_half_a_proof_is_none(cell: tuple[Cell, Client], proof: str) -> None:
    client = Client(cell[1].port, source=f"127.0.1.{1 + sum(proof.encode()) % 250}")
    assert client.order("/api/v1/trigger", token=None, Authorization=proof).status == 401


def test_a_file_that_others_can_read_gives_no_orders(cell: tuple[Cell, Client]) -> None:
    path = cell[0].folder / "people"
    path.chmod(0o644)
    try:
        assert ordered(cell[1], "anna").status == 503
        assert cell[1].get("/api/v1/people").status == 503
    finally:
        path.chmod(0o600)


def test_the_pin_is_in_no_log_no_journal_and_no_answer(cell: tuple[Cell, Client]) -> None:
    ordered(cell[1], "oleg", take_over="once more")
    for name in ("service.log", "journal.sqlite", "journal.sqlite-wal"):
        path = cell[0].folder / name
        assert not path.exists() or PINS["oleg"].encode() not in path.read_bytes()
    told = json.dumps([cell[1].get(f"/api/v1/{what}").json for what in ("state", "people", "jobs")])
    assert PINS["oleg"] not in told
    assert "scrypt" not in told


def test_in_the_browser_a_person_is_touched_a_pin_typed_and_a_word_said(
    cell: tuple[Cell, Client], browser: Browser
) -> None:
    assert ordered(cell[1], "anna", take_over="to be there first").status in (200, 409)
    with clean_page(browser, cell[1].url, EXPECTED_NOISE, has_touch=True, locale="en-GB") as page:
        expect(page.locator("#lease")).to_have_text("anna gives orders at this moment.")
        page.locator("#trigger").click()
        expect(page.locator("#person option")).to_have_text([*PINS, "with a token"])
        page.locator("#person").select_option("oleg")
        expect(page.locator("#token-what")).to_have_text("PIN")
        assert page.locator("#token").evaluate("e => [e.inputMode, e.type]") == ["numeric", "password"]
        page.locator("#token").fill("9999")
        page.locator("#token-ok").click()
        expect(page.locator("#token-told")).to_have_text("The PIN is not right.")
        page.locator("#token").fill(PINS["oleg"])
        page.locator("#token-ok").click()
        expect(page.locator("#lease-told")).to_have_text("anna gives orders at this moment.")
        page.locator("#lease-ok").click()
        expect(page.locator("#lease-dialog")).to_be_visible()  # not without a word
        page.locator("#take-over").fill("new shift")
        page.locator("#lease-ok").click()
        expect(page.locator("#told")).to_contain_text(": accepted")
        expect(page.locator("#lease")).to_have_text("oleg gives orders at this moment.")
        page.locator("#language").click()
        expect(page.locator("#lease")).to_have_text("Сейчас команды отдаёт oleg.")
        stored = page.evaluate("[document.cookie, JSON.stringify(localStorage), JSON.stringify(sessionStorage)].join()")
        assert PINS["oleg"] not in stored


def test_a_line_taken_out_counts_at_once(cell: tuple[Cell, Client]) -> None:
    people_file(cell[0].folder, {name: pin for name, pin in PINS.items() if name != "oleg"})
    assert ordered(cell[1], "oleg").status == 401
    assert cell[1].get("/api/v1/people").json == {"names": ["anna", "ivan"]}
