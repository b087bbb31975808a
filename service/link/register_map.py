"""Every register of the mailbox as Markdown, at the addresses of a layout; made from the codec's own tables.

`combtrace register-map` prints it for a configuration; `python -m service.link.register_map
docs/reference/register-map.md` writes the page of the default layout.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum
from pathlib import Path

from drivers.controller.mailbox.blocks import LINK_FIELDS, SERVICE_FIELDS, TEST_VALUE, Answer, ControllerState
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import HEADER_FIELDS, HEADER_REGISTERS, UNKNOWN_UNCERTAINTY
from drivers.controller.mailbox.part_block import PART_HEADER_FIELDS, PART_HEADER_REGISTERS
from drivers.controller.mailbox.words import Field
from service.reasons import Reason
from service.state import State

HEAD = """\
# Register map

All are holding registers: FC3 reads them, FC16 writes them, and FC6 the one named `transfer` (`single_write: fc16` for
controllers without FC6). *Address* is the PDU address, counted from 0, as it goes on the wire; *4xxxxx* is the same
register as most PLC programs number it. What each means in full, and in which order things are written, stands in the
protocol; worked examples are in
[golden-vectors.json](golden-vectors.json). `combtrace register-map` prints this page for your configuration, and
`combtrace probe` tells whether the controller is numbered as it says.
"""

MEANINGS = {
    "controller_state": "what the machine is doing, see below",
    "controller_heartbeat": "changes at least once a second while the program runs",
    "trigger_counter": "a new value asks for one measurement; 0 = none yet in this session",
    "recipe": "recipe number; in the link block 0 = the configured default",
    "block_thickness": "µm above the work plane; 0 = the recipe's",
    "ack_transfer": "the `transfer` value last answered; written last of an answer",
    "ack_result": "that answer, see below",
    "test_echo": "`test_value` + 1, computed as a 32-bit number",
    "last_job": "highest `job_id` that got a final answer; 0 = none",
    "last_result": "that final answer; written before `last_job`",
    "session": "one value a start of the controller's program; in the link block 0 = being filled, disregard it",
    "clock": "ms since the program's start; 0 for ever = no clock",
    "protocol_version": "1",
    "service_state": "what the service is doing, see below",
    "service_heartbeat": "changes at least once a second while the service's main loop runs",
    "trigger_ack": "the `trigger_counter` last taken; counts only with `session_ack`",
    "missed_triggers": "triggers not taken since the service's start, modulo 65536",
    "reject_reason": "why `settled_job` was not accepted or written, see below; 0 = it was",
    "job_id": "in the service block the last job taken; on a page the job it belongs to",
    "test_value": f"{TEST_VALUE} (0x{TEST_VALUE:08X})",
    "session_ack": "the session that `trigger_ack` belongs to",
    "owner": "which service writes here, never 0 once one does",
    "settled_job": "the last job that ended",
    "reserved": "0",
    "transfer": "the commit, by FC6, last and alone; 0 = nothing valid, anything but `ack_transfer` = a page to answer",
    "layout": "1 = absolute coordinates, 0 = `job_id` is taken back",
    "page": "1 to `page_count`",
    "page_count": "pages of the job",
    "ring_count": "rings of the whole contour: 1 exterior and its holes",
    "payload_length": "registers of payload on this page",
    "crc32": "CRC-32 (zlib's) of the header from offset 1, these two taken as 0, then the payload",
    "point_count": "vertices of the whole contour",
    "min_x": "bounding box, µm",
    "min_y": "bounding box, µm",
    "max_x": "bounding box, µm",
    "max_y": "bounding box, µm",
    "area": "mm², holes taken off",
    "uncertainty": f"µm, 95 % bound on the position; {UNKNOWN_UNCERTAINTY} = not known",
    "captured_at": "the controller's `clock` before the exposure, ms",
    "flags": "bit 0 not from a live camera, 1 holes present, 2 last page, 3 machine frame aligned",
    "valid_for": "ms after `captured_at`; later it is refused; 0 = no limit",
    "trigger": "the `trigger_counter` that this contour answers; 0 = another kind of trigger",
    "part_layout": "1",
    "part_count": "parts of this job; 0 = it has none",
    "part_length": "registers behind this header",
    "part_crc32": "CRC-32 (zlib's) of this block from offset 0, these two taken as 0, as long as `part_length` says",
    "page_crc32": "`crc32` of the page that is committed with it, a job's last",
    "part_points": "vertices of all parts",
    "part_rings": "rings of all parts",
    "part_payload": "12 registers a part, then vertices of each ring (u32), then x, y of each vertex in µm (i32)",
    "payload": "on page 1 the ring table (vertices of each ring, u32), then x, y of each vertex in µm (i32)",
}


def register_map(layout: MailboxLayout) -> str:
    """The whole page for `layout`."""
    order = {"big": "the higher half in the first register (ABCD)", "little": "the lower half in the first (CDAB)"}
    words = f"`word_order: {layout.word_order}`: 32-bit values have {order[layout.word_order]}.\n"
    return "\n".join(
        [
            HEAD,
            words,
            "## Link block: the controller writes, the service reads\n",
            *_table(_block(LINK_FIELDS, layout.link_address)),
            "\n## Service block: the service writes it whole, the controller reads\n",
            *_table([*_block(SERVICE_FIELDS, layout.service_address), _reserved(layout)]),
            "\n## Contour block: the service writes, the controller reads\n",
            *_table(_contour_block(layout)),
            *_part_block(layout),
            "\n## Values\n",
            *_values(
                "`controller_state`", ((state, state.name.lower().replace("_", " ")) for state in ControllerState)
            ),
            *_values("`service_state`", ((state, state.label) for state in State)),
            *_values("`ack_result`, `last_result`; * = final for the job", (_answer(answer) for answer in Answer)),
            *_values("`reject_reason`", ((reason, f"`{reason.label}`") for reason in Reason)),
            "",
        ]
    )


Row = tuple[int, int, str, str]
"""First address, registers, name, type."""


def _block(fields: Iterable[Field], start: int) -> Iterator[Row]:
    for field in fields:
        yield start + field.offset, field.width, field.name, field.kind


def _reserved(layout: MailboxLayout) -> Row:
    return layout.service_address + 14, 2, "reserved", "2 × u16"


def _contour_block(layout: MailboxLayout) -> Iterator[Row]:
    start = layout.contour_address
    yield start, 1, "transfer", "u16"
    yield from _block(HEADER_FIELDS, start)
    yield start + 1 + HEADER_REGISTERS, layout.payload_capacity, "payload", "u32, i32"


def _part_block(layout: MailboxLayout) -> Iterator[str]:
    """The part block's table, where the controller has one."""
    start = layout.part_address
    if start is None:
        return
    yield "\n## Part block: written by the service, read with a job's last page: [part-block.md](part-block.md)\n"
    yield from _table(
        [
            *_block(PART_HEADER_FIELDS, start),
            (start + 13, 3, "reserved", "3 × u16"),
            (start + PART_HEADER_REGISTERS, layout.part_capacity, "part_payload", "u16, u32, i32"),
        ]
    )


def _table(rows: Iterable[Row]) -> Iterator[str]:
    yield "| address | 4xxxxx | name | type | meaning |"
    yield "|---:|---:|---|---|---|"
    for address, count, name, kind in rows:
        last = address + count - 1
        span = (str(address), str(address + 400001)) if count == 1 else _span(address, last)
        yield f"| {span[0]} | {span[1]} | {name} | {kind} | {MEANINGS[name]} |"


def _span(first: int, last: int) -> tuple[str, str]:
    return f"{first}–{last}", f"{first + 400001}–{last + 400001}"


def _answer(answer: Answer) -> tuple[Answer, str]:
    return answer, answer.name.lower().replace("_", " ") + (" *" if answer.final else "")


def _values(name: str, pairs: Iterable[tuple[IntEnum, str]]) -> Sequence[str]:
    return [f"- {name}: " + ", ".join(f"{int(value)} {text}" for value, text in pairs)]


def main(page: Path) -> None:
    """Write the default layout's page."""
    page.write_text(register_map(MailboxLayout()), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
