"""A cell set up in a browser alone, from a folder without a calibration to the first accepted job; and who may not."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from service.cli.main import main
from service.measuring.calibration_file import load_record
from tests.support.pictures.bare_cell import BareCell
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import TOKEN, Client, token_file
from tests.support.processes.page_panel import EXPECTED_NOISE, chromium, clean_page
from tests.support.processes.processes import free_port, lines, until

VIEWS = 14
BLOCK_MM2 = 190 * 130
STEPS = ("camera", "board", "calibration", "height", "alignment", "table", "marks", "controller", "job")


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> BareCell:
    """What the camera sees: nothing but the table, to begin with."""
    bare = BareCell(tmp_path_factory.mktemp("seen") / "scene")
    bare.lies(bare.table())
    return bare


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, bare: BareCell) -> Iterator[tuple[Cell, Client]]:
    """A daemon whose configuration names files that are not there yet."""
    folder, port = tmp_path_factory.mktemp("cell"), free_port()
    token_file(folder)
    started = Cell(
        folder,
        triggers="[]",
        camera=f"{{kind: files, path: {bare.folder}, loop: true}}",
        calibration=folder / "calibration.yaml",
        trigger_every_s=None,
        more=f"page: {{port: {port}, token_file: tokens}}\ntable: {{file: table.npz}}\n",
    )
    try:
        yield started, Client(port)
    finally:
        started.stop()


@pytest.fixture(scope="module")
def browser(cell: tuple[Cell, Client]) -> Iterator[Browser]:
    """Chromium, beside a daemon that serves its page and is not ready."""
    with sync_playwright() as playwright:
        started = chromium(playwright)
        until(lambda: "page: http" in cell[0].service.text, what="the page")
        yield started
        started.close()


def prove(page: Page) -> None:
    """Give the token that is asked for."""
    page.locator("#token").fill(TOKEN)
    page.locator("#token-ok").click()


def done(page: Page, name: str, kind: str = "accepted") -> None:
    """Wait until a step stands so."""
    expect(page.locator(f'[data-step="{name}"]')).to_have_attribute("data-kind", kind)


def press(page: Page, button: str) -> None:
    """Press it, and wait until what it does is done."""
    page.locator(f"#{button}").click()
    expect(page.locator("#running")).to_have_text("")


def jogged(seed: int = 9) -> list[tuple[float, float, float, float]]:
    """Corners of the flat board, and where the machine has them: a quarter turn and a shift, jogged to twice each."""
    random = np.random.default_rng(seed)
    corners = [(30.0, 30.0), (300.0, 30.0), (300.0, 210.0), (30.0, 210.0)] * 2
    return [(x, y, *np.round(np.array([1000 - y, x - 40]) + random.normal(0, 0.05, 2), 3)) for x, y in corners]


def test_a_cell_is_set_up_to_its_first_accepted_job(
    cell: tuple[Cell, Client], bare: BareCell, browser: Browser
) -> None:
    with clean_page(browser, cell[1].url, EXPECTED_NOISE, locale="en-GB") as page:
        page.locator('a[href="/commission"]').click()
        expect(page.locator("#state")).to_have_text("Not ready")
        for name in STEPS:
            done(page, name, "none")
        expect(page.locator("#calibrate")).to_be_disabled()
        page.locator("#halt").click()
        prove(page)
        expect(page.locator("#state")).to_have_text("Halted")
        pictures_of_the_board(page, bare)

        page.reload()
        expect(page.locator("#shots li")).to_have_count(VIEWS)
        cell[0].service.stop()
        cell[0].service = cell[0].start_service()
        expect(page.locator("#state")).to_have_text("Halted")
        page.reload()
        done(page, "board")
        expect(page.locator("#square-mm")).to_have_value("30")
        expect(page.locator("#missing")).to_have_text("Nothing is missing: calibrate")

        until(lambda: cell[1].get("/api/v1/state").json["link"]["up"], what="the link")
        linked = cell[1].get("/api/v1/state").json["link"]["connections"]
        page.locator("#calibrate").click()
        prove(page)
        expect(page.locator("#adopt")).to_be_enabled()
        link = cell[1].get("/api/v1/state").json["link"]
        assert (link["up"], link["connections"]) == (True, linked), "heartbeats go on while it calibrates"
        assert not (cell[0].folder / "calibration.yaml").exists(), "it is not in force before somebody adopts it"
        same_by_command(page, cell[0].folder)
        whole_report(page)
        press(page, "adopt")
        done(page, "calibration")
        page.locator("#height-mm").fill("20")
        press(page, "height")
        done(page, "height")
        for point in jogged():
            for field, value in zip(("x-mm", "y-mm", "machine-x-mm", "machine-y-mm"), point, strict=True):
                page.locator(f"#{field}").fill(str(value))
            press(page, "point")
        expect(page.locator("#points li")).to_have_count(8)
        press(page, "align")
        done(page, "alignment")
        bare.lies(bare.table())
        press(page, "teach")
        done(page, "table")
        press(page, "marks")
        done(page, "marks")
        expect(page.locator('[data-step="marks"] .lines')).to_contain_text("Marks 3, 4 of DICT_4X4_50")
        press(page, "probe")
        done(page, "controller")

        bare.lies(bare.block())
        page.locator("#resume").click()
        expect(page.locator("#state")).to_have_text("Ready")
        page.locator("#trigger").click()
        done(page, "job")
        scores = page.locator("#steps meter").evaluate_all("all => all.map(one => one.value)")
        assert scores == [100] * len(STEPS)
    (job,) = lines(cell[0].accepted)
    exterior = np.array(job["millimetres"]["exterior"])
    assert abs(abs(area(exterior)) - BLOCK_MM2) < 0.01 * BLOCK_MM2
    assert 780 < exterior[:, 0].min() < exterior[:, 0].max() < 1000, "in the machine's frame"


def same_by_command(page: Page, folder: Path) -> None:
    """The command that the step shows makes the same calibration of the same pictures."""
    words = shlex.split(str(page.locator('[data-step="calibration"] code').text_content()))[1:]
    words[words.index("--output") + 1] = str(folder / "by-command.yaml")
    assert main(words) == 0
    by_page, by_command = (
        load_record(path) for path in (folder / "state" / "commission" / "calibration.yaml", folder / "by-command.yaml")
    )
    assert by_page.made == by_command.made
    assert by_page.content.keys() == by_command.content.keys()
    places = np.array([[0.0, 0.0], [959.0, 719.0]])
    apart_mm = by_page.calibration.to_work(places, 20.0) - by_command.calibration.to_work(places, 20.0)
    assert np.abs(apart_mm).max() < 1e-6, "solved again, the last digits differ"


def whole_report(page: Page) -> None:
    """The report has its pictures, and nothing in it is against its policy."""
    complaints: list[str] = []
    page.context.on("console", lambda message: complaints.append(message.text))
    with page.context.expect_page() as opened:
        page.locator("#report").click()
    report = opened.value
    expect(report.locator("figure svg")).to_have_count(7)
    assert report.locator("image").first.evaluate("e => e.getBBox().width") > 100
    policy = page.request.get(report.url).headers["content-security-policy"]
    assert policy.startswith("default-src 'none'; style-src 'sha256-")
    report.close()
    assert complaints == []


def pictures_of_the_board(page: Page, bare: BareCell) -> None:
    """As a person takes them, one of which shows no board."""
    boards = bare.boards(VIEWS)
    bare.lies(next(boards))
    page.locator("#live").click()
    expect(page.locator("#live-figures")).to_contain_text("sharpest seen")
    page.locator("#live").click()
    expect(page.locator("#live-box")).to_be_hidden()
    press(page, "look")
    done(page, "camera")
    page.locator("#square-mm").fill("30")
    page.locator("#marker-mm").fill("21")
    press(page, "board")
    press(page, "shoot-flat")
    expect(page.locator("#missing")).to_contain_text("11 more pictures that serve")
    seen = page.locator("#coverage rect").count()
    bare.lies(bare.table())
    press(page, "shoot")
    expect(page.locator('#shots li[data-kind="refused"]')).to_contain_text("no marker of DICT_5X5_250 is seen")
    shown = "[...document.querySelectorAll('#shots img')].every(one => one.naturalWidth > 0)"
    until(lambda: page.evaluate(shown), what="the pictures")
    page.locator('#shots li[data-kind="refused"] button').click()
    expect(page.locator("#shots li")).to_have_count(1)
    expect(page.locator("#running")).to_have_text("")
    for number, board in enumerate(boards, 2):
        bare.lies(board)
        press(page, "shoot")
        expect(page.locator('#shots li[data-kind="accepted"]')).to_have_count(number)
    assert page.locator("#coverage rect").count() > 2 * seen
    done(page, "board")


def area(ring: np.ndarray) -> float:
    """Of a ring, mm²."""
    x, y = ring.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
