"""The page for integrators: every register as the code has it, and a picture whose order is what really happens."""

from __future__ import annotations

import json
import re
from pathlib import Path

from benchmarks.timing_diagram import EVENTS, SIGNALS, diagram
from drivers.controller.mailbox.mailbox import HEADER_FIELDS, LINK_FIELDS, SERVICE_FIELDS, MailboxLayout, crc32_of
from service.commissioning.given_shapes import SHAPES
from service.link.register_map import MEANINGS, register_map
from tests.support.processes.processes import Process, free_port, until

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "how-to" / "integrating-a-controller.md").read_text(encoding="utf-8")


def rows(page: str, name_column: int) -> list[tuple[str, str, str]]:
    """Address, name and type of each register in a page's tables."""
    found = []
    for line in page.splitlines():
        cells = [cell.strip().strip("`") for cell in line.strip("|").split("|")]
        if re.match(r"^\d+(–\d+)?$", cells[0]):
            found.append((cells[0], cells[name_column], cells[name_column + 1]))
    return found


def test_every_register_is_there_once_with_its_address_and_type() -> None:
    assert rows(PAGE, 1) == rows(register_map(MailboxLayout()), 2)
    named = {field.name for field in (*LINK_FIELDS, *SERVICE_FIELDS, *HEADER_FIELDS)}
    assert named | {"transfer", "payload", "reserved"} == {name for _, name, _ in rows(PAGE, 1)}


def test_names_in_code_marks_that_look_like_registers_are_registers() -> None:
    settings = {"payload_capacity", "link_address", "longest_read", "longest_write"}
    known = MEANINGS.keys() | settings | {"take_simulated", "take_unaligned", "bad_crc"}
    named = set(re.findall(r"`([a-z]+(?:_[a-z]+)+)`", PAGE))
    assert named <= known, named - known


def test_the_shapes_that_it_names_are_there_and_the_crc_is_the_first_vectors() -> None:
    assert set(re.findall(r"--shape (\w+)", PAGE)) <= SHAPES.keys()
    page = json.loads((DOCS / "reference" / "golden-vectors.json").read_text())["contours"][0]["pages"][0]
    assert f"{crc32_of(page['header'], page['payload']):08X}" in PAGE


def test_the_picture_is_what_the_script_draws_now() -> None:
    assert (DOCS / "pictures" / "timing.svg").read_text(encoding="utf-8") == diagram(), (
        "draw it anew: python -m benchmarks.timing_diagram docs/pictures/timing.svg"
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
