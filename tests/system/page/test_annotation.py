"""The page on which true outlines are drawn, in a browser, and what it answers to those who should not ask."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect, sync_playwright

from tests.support.pictures.combs import write_combs
from tests.support.processes.page_client import Client, Reply
from tests.support.processes.page_panel import chromium, clean_page
from tests.support.processes.processes import Process, called, until

SQUARE = [[40.0, 40.0], [40.0, 140.0], [140.0, 140.0], [140.0, 40.0]]
CROSSING = [[40.0, 40.0], [140.0, 140.0], [140.0, 40.0], [40.0, 140.0]]
WHOLE = "-0.5 -0.5 320 240"
ON_SCREEN = """([x, y]) => {
  const at = new DOMPoint(x, y).matrixTransform(document.getElementById("view").getScreenCTM());
  return [at.x, at.y];
}"""


@dataclass
class Served:
    """The page of a folder with three small pictures."""

    folder: Path
    process: Process
    client: Client
    path: str

    def truth(self, name: str) -> dict[str, Any]:
        return dict(json.loads((self.folder / name).read_text()))

    def save(self, number: int, **content: Any) -> Reply:
        return self.client.order(f"{self.path}pictures/{number}/truth", None, {"holes": [], "edge": "cut", **content})


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("drawn")
    process = Process(folder / "log", "judge", "--annotate", write_combs(folder / "pictures"))
    try:
        found = until(lambda: re.search(r"http://127.0.0.1:(\d+)(/\S+/)\n", process.text), what="the address")
        yield Served(folder / "pictures", process, Client(int(found[1])), found[2])
        process.send(signal.SIGINT)
        assert process.ended() == 0
        assert "Traceback" not in process.text
    finally:
        process.kill()


def test_only_who_has_the_whole_address_gets_anything(served: Served) -> None:
    client, path = served.client, served.path
    assert len(path) > 30
    for asked in ("/", "/pictures", "/static/annotate.js", "/wrong/", f"{path[:-2]}/pictures", "//", "/%ff/"):
        reply = client.get(asked)
        assert (reply.status, b"there is nothing here" in reply.body) == (404, True), asked
    assert client.get(f"{path}pictures", Host="evil.example").status == 421
    assert client.get(f"{path}pictures", Origin="http://evil.example").status == 403
    assert client.get(f"{path}pictures", Sec_Fetch_Site="cross-site").status == 403
    for missing in ("static/../annotation.py", "static/page.html", "pictures/3/image", "pictures/-1/image", "nothing"):
        assert client.get(path + missing).status == 404, missing
    page = client.get(path)
    assert (page.status, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert "script-src 'self'" in page.headers["content-security-policy"]
    assert [one["name"] for one in client.get(f"{path}pictures").json] == ["0.png", "1.png", "2.png"]


def test_what_is_no_outline_is_not_saved(served: Served) -> None:
    for content, status, told in (
        ({"outer": CROSSING}, 422, "not saved: the exterior meets itself: edges 0 and 2"),
        ({"outer": SQUARE, "holes": [[[200, 200], [210, 200], [210, 210]]]}, 422, "lies outside the exterior"),
        ({"outer": SQUARE[:2]}, 422, "outer"),
        ({"outer": [*SQUARE[:3], [None, 1]]}, 422, "outer"),
        ({"outer": SQUARE, "edge": "wavy"}, 422, "edge"),
        ({"outer": SQUARE, "image": "../../other"}, 422, "image"),
        ({"outer": [[0.123456789, 0.123456789]] * 60_000}, 413, "bytes"),
    ):
        reply = served.save(0, **content)
        assert (reply.status, told in reply.json["error"]) == (status, True), reply.body
    assert served.client.ask("POST", f"{served.path}pictures/0/truth", body=b"{}").status == 415
    assert not (served.folder / "0.json").exists()


def test_a_file_that_is_no_truth_is_left_as_it_is(served: Served) -> None:
    broken = served.folder / "2.json"
    broken.write_text("{'outer'")
    assert "is no JSON" in served.save(2, outer=SQUARE).json["error"]
    assert "is no JSON" in served.client.get(f"{served.path}pictures/2/truth").json["error"]
    assert broken.read_text() == "{'outer'"
    broken.unlink()


class Hand:
    """A mouse over the picture, in its pixels."""

    def __init__(self, page: Page) -> None:
        self.page = page

    def over(self, place: tuple[float, float]) -> None:
        self.page.mouse.move(*self.page.evaluate(ON_SCREEN, list(place)))

    def click(self, *places: tuple[float, float], button: Any = "left") -> None:
        for place in places:
            self.over(place)
            self.page.mouse.down(button=button)
            self.page.mouse.up(button=button)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.over(start)
        self.page.mouse.down()
        self.over(end)
        self.page.mouse.up()

    def saved(self, name: str) -> None:
        self.page.locator("#save").click()
        expect(self.page.locator("#said")).to_have_text(f"saved {name}")


@pytest.fixture
def hand(served: Served) -> Iterator[Hand]:
    """The page in a browser."""
    url = f"{served.client.url[:-1]}{served.path}"
    with sync_playwright() as playwright, chromium(playwright) as browser, clean_page(browser, url) as page:
        expect(page.locator("#view image")).to_have_attribute("width", "320")
        yield Hand(page)


def test_an_outline_is_drawn_mended_and_saved_and_what_else_the_file_holds_stays(served: Served, hand: Hand) -> None:
    page = hand.page
    hand.click((40, 40), (40, 200), (280, 200), (280, 40))
    page.locator("#save").click()
    expect(page.locator("#said")).to_contain_text("close the ring first")
    hand.click((40, 40))  # the first vertex closes the ring
    page.locator("#hole").click()
    hand.click((100, 100), (100, 140), (140, 140))
    page.locator("#view").hover(position={"x": 5, "y": 5})
    page.keyboard.press("Enter")
    page.locator("#save").click()
    expect(page.locator("#said")).to_have_text("choose the edge first")
    page.locator("#edge").select_option("cells")
    hand.saved("0.json")
    truth = served.truth("0.json")
    assert (truth["image"], truth["edge"], [len(truth["outer"]), len(truth["holes"][0])]) == ("0.png", "cells", [4, 3])
    assert close(truth["outer"][2], (280, 200))
    hand.over((60, 60))
    page.mouse.wheel(0, -300)
    expect(page.locator("#view")).not_to_have_attribute("viewBox", WHOLE)
    hand.drag((60, 60), (90, 90))  # the picture
    hand.drag((40, 40), (50.0, 55.0))
    hand.drag((45, 127.5), (47.0, 127.0))  # of the edge, which gets a vertex
    page.locator("#whole").click()
    expect(page.locator("#view")).to_have_attribute("viewBox", WHOLE)
    hand.click((280, 40), button="right")
    hand.click((100, 100))
    page.locator("#remove").click()
    (served.folder / "0.json").write_text(json.dumps({**truth, "tier": "A", "note": "Ω"}))
    hand.saved("0.json")
    mended = served.truth("0.json")
    assert (mended["tier"], mended["note"], mended["holes"], mended["edge"]) == ("A", "Ω", [], "cells")
    assert [close(*pair) for pair in zip(mended["outer"], [(50, 55), (47, 127), (40, 200), (280, 200)], strict=True)]
    expect(page.locator("#picture option").first).to_have_text("✓ 0.png")
    page.locator("#picture").select_option("1")
    expect(page.locator("#said")).to_have_text("")
    page.locator("#ours").click()
    expect(page.locator("#view .ring")).to_have_count(1)
    page.locator("#edge").select_option("cut")
    hand.saved("1.json")
    page.locator("#picture").select_option("0")
    expect(page.locator("#edge")).to_have_value("cells")
    (served.folder / "0.json").unlink()
    (served.folder / "0.png").rename(served.folder.parent / "0.png")
    (served.folder / "2.png").rename(served.folder.parent / "2.png")
    judged = called("judge", served.folder)
    assert (judged.returncode, "IoU 1.000 mean" in judged.stdout) == (0, True), judged.stdout


def close(found: list[float], expected: tuple[float, float]) -> bool:
    """A pixel of the screen is less than half of one of the picture."""
    assert found == pytest.approx(expected, abs=0.6)
    return True


def test_what_does_not_go_with_annotating_is_told(tmp_path: Path, served: Served) -> None:
    folder = write_combs(tmp_path / "combs")
    for arguments, told in (
        (("--annotate", folder, "--json", "-"), "--json: nothing is judged with --annotate"),
        ((folder, "--port", "8000"), "--port: is of the page that --annotate serves"),
        (("--annotate", folder, "--port", "70000"), "--port 70000: expected 1 to 65535"),
        (("--annotate", folder, "--port", served.client.port), f"--port {served.client.port}: cannot be listened on"),
    ):
        done = called("judge", *map(str, arguments))
        assert (done.returncode, told in done.stderr) == (2, True), done.stderr
