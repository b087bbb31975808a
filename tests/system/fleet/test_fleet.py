"""The page of fifty cells in Debian's Chromium, by a real broker: some silent, some old, some gone; and restarts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

from tests.support.interop.mosquitto import Mosquitto
from tests.support.interop.programs import node_modules
from tests.support.interop.said_cells import SaidCells, now_ms, ready, said_cells
from tests.support.processes.page_client import Client
from tests.support.processes.page_faults import AXE
from tests.support.processes.page_panel import chromium, clean_page
from tests.support.processes.processes import Process, combtrace, free_port, until

CELLS = 50
HALTED, FAULT, OLD, SILENT, GONE = 10, 11, 12, 13, 14
ALARM = "controller: 152 controller_lost: no answer for 3 s"


@dataclass
class Plant:
    """A broker, cells that speak to it, and the page."""

    broker: Mosquitto
    said: SaidCells
    folder: Path
    client: Client
    service: Process

    def start(self) -> None:
        self.service = Process(self.folder / "fleet.log", "fleet", "serve", "--config", self.folder / "fleet.yaml")

    def conditions(self) -> dict[str, str]:
        return {one["node"]: one["condition"] for one in self.client.get("/api/v1/cells").json["cells"]}

    def answers(self) -> bool:
        try:
            return self.client.get("/").status == 200
        except OSError:
            return False


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder, port = tmp_path_factory.mktemp("fleet"), free_port()
    broker = Mosquitto(folder)
    broker.start()
    cells = {number: ready(number) for number in range(CELLS)}
    cells[HALTED] |= {"State/Name": "Halted", "State/Reason": "halted: lunch (anna)"}
    cells[FAULT] |= {
        "State/Name": "Error",
        "State/Reason": "no answer",
        "State/Reason Code": 152,
        "Alarms/Texts": ALARM,
    }
    cells[OLD] |= {"Calibration/Age days": 500.0, "Service/Version": "0.1.0", "Recipes/Hash": "99" * 32}
    (folder / "fleet.yaml").write_text(
        f"broker: {{port: {broker.port}}}\npage: {{port: {port}}}\nstore: fleet.sqlite\n"
    )
    with said_cells(broker.port, cells) as said:
        service = Process(folder / "fleet.log", "fleet", "serve", "--config", folder / "fleet.yaml")
        plant = Plant(broker, said, folder, Client(port), service)
        try:
            until(plant.answers, what="the page")
            until(lambda: list(plant.conditions().values()) == ["here"] * CELLS, what="all cells")
            yield plant
        finally:
            plant.service.stop()
            broker.kill()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = chromium(playwright)
        yield started
        started.close()


def test_each_cell_is_named_with_its_state_its_reason_and_what_differs(plant: Plant, browser: Browser) -> None:
    with clean_page(browser, plant.client.url, locale="en-GB") as page:
        expect(page.locator("#cells tr")).to_have_count(CELLS)
        fault = page.locator(f"[id='plant/cell-{FAULT}']")
        expect(fault).to_contain_text("Not ready")
        expect(fault).to_contain_text(ALARM)
        expect(page.locator(f"[id='plant/cell-{HALTED}']")).to_contain_text("Halted")
        old = page.locator(f"[id='plant/cell-{OLD}']")
        for words in ("old", "version differs", "recipes differ"):
            expect(old).to_contain_text(words)
        link = page.locator(f"[id='plant/cell-{OLD}'] a")
        expect(link).to_have_attribute("href", f"http://cell-{OLD}:9770/")
        expect(page.locator("#summary")).to_contain_text(f"{CELLS - 2} Ready")
        page.goto(plant.client.url + "?language=ru")
        expect(page.locator("h1")).to_have_text("Ячейки")


def test_what_a_cell_says_next_is_shown_without_a_reload(plant: Plant, browser: Browser) -> None:
    with clean_page(browser, plant.client.url, locale="en-GB") as page:
        row = page.locator("[id='plant/cell-1']")
        expect(row).to_contain_text("Ready")
        job = {"Job/Number": 99, "Job/Settled": now_ms(), "Job/Outcome": "refused"}
        plant.said.say(1, {"State/Name": "SingleExecution", **job})
        expect(row).to_contain_text("Measuring")
        expect(row).to_contain_text("refused")
        plant.said.say(1, {"State/Name": "Ready"})
        expect(row).to_contain_text("Ready")


def test_one_that_falls_silent_and_one_that_dies_are_told_apart(plant: Plant, browser: Browser) -> None:
    with clean_page(browser, plant.client.url, locale="en-GB") as page:
        expect(page.locator("#cells tr")).to_have_count(CELLS)
        plant.said.quiet.add(SILENT)
        plant.said.dies(GONE)
        expect(page.locator(f"[id='plant/cell-{GONE}']")).to_contain_text("Gone")
        expect(page.locator(f"[id='plant/cell-{SILENT}']")).to_contain_text("Silent")
        axe = (node_modules() / "axe-core" / "axe.min.js").read_text()
        for theme in ("light", "dark"):
            page.emulate_media(color_scheme=theme)
            page.reload()
            expect(page.locator("#cells tr")).to_have_count(CELLS)
            page.evaluate(axe)
            assert page.evaluate(AXE) == []


def test_after_a_restart_of_the_page_those_that_are_missing_are_known(plant: Plant) -> None:
    plant.service.kill()
    plant.start()
    until(plant.answers, what="the page")
    until(lambda: plant.conditions().get("cell-0") == "here", what="those that speak")
    assert plant.conditions()[f"cell-{GONE}"] == "gone"
    assert len(plant.conditions()) == CELLS


def test_a_mistake_in_the_configuration_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "fleet.yaml").write_text("broker: {port: 1883}\nshifts: ['6 o clock']\n")
    done = combtrace("fleet", "serve", "--config", tmp_path / "fleet.yaml")
    assert done.returncode == 2
    assert "line 2: shifts: " in done.stderr
    assert "expected HH:MM" in done.stderr
