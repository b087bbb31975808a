"""The pictures of the operator's guide, made anew: `python -m tests.support.processes.page_pictures docs/pictures`.

A daemon on the sample pictures, one of which is shifted so that its block is cut by the picture's border.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, sync_playwright

from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.page_panel import PANEL, chromium
from tests.support.processes.processes import free_port, until

QUALITY = 82
# An image in SVG tells nothing of itself; the frame is there once its resource is.
ALL_LOADED = """() => {
  const frame = document.querySelector("#view image:not([visibility])")?.href.baseVal;
  const come = performance.getEntriesByType("resource").some((e) => e.name.endsWith(frame) && e.responseEnd > 0);
  const strip = [...document.querySelectorAll("#strip img")];
  return come && strip.every((image) => image.complete && image.naturalWidth > 0);
}"""


def pictures_to_take(folder: Path) -> None:
    """Sample pictures, the third with its block half out of sight."""
    folder.mkdir()
    samples = sorted(SAMPLES.glob("*.jpg"))[:4]
    for number, sample in enumerate(samples, 1):
        shutil.copy(sample, folder / f"{number}.jpg")
    moved = cv2.imread(str(samples[2]))
    assert moved is not None
    cv2.imwrite(str(folder / "3.jpg"), np.roll(moved, moved.shape[1] // 3, axis=1))


def ordered(client: Client) -> int:
    """One more job, to its end: its number."""
    reply = until(lambda: (r := client.order("/api/v1/trigger")).status == 202 and r, what="a job")
    until(lambda: client.get(f"/api/v1/jobs/{reply.json['job']}").json["files"], what="its evidence")
    return int(reply.json["job"])


def take(page: Page, to: Path, name: str) -> None:
    """One picture in each language, English in light and Russian in dark."""
    for language, theme in (("en", "light"), ("ru", "dark")):
        page.evaluate("([theme]) => { document.documentElement.dataset.theme = theme; }", [theme])
        if page.evaluate("document.documentElement.lang") != language:
            page.locator("#language").click()
        until(lambda: page.evaluate(ALL_LOADED), what="the pictures on the page")
        page.wait_for_timeout(600)
        page.screenshot(path=to / f"page-{name}-{language}.jpg", type="jpeg", quality=QUALITY)
    page.locator("#language").click()


def main(to: Path) -> None:
    """All of them."""
    folder = Path(tempfile.mkdtemp())
    port = free_port()
    token_file(folder)
    pictures_to_take(folder / "in")
    more = f"page: {{port: {port}, token_file: tokens}}\n"
    camera = "{kind: files, path: in, loop: true}"
    cell = Cell(folder, triggers="[]", trigger_every_s=None, more=more, camera=camera)
    client = Client(port)
    try:
        cell.ready()
        numbers = [ordered(client) for _ in range(6)]
        with sync_playwright() as playwright:
            browser = chromium(playwright)
            page = browser.new_page(viewport=PANEL, locale="en-GB")
            page.goto(client.url)
            page.locator(f'#strip button[data-job="{numbers[-1]}"][aria-current="true"]').wait_for()
            take(page, to, "ready")
            page.locator("#live").click()
            page.locator('#live-verdict[data-kind="accepted"]').wait_for()
            take(page, to, "live")
            page.locator("#live").click()
            page.locator(f'#strip button[data-job="{numbers[-1]}"][aria-current="true"]').wait_for()
            page.locator(f'#strip button[data-job="{numbers[2]}"]').click()
            take(page, to, "refused")
            page.keyboard.press("Escape")
            cell.controller.stop()
            page.locator('#banner[data-kind="fault"]').wait_for()
            take(page, to, "not-ready")
            cell.service.kill()
            page.locator('#banner[data-kind="lost"]').wait_for()
            take(page, to, "lost")
            browser.close()
    finally:
        for process in (cell.service, cell.controller):
            if process.running:
                process.stop()
        shutil.rmtree(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
