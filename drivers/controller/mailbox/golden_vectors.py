"""Golden vectors: contours, and the registers that the service writes for them, for whoever programs a controller.

`python -m drivers.controller.mailbox.golden_vectors docs/reference/golden-vectors.json` writes them. Coordinates are in
µm.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drivers.controller.mailbox.blocks import LinkBlock, ServiceBlock, encode_link, encode_service
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, withdrawal
from drivers.controller.mailbox.part_block import PlacedPart, with_parts
from drivers.controller.mailbox.words import WordOrder

FORMAT = (
    "Each page's header holds offsets 1 to 31 of the contour block, its payload what follows. The commit register, "
    "offset 0, is written after them, and after the part block where there is one. Registers are numbers from 0 to "
    "65535; coordinates and lengths are in µm, areas in mm², times in ms, angles in millionths of a degree."
)
WORD_ORDERS: tuple[WordOrder, ...] = ("big", "little")


@dataclass(frozen=True)
class Vector:
    """A contour to encode, and how large a page may be."""

    name: str
    message: ContourMessage
    payload_capacity: int = 1984


def _message(*rings: list[tuple[int, int]], **values: object) -> ContourMessage:
    """A message of the worked example's values, but for `values`."""
    first = ContourMessage(
        job_id=7,
        rings_um=tuple(np.array(ring, dtype=np.int64) for ring in rings),
        area_mm2=round(sum(_doubled_area(ring) for ring in rings) / 2e6),
        uncertainty_um=200,
        captured_at=60_000,
        recipe=1,
        simulated=False,
        aligned=False,
        valid_for_ms=30_000,
        session=9,
        trigger=5,
    )
    return replace(first, **values)  # type: ignore[arg-type]  # names and values are in this file


def _doubled_area(ring: list[tuple[int, int]]) -> int:
    return sum(x * ny - nx * y for (x, y), (nx, ny) in zip(ring, ring[1:] + ring[:1], strict=True))


RECTANGLE = [(0, 0), (100_000, 0), (100_000, 50_000), (0, 50_000)]
SQUARE_HOLE = [(10_000, 10_000), (10_000, 30_000), (30_000, 30_000), (30_000, 10_000)]
TRIANGLE_HOLE = [(50_000, 10_000), (60_000, 40_000), (90_000, 10_000)]
FAR_AWAY = [(-2_147_483_648, -1), (2_147_483_647, -1), (2_147_483_647, 0), (-2_147_483_648, 0)]
STAIRS = [
    (0, 0),
    (90_000, 0),
    *((x - step, y) for x, y in ((10_000 * (9 - i), 10_000 * (i + 1)) for i in range(9)) for step in (0, 10_000)),
]

VECTORS = (
    Vector("the protocol's worked example: a rectangle of 100 mm x 50 mm", _message(RECTANGLE)),
    Vector(
        "two holes, from a stored frame, machine frame aligned, uncertainty not known, no trigger of the controller's",
        _message(
            RECTANGLE,
            SQUARE_HOLE,
            TRIANGLE_HOLE,
            uncertainty_um=None,
            simulated=True,
            aligned=True,
            trigger=0,
        ),
    ),
    Vector(
        "numbers that show the order of words: large, negative, and times near their wrap",
        _message(
            FAR_AWAY,
            job_id=0x01020304,
            uncertainty_um=0x00050006,
            captured_at=0xFFFFFF00,
            valid_for_ms=0x00070008,
            recipe=65535,
            session=65535,
            trigger=65535,
        ),
    ),
    Vector("several pages: 20 vertices and a payload of 24 registers", _message(STAIRS), 24),
    Vector(
        "several pages with holes: the ring table fills most of page 1",
        _message(RECTANGLE, SQUARE_HOLE, TRIANGLE_HOLE),
        12,
    ),
)


