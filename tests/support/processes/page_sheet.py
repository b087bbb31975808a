"""The page's states on one sheet: `python -m tests.support.processes.page_sheet docs/reports/page-states.jpg`.

Each state at each width, in turn English in light and Russian in dark.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import sync_playwright

from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.page_panel import chromium
from tests.support.processes.page_pictures import ordered
from tests.support.processes.page_states import WIDTHS, play, states, tell
from tests.support.processes.processes import free_port

SHOWN = (
    "starting", "no job yet", "measuring", "accepted", "refused edge_covered", "refused several_blocks", "failed",
    "waiting", "error", "halted", "lost",
)  # fmt: skip
TILE = (480, 270)
GAP = 8
QUALITY = 70


def _tile(picture: bytes) -> np.ndarray:
    """A screenshot, as large as it fits into a tile."""
    seen = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR)
    assert seen is not None
    height, width = seen.shape[:2]
    scale = min(TILE[0] / width, TILE[1] / height)
    small = cv2.resize(seen, (round(width * scale), round(height * scale)), interpolation=cv2.INTER_AREA)
    tile = np.full((TILE[1] + 2 * GAP, TILE[0] + 2 * GAP, 3), 128, np.uint8)
    left = GAP + (TILE[0] - small.shape[1]) // 2
    tile[GAP : GAP + small.shape[0], left : left + small.shape[1]] = small
    return tile


def main(to: Path) -> None:
    """Take all of them and write the sheet."""
    folder, port = Path(tempfile.mkdtemp()), free_port()
    token_file(folder)
    more = f"page: {{port: {port}, token_file: tokens}}\n"
    cell = Cell(folder, triggers="[]", trigger_every_s=None, more=more, camera=ON_SAMPLES)
    try:
        cell.ready()
        ordered(Client(port))
        said = states(Client(port).get("/api/v1/state").json)
        rows = []
        with sync_playwright() as playwright:
            browser = chromium(playwright)
            for number, name in enumerate(SHOWN):
                row = []
                for width, height in WIDTHS.items():
                    context = browser.new_context(viewport={"width": width, "height": height}, bypass_csp=True)
                    language, theme = (("en", "light"), ("ru", "dark"))[(number + len(row)) % 2]
                    cookies = {"language": language, "theme": theme}
                    context.add_cookies([{"name": k, "value": v, "url": Client(port).url} for k, v in cookies.items()])
                    play(context)
                    page = context.new_page()
                    page.goto(Client(port).url)
                    if said[name] is None:
                        tell(page, said["accepted"])
                    tell(page, said[name])
                    page.wait_for_timeout(700)
                    row.append(_tile(page.screenshot()))
                    context.close()
                rows.append(np.hstack(row))
            browser.close()
        cv2.imwrite(str(to), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    finally:
        for process in (cell.service, cell.controller):
            process.stop()
        shutil.rmtree(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
