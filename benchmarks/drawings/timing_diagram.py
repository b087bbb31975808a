"""Draws one contour's way over time, register by register: `python -m benchmarks.drawings.timing_diagram FILE.svg`.

The order of events is the protocol's; a test holds it against what service and controller really exchange.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

CONTROLLER, SERVICE = "#1f6f43", "#1c4f9c"
LEFT, TOP, COLUMN, ROW, HALF = 250, 150, 92, 40, 12
LETTERS = "font-family='DejaVu Sans, Arial, sans-serif'"


@dataclass(frozen=True)
class Signal:
    """A register, or several that change together, and its values: (number of the event, value), the first at 0."""

    name: str
    colour: str
    values: tuple[tuple[int, str], ...]


EVENTS = (
    "recipe and thickness",
    "the trigger",
    "job acknowledged",
    "exposure, tracing",
    "nothing valid",
    "the page, read back",
    "the commit",
    "copied, checked",
    "kept in memory",
    "the answer",
    "cutting begins",
    "settled",
)
"""What happens, in this order; event n is column n, from 1 on."""

SIGNALS = (
    Signal("recipe, block_thickness", CONTROLLER, ((0, "0"), (1, "2, 25000"))),
    Signal("trigger_counter", CONTROLLER, ((0, "0"), (2, "1"))),
    Signal("job_id", SERVICE, ((0, "6"), (3, "7"))),
    Signal("trigger_ack, session_ack", SERVICE, ((0, "0, 0"), (3, "1, 9"))),
    Signal("service_state", SERVICE, ((0, "5 Ready"), (3, "6 SingleExecution"), (12, "5"))),
    Signal("transfer", SERVICE, ((0, "2"), (5, "0"), (7, "3"))),
    Signal("header, payload", SERVICE, ((0, "job 6"), (6, "job 7, page 1 of 1"))),
    Signal("last_result, last_job", CONTROLLER, ((0, "1, 6"), (9, "1, 7"))),
    Signal("ack_result, ack_transfer", CONTROLLER, ((0, "1, 2"), (10, "1, 3"))),
    Signal("controller_state", CONTROLLER, ((0, "1 ready"), (11, "2 busy"))),
    Signal("settled_job, reject_reason", SERVICE, ((0, "6, 0"), (12, "7, 0"))),
)


def diagram() -> str:
    """The picture as SVG."""
    width, height = LEFT + COLUMN * (len(EVENTS) + 1), TOP + ROW * len(SIGNALS) + 40
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' viewBox='0 0 {width} {height}'>",
        f"<rect width='{width}' height='{height}' fill='white'/>",
        _words(12, 28, "green: the controller writes", CONTROLLER),
        _words(12, 50, "blue: the service writes", SERVICE),
    ]
    for number, event in enumerate(EVENTS, start=1):
        x = _x(number)
        parts.append(
            f"<line x1='{x}' y1='{TOP - 24}' x2='{x}' y2='{height - 30}' stroke='#bbb' stroke-dasharray='3 4'/>"
        )
        parts.append(_words(x, TOP - 32, f"{number} {event}", "#333", turn=-28, size=13))
    for row, signal in enumerate(SIGNALS):
        parts += _signal(signal, TOP + ROW * row + ROW // 2, width - 12)
    parts.append(_words(LEFT, height - 10, "time, not to scale", "#666", size=12))
    return "\n".join([*parts, "</svg>", ""])


def _signal(signal: Signal, y: int, end: int) -> list[str]:
    parts = [_words(12, y + 5, signal.name, signal.colour)]
    starts = [_x(number) if number else LEFT for number, _ in signal.values]
    for (_, value), start, stop in zip(signal.values, starts, [*starts[1:], end], strict=True):
        slope = 5
        ring = [
            (start, y),
            (start + slope, y - HALF),
            (stop - slope, y - HALF),
            (stop, y),
            (stop - slope, y + HALF),
            (start + slope, y + HALF),
        ]
        points = " ".join(f"{px},{py}" for px, py in ring)
        parts.append(f"<polygon points='{points}' fill='white' stroke='{signal.colour}' stroke-width='1.6'/>")
        parts.append(_words(start + 10, y + 5, value, "#111", size=13))
    return parts


def _x(number: int) -> int:
    return LEFT + COLUMN * number - 20


def _words(x: int, y: int, text: str, colour: str, *, turn: int = 0, size: int = 14) -> str:
    turned = f" transform='rotate({turn} {x} {y})'" if turn else ""
    return f"<text x='{x}' y='{y}' {LETTERS} font-size='{size}' fill='{colour}'{turned}>{escape(text)}</text>"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(diagram(), encoding="utf-8")