TILTED = [(20_000, 10_000), (79_999, 10_349), (79_766, 40_348), (19_767, 39_999)]
PARTS: dict[str, tuple[PlacedPart, ...]] = {
    "one part in the worked example's rectangle, turned by a third of a degree": (
        PlacedPart(1, 20_000, 10_000, 333_333, 9_651, 3_205, (np.array(TILTED),)),
    ),
    "two parts, one with a hole, in negative places, one of them 0.5 mm short of its margin": (
        PlacedPart(1, -5_000, 70_000, -90_000_000, 2_500, 3_000, (np.array(RECTANGLE), np.array(SQUARE_HOLE))),
        PlacedPart(258, -2_147_483_648, 2_147_483_647, 180_000_000, -1, 65_537, (np.array(TILTED),)),
    ),
    "a job without a part": (),
}


def golden_vectors() -> dict[str, object]:
    """All of them, ready to become JSON."""
    return {
        "protocol_version": 1,
        "format": FORMAT,
        "contours": [_contour(vector, order) for vector in VECTORS for order in WORD_ORDERS],
        "withdrawals": [
            {"word_order": order, "job_id": job, "session": session, **_page(withdrawal(job, session, order))}
            for job, session in ((7, 9), (0x01020304, 65535))
            for order in WORD_ORDERS
        ],
        "parts": [_parts(name, parts, order) for name, parts in PARTS.items() for order in WORD_ORDERS],
        "blocks": [block for order in WORD_ORDERS for block in _blocks(order)],
    }


def _contour(vector: Vector, word_order: WordOrder) -> dict[str, object]:
    message = vector.message
    return {
        "name": vector.name,
        "word_order": word_order,
        "payload_capacity": vector.payload_capacity,
        "job_id": message.job_id,
        "exterior": message.rings_um[0].tolist(),
        "holes": [ring.tolist() for ring in message.rings_um[1:]],
        "area": message.area_mm2,
        "uncertainty": message.uncertainty_um,
        "captured_at": message.captured_at,
        "valid_for": message.valid_for_ms,
        "recipe": message.recipe,
        "session": message.session,
        "trigger": message.trigger,
        "from_a_live_camera": not message.simulated,
        "aligned": message.aligned,
        "pages": [_page(page) for page in encode_pages(message, vector.payload_capacity, word_order)],
    }


def _parts(name: str, parts: tuple[PlacedPart, ...], word_order: WordOrder) -> dict[str, object]:
    """A part block with the worked example's page."""
    (page,) = with_parts(encode_pages(_message(RECTANGLE), 1984, word_order), parts, 1984, word_order)
    return {
        "name": name,
        "word_order": word_order,
        "parts": [
            {
                "part": part.number,
                "x": part.x_um,
                "y": part.y_um,
                "angle": part.angle_udeg,
                "margin": part.margin_um,
                "needed": part.needed_um,
                "exterior": part.rings_um[0].tolist(),
                "holes": [ring.tolist() for ring in part.rings_um[1:]],
            }
            for part in parts
        ],
        "page": _page(page),
        "part_block": list(page.part),
    }


def _page(page: Page) -> dict[str, list[int]]:
    return {"header": list(page.header), "payload": list(page.payload)}


def _blocks(word_order: WordOrder) -> Iterator[dict[str, object]]:
    link = LinkBlock(1, 77, 5, 2, 25_000, 3, 1, 0x01020305, 7, 1, 9, 0x00010002)
    yield {"block": "link", "word_order": word_order, "values": vars(link), "registers": encode_link(link, word_order)}
    service = ServiceBlock(1, 5, 88, 5, 2, 131, 8, session_ack=9, owner=4711, settled_job=0x00010007)
    registers = encode_service(service, word_order)
    yield {"block": "service", "word_order": word_order, "values": vars(service), "registers": registers}


def as_text() -> str:
    """The file: one line a list of numbers, so that a change shows where it is."""
    return _text(golden_vectors()) + "\n"


def _text(value: object, indent: str = "") -> str:
    deeper = indent + "  "
    if isinstance(value, dict):
        rows = [f"{json.dumps(key)}: {_text(item, deeper)}" for key, item in value.items()]
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        rows = [_text(item, deeper) for item in value]
    else:
        return json.dumps(value, ensure_ascii=False)
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return opening + "\n" + ",\n".join(deeper + row for row in rows) + "\n" + indent + closing


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(as_text(), encoding="utf-8")
