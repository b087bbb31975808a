"""The picture of one contour's way is as it is drawn now, and its order is what really happens."""

from __future__ import annotations

import re
from pathlib import Path

from benchmarks.drawings.timing_diagram import EVENTS, SIGNALS, diagram
from tests.support.processes.processes import Process, free_port, until

DOCS = Path(__file__).parents[2] / "docs"


def test_the_picture_is_what_the_script_draws_now() -> None:
    assert (DOCS / "pictures" / "timing.svg").read_text(encoding="utf-8") == diagram(), (
        "draw it anew: python -m benchmarks.drawings.timing_diagram docs/pictures/timing.svg"
    )


TOLD = {
    2: "read   trigger_counter 1",
    3: "trigger_ack 1, job_id {job}, session_ack",
    5: "wrote  transfer 0 ",
    6: "wrote  page 1 of 1 of job {job}",
    7: "(the commit)",
    10: "ack_result 1 (accepted), last_job {job}, last_result 1",
    12: "service_state 5 (ready), reject_reason 0, settled_job {job}",
}
"""What the service's log says of the picture's events, those that pass between the two."""


def test_the_picture_shows_the_order_in_which_service_and_controller_really_write(tmp_path: Path) -> None:
    port = free_port()
    simulated = ("simulate-controller", "--tcp", f"127.0.0.1:{port}", "--trigger-every", "0.5")
    controller = Process(tmp_path / "controller.log", *simulated)
    service = Process(
        tmp_path / "service.log",
        *("simulate-service", "--controller", f"127.0.0.1:{port}", "--state", tmp_path / "state"),
    )
    try:
        settled = until(lambda: re.search(r"settled_job (\d+)\n", service.text), what="a settled job")
    finally:
        service.stop()
        controller.stop()
    lines = service.text.splitlines()
    begun = next(n for n, line in enumerate(lines) if TOLD[2] in line)
    told = [text.format(job=settled[1]) for text in TOLD.values()]
    places = [next((n for n, line in enumerate(lines) if n >= begun and text in line), -1) for text in told]
    assert places == sorted(places)
    assert places[0] == begun
    changes = {number for signal in SIGNALS for number, _ in signal.values}
    assert set(TOLD) <= changes
    assert max(changes) == len(EVENTS)
