"""The operator's page as a person has it before them: a daemon's page in a browser, as large as a panel."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, Playwright, Route, expect

from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client
from tests.support.processes.processes import BOUND_S, until
from tests.support.real_parts import need_program

LOOK_S = 0.1  # asked without a pause, the daemon answers instead of measuring
expect.set_options(timeout=1000 * BOUND_S)
CHROMIUM = Path(__file__).with_name("chromium.sh")
PANEL = {"width": 1280, "height": 800}
FRAME = "#view image:not([visibility])"  # not the one that is still to come
EXPECTED_NOISE = (  # of requests that a test has refused, held or broken off
    "ERR_CONNECTION_REFUSED",
    "ERR_CONNECTION_RESET",
    "ERR_FAILED",
    "ERR_INCOMPLETE_CHUNKED_ENCODING",
    "ERR_CONTENT_LENGTH_MISMATCH",  # a daemon killed in the midst of an answer
    "401",
    "429",
    "503",
    "ERR_EMPTY_RESPONSE",
    "409",
)


@dataclass
class Panel:
    """A daemon, and its page in a browser."""

    cell: Cell
    client: Client
    page: Page

    def ordered(self, **content: Any) -> int:
        """The number of a job that was ordered past the page, once its evidence is kept."""
        until(lambda: self.client.get("/api/v1/state").json["link"]["not_ready"] is None, what="a ready controller")
        reply = until(
            lambda: (r := self.client.order("/api/v1/trigger", content=content)).status == 202 and r, what="it"
        )
        path = f"/api/v1/jobs/{reply.json['job']}"
        until(lambda: self.client.get(path).json["files"], what="evidence", pause_s=LOOK_S)
        return int(reply.json["job"])

    def accepted(self, count: int) -> list[int]:
        """Numbers of the last jobs, which are accepted ones; where others are among them, so many are ordered."""
        last = self.client.get(f"/api/v1/jobs?limit={count}").json["jobs"]
        if [job["outcome"] for job in last if job["files"]] == ["accepted"] * count:
            return [job["job_id"] for job in reversed(last)]
        return [self.ordered() for _ in range(count)]


def chromium(playwright: Playwright) -> Browser:
    """Debian's Chromium, started; without it the test skips."""
    need_program("chromium", "apt-get install chromium")
    return playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])


@contextmanager
def clean_page(browser: Browser, url: str, noise: Sequence[str] = (), **more: Any) -> Iterator[Page]:
    """The page there; nothing but the noise may go wrong in it, and nothing be loaded from elsewhere."""
    page = browser.new_page(viewport=PANEL, **more)
    page.set_default_timeout(1000 * BOUND_S)
    complaints: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: message.type == "error" and complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto(url)
    yield page
    page.close()
    wrong = [one for one in complaints if not any(part in one for part in noise)]
    assert not wrong, wrong
    assert [one for one in asked if not one.startswith(url)] == [], "nothing is loaded from elsewhere"


def settled_state(panel: Panel, kind: str) -> None:
    """Wait until the banner tells a state of this kind."""
    expect(panel.page.locator("#banner")).to_have_attribute("data-kind", kind)


def holding(routes: list[Route]) -> Callable[[Route], None]:
    """A handler of requests that lets them wait in the list."""

    def hold(route: Route) -> None:
        routes.append(route)

    return hold
