"""The live view in a real browser: what the camera sees between jobs, and what becomes of it when nobody looks."""

from __future__ import annotations

import os
import signal
import subprocess

import pytest
from playwright.sync_api import expect

from tests.support.processes.page_panel import FRAME, Panel, settled_state
from tests.support.processes.processes import until

LOOK = "e => e.href.baseVal.startsWith('/api/v1/live/')"


def measuring(panel: Panel) -> list[int]:
    """The processes that measure looks for the daemon."""
    told = subprocess.run(
        ["ps", "-ww", "--ppid", str(panel.cell.service.process_id), "-o", "pid=,args="],
        check=False,
        capture_output=True,
        text=True,
    ).stdout
    return [int(line.split()[0]) for line in told.splitlines() if "spawn_main" in line]


def live(panel: Panel) -> None:
    """Turn it on and wait for the first look."""
    settled_state(panel, "ready")
    expect(panel.page.locator("#live")).to_be_enabled()
    panel.page.locator("#live").click()
    expect(panel.page.locator("#live-verdict")).to_have_attribute("data-kind", "accepted")


def test_it_shows_what_a_job_now_would_come_to_and_a_job_goes_first(panel: Panel) -> None:
    page = panel.page
    before = panel.ordered()
    expect(page.locator("#outcome")).to_have_text(f"job {before}: accepted")
    live(panel)
    expect(page.locator("#live-word")).to_have_text("A job now would be accepted")
    expect(page.locator("#live-values")).to_contain_text("Sharpness")
    expect(page.locator("#live-values")).to_contain_text("Too bright")
    assert page.locator(FRAME).last.evaluate(LOOK)
    expect(page.locator("#view .cross")).to_have_count(1)
    expect(page.locator("#view .exterior")).to_have_count(1)
    assert page.locator("#view .axis").count() > 4
    expect(page.locator("#result")).to_be_hidden()
    first = page.locator(FRAME).last.get_attribute("href")
    expect(page.locator(FRAME).last).not_to_have_attribute("href", str(first))
    job = panel.ordered()
    expect(page.locator("#last-of")).to_contain_text(f"job {job}")
    assert page.locator(FRAME).last.evaluate(LOOK), "what is looked at live stays"
    page.locator("#language").click()
    expect(page.locator("#live-word")).to_have_text("Задание сейчас было бы принято")
    page.locator("#language").click()
    page.keyboard.press("Escape")
    expect(page.locator("#live-view")).to_be_hidden()
    expect(page.locator("#outcome")).to_have_text(f"job {job}: accepted")
    expect(page.locator("#view .cross")).to_have_count(0)


def test_a_touched_job_ends_it_and_so_does_its_own_button(panel: Panel) -> None:
    page = panel.page
    number = panel.accepted(1)[0]
    live(panel)
    page.locator(f'#strip button[data-job="{number}"]').click()
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "false")
    expect(page.locator("#outcome")).to_have_text(f"job {number}: accepted")
    page.keyboard.press("v")
    expect(page.locator("#live")).to_have_attribute("aria-pressed", "true")
    page.locator("#live").click()
    expect(page.locator("#result")).to_be_visible()


def test_halted_it_still_looks_and_says_that_no_trigger_is_taken(panel: Panel) -> None:
    live(panel)
    assert panel.client.order("/api/v1/halt").status == 200
    try:
        expect(panel.page.locator("#live-waits")).to_contain_text("no trigger is taken")
        expect(panel.page.locator("#live-verdict")).to_have_attribute("data-kind", "accepted")
    finally:
        assert panel.client.order("/api/v1/resume").status == 200
    settled_state(panel, "ready")


def test_nobody_looks_and_nothing_measures(panel: Panel) -> None:
    live(panel)
    assert len(measuring(panel)) == 1
    panel.page.goto("about:blank")
    until(lambda: not measuring(panel), what="the end of what measures looks")


def test_a_hidden_page_does_not_keep_the_camera_at_work(panel: Panel) -> None:
    live(panel)
    panel.page.evaluate("Object.defineProperty(document, 'hidden', { value: true })")
    until(lambda: not measuring(panel), what="the end of what measures looks")
    expect(panel.page.locator("#live")).to_have_attribute("aria-pressed", "true")


def test_what_measures_looks_may_be_killed_and_the_daemon_too(panel: Panel) -> None:
    live(panel)
    before = panel.client.get("/api/v1/live").json["look"]["number"]
    os.kill(measuring(panel)[0], signal.SIGKILL)
    until(lambda: (panel.client.get("/api/v1/live").json["look"] or {}).get("number", 0) > before + 3000, what="looks")
    panel.ordered()
    (left,) = measuring(panel)
    panel.cell.service.kill()
    until(lambda: not _runs(left), what="the end of what measured for it")
    panel.cell.service = panel.cell.start_service()
    settled_state(panel, "ready")


def _runs(process_id: int) -> bool:
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    return (
        "spawn_main"
        in subprocess.run(
            ["ps", "-ww", "-p", str(process_id), "-o", "args="], check=False, capture_output=True, text=True
        ).stdout
    )


@pytest.mark.parametrize("path", ["/api/v1/live", "/api/v1/live/1"])
def test_only_who_may_see_the_pages_pictures_sees_it(panel: Panel, path: str) -> None:
    assert panel.client.get(path, Host="elsewhere.example").status == 421
    assert panel.client.get(path, Origin="http://elsewhere.example").status == 403
    assert panel.client.get(path, Sec_Fetch_Site="cross-site").status == 403
    assert panel.client.order(path).status == 405


@pytest.mark.parametrize("look", ["0", "1", "-1", "1.5", "%2e%2e", "٣", "9" * 17, "99999999999999"])
def test_there_is_no_other_file_behind_a_looks_number(panel: Panel, look: str) -> None:
    from urllib.parse import quote

    assert panel.client.get(f"/api/v1/live/{quote(look, safe='%')}").status == 404


@pytest.mark.parametrize("after", ["0", "-1", "x", "9" * 17])
def test_a_question_that_makes_no_sense_is_refused(panel: Panel, after: str) -> None:
    assert panel.client.get(f"/api/v1/live?after={after}").status == 400
